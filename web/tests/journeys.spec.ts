import { type Page, expect, test } from "@playwright/test";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { PNG } from "pngjs";
import { chooseFiles, screen, strict } from "./page";
import { content, deltille, drawn, folder, program, tetrahedron } from "./pictures";

const root = fileURLToPath(new URL("../..", import.meta.url));
const scratch = () => mkdtempSync(join(tmpdir(), "page-"));

type Detection = { grids: { corners: { id: number; x: number; y: number }[] }[] };
const corners = (of: Detection) => of.grids.flatMap((grid) => grid.corners);

/** The largest relative difference of two corresponding numbers; infinite if anything else differs. */
function apart(one: unknown, other: unknown): number {
  if (typeof one === "number" && typeof other === "number") return Math.abs(one - other) / Math.max(Math.abs(one), Math.abs(other), 1e-300);
  if (typeof one !== "object" || typeof other !== "object" || one === null || other === null) return one === other ? 0 : Infinity;
  const [pairs, others] = [Object.entries(one), Object.entries(other)];
  if (pairs.length !== others.length) return Infinity;
  return Math.max(0, ...pairs.map(([key, value], i) => (others[i]?.[0] === key ? apart(value, others[i]?.[1]) : Infinity)));
}

/** The numbers of a text, and the text between them. */
function split(text: string): { words: string[]; numbers: number[] } {
  const number = /-?\d+(?:\.\d+)?(?:e-?\d+)?/g;
  return { words: text.split(number), numbers: (text.match(number) ?? []).map(Number) };
}

async function downloaded(page: Page, click: () => Promise<void>): Promise<Buffer> {
  const [download] = await Promise.all([page.waitForEvent("download"), click()]);
  return readFileSync(await download.path());
}

const press = (page: Page, button: string) => downloaded(page, () => page.getByRole("button", { name: button, exact: true }).click());

const choose = (page: Page, kind: string) => page.getByRole("radio", { name: kind, exact: true }).check();
const open = (page: Page, details: string) => page.getByText(details, { exact: true }).click();

/** Drops files as from another window. */
async function drop(page: Page, files: { name: string; content: Buffer }[]): Promise<void> {
  const given = files.map(({ name, content }) => ({ name, text: content.toString("base64") }));
  const data = await page.evaluateHandle((given) => {
    const transfer = new DataTransfer();
    for (const { name, text } of given) transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    return transfer;
  }, given);
  await page.locator(".drop").dispatchEvent("drop", { dataTransfer: data });
}

test.beforeEach(strict);

test.describe("make", () => {
  test("a board is designed, verified line by line, and downloaded as the program writes it", async ({ page }) => {
    await page.goto("/");
    await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
    await page.getByLabel("Rows of corners").fill("1");
    await expect(page.getByRole("alert")).toContainText("Rows of corners: enter a whole number from 2 to 500.");
    await screen(page, "make-problem");
    await page.getByLabel("Rows of corners").fill("8");
    await page.getByLabel("Corners per row").fill("9");
    await expect(page.getByText("72 corners")).toBeVisible();
    await expect(page.getByRole("alert")).toBeHidden();
    await expect(page.getByText(/ids of delTag25h7 remain for other targets/)).toBeVisible();
    await expect(page.getByText(/Working range of your camera: 15 cm, where the target fills the image, to 1\.8 m/)).toBeVisible();
    await expect.poll(() => page.url()).toContain("rows=8&cols=9");

    const made = scratch();
    drawn("board", "--rows", "8", "--cols", "9", "--pdf", "--svg", "--png", "--dsc", "-o", made);
    expect((await press(page, "Download PDF")).equals(readFileSync(join(made, "board.pdf")))).toBe(true);
    // Verification begins automatically: of the PDF, and of the others once they are shown.
    await expect(page.getByText("Verified: the PDF shows exactly this target.")).toBeVisible({ timeout: 60_000 });
    await screen(page, "make");
    await open(page, "More formats");
    for (const [button, file] of [["SVG", "board.svg"], ["PNG", "board.png"], ["JSON", "board.json"], ["DSC", "board.dsc"]] as const) {
      expect((await press(page, button)).equals(readFileSync(join(made, file))), file).toBe(true);
    }
    await expect(page.getByText(/Verified: all \d+ files show exactly this target/)).toBeVisible({ timeout: 90_000 });
    const lines = await page.locator(".lines > li").allTextContents();
    const said = deltille("verify", join(made, "board.json"), ...["pdf", "svg", "png", "dsc"].map((format) => join(made, `board.${format}`)));
    for (const line of said.trim().split("\n").slice(0, -1)) expect(lines).toContain(line);
    await screen(page, "make-formats");
    // A change ends it.
    await page.getByLabel("Rows of corners").fill("9");
    await expect(page.locator(".lines > li")).toHaveCount(0);
    await page.getByLabel("Rows of corners").fill("8");
    // The address contains the settings.
    await page.reload();
    await expect(page.getByText("72 corners")).toBeVisible({ timeout: 30_000 });
  });

  test("a link contains all settings", async ({ page, context }) => {
    await context.grantPermissions(["clipboard-read", "clipboard-write"]);
    await page.goto("/");
    await choose(page, "Checkerboard");
    await page.getByLabel("Tag family").selectOption("aprilTag36h11");
    await page.getByText("More settings").click();
    await page.getByLabel("First tag id").fill("40");
    await page.getByLabel("Tagged squares").selectOption("white");
    await page.getByLabel("Orientation").selectOption("portrait");
    await page.getByLabel("Paper", { exact: true }).selectOption("A3");
    await page.getByLabel("Tile edge, mm").fill("18.5");
    await page.getByRole("button", { name: "Copy a link" }).click();
    await expect(page.getByRole("button", { name: "Copied." })).toBeVisible();
    const link = await page.evaluate(() => navigator.clipboard.readText());
    await expect(page.getByText(/corners, \d+ tags/)).toBeVisible({ timeout: 30_000 });
    await open(page, "More formats");
    const first = await press(page, "JSON");
    const other = await context.newPage();
    await other.goto(link);
    await expect(other.getByText(/corners, \d+ tags/)).toBeVisible({ timeout: 30_000 });
    await open(other, "More formats");
    expect((await press(other, "JSON")).equals(first)).toBe(true);
    const made = scratch();
    drawn("checkerboard", "--rows", "10", "--cols", "11", "--tags", "aprilTag36h11", "--first-id", "40", "--tags-in", "white", "--orientation", "portrait", "--paper", "A3", "--edge", "18.5mm", "-o", made);
    expect(first.equals(readFileSync(join(made, "checkerboard.json")))).toBe(true);
  });

  test("templates are offered, saved, and accepted by the program", async ({ page }) => {
    await page.goto("/");
    await open(page, "More formats");
    for (const file of readdirSync(join(root, "templates")).filter((name) => name.endsWith(".toml"))) {
      const name = file.replace(".toml", "");
      await page.getByLabel("Start from a template").selectOption(name);
      await expect(page.getByLabel("Name", { exact: true })).toHaveValue(name);
      const [made, again] = [scratch(), scratch()];
      const command = readFileSync(join(root, "templates", file), "utf8").includes('"checkerboard"') ? "checkerboard" : "board";
      drawn(command, "--template", join(root, "templates", file), "-o", made);
      expect((await press(page, "Download PDF")).equals(readFileSync(join(made, `${name}.pdf`))), name).toBe(true);
      const saved = await press(page, "Save the settings");
      writeFileSync(join(again, "saved.toml"), saved);
      drawn(command, "--template", join(again, "saved.toml"), "-o", again);
      expect(readFileSync(join(again, `${name}.json`)).equals(readFileSync(join(made, `${name}.json`))), name).toBe(true);
      await drop(page, [{ name: "saved.toml", content: saved }]);
      expect((await press(page, "JSON")).equals(readFileSync(join(made, `${name}.json`))), name).toBe(true);
    }
    // A template saved by the program, for a board over several pages.
    const wall = scratch();
    const saved = join(wall, "saved.toml");
    drawn("board", "--rows", "5", "--cols", "6", "--edge", "40mm", "--paper", "A4", "--poster", "--name", "wall", "--save-template", saved, "-o", wall);
    await drop(page, [{ name: "saved.toml", content: readFileSync(saved) }]);
    await expect(page.getByLabel("Name", { exact: true })).toHaveValue("wall");
    expect((await press(page, "Download PDF")).equals(readFileSync(join(wall, "wall.pdf")))).toBe(true);
  });

  test("an icosahedron is rotated and unfolded, and its files equal the program's", async ({ page }) => {
    await page.goto("/");
    await choose(page, "Icosahedron");
    await expect(page.getByText("720 corners")).toBeVisible({ timeout: 30_000 });
    await screen(page, "make-net");
    await page.getByRole("button", { name: "Solid", exact: true }).click();
    const canvas = page.locator(".solid canvas");
    await expect(canvas).toBeVisible({ timeout: 30_000 });
    await expect(page.getByLabel("Unfold the net")).toBeVisible();
    const shots = [];
    for (const part of ["0", "50", "100"]) {
      await page.getByLabel("Unfold the net").fill(part);
      shots.push(await canvas.screenshot());
    }
    expect(shots[0]?.equals(shots[1] as Buffer) || shots[1]?.equals(shots[2] as Buffer)).toBe(false);
    await page.getByLabel("Unfold the net").fill("0");
    expect((await canvas.screenshot()).equals(shots[0] as Buffer)).toBe(true);
    await page.getByLabel("Unfold the net").fill("50");
    await screen(page, "make-unfolded");
    const made = scratch();
    drawn("icosahedron", "--gltf", "--obj", "--stl", "--dxf", "--pdf", "-o", made);
    await open(page, "More formats");
    for (const [button, file] of [["GLB", "icosahedron.glb"], ["STL", "icosahedron.stl"], ["DXF (net)", "icosahedron-net.dxf"], ["DXF (panels)", "icosahedron-panels.dxf"], ["Download PDF", "icosahedron.pdf"]] as const) {
      expect((await press(page, button)).equals(readFileSync(join(made, file))), file).toBe(true);
    }
    // Bare faces, white on black.
    await choose(page, "Octahedron");
    await page.getByLabel("Tag family").selectOption("");
    await page.getByText("More settings").click();
    await page.getByLabel("White tiles on black").check();
    await expect(page.getByText("288 corners")).toBeVisible({ timeout: 30_000 });
    drawn("octahedron", "--untagged", "--invert", "--pdf", "-o", made);
    expect((await press(page, "Download PDF")).equals(readFileSync(join(made, "octahedron.pdf")))).toBe(true);
  });

  test("the paper and the edge are stated, and a large board is printed on A4", async ({ page }) => {
    await page.goto("/");
    await expect(page.getByText("A4 landscape, 297 × 210 mm, edge 20 mm.")).toBeVisible({ timeout: 30_000 });
    await page.getByLabel("Tile edge, mm").fill("40");
    const said = page.locator(".sheets");
    await expect(said).toHaveText(/^A2 landscape, 594 × 420 mm, edge 40 mm; fits on A4 in \d+ pages\. Print on A4$/, { timeout: 30_000 });
    const count = Number(/in (\d+) pages/.exec((await said.textContent()) ?? "")?.[1]);
    await page.getByRole("button", { name: "Print on A4" }).click();
    await expect(said).toHaveText(`${count} pages, A4 portrait, 210 × 297 mm, edge 40 mm.`);
    const made = scratch();
    drawn("board", "--rows", "10", "--cols", "11", "--edge", "40mm", "--paper", "A4", "--poster", "-o", made);
    expect((await press(page, "Download PDF")).equals(readFileSync(join(made, "board.pdf")))).toBe(true);
    const { sheets } = JSON.parse(readFileSync(join(made, "board.json"), "utf8")) as { sheets: { pages: unknown[] }[] };
    expect(sheets[0]?.pages).toHaveLength(count);
    await page.getByLabel("Paper", { exact: true }).selectOption("other size…");
    await page.getByLabel("Paper width, mm").fill("700");
    await page.getByLabel("Paper height, mm").fill("500");
    await expect(said).toContainText("landscape, 700 × 500 mm, edge 40 mm");
    // A large board takes a while; what belongs to the one before is gone.
    await page.goto("/#make?rows=150&cols=150&edge_mm=4&family=");
    await expect(said).toHaveText("Drawing the target…");
    await expect(page.locator("img.past")).toBeVisible();
    await expect(page.getByRole("button", { name: "Download PDF", exact: true })).toBeDisabled();
    await expect(page.getByText("22500 corners")).toBeVisible({ timeout: 60_000 });
    await expect(page.locator("img.past")).toBeHidden();
    await expect(page.getByRole("button", { name: "Download PDF", exact: true })).toBeEnabled();
  });

  test("all targets and options of the program are on the page", async ({ page }) => {
    const made = scratch();
    const logo = Buffer.from('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 8 4"><path d="M0 4L4 0L8 4Z"/><circle cx="4" cy="3" r="1" fill="white"/></svg>');
    writeFileSync(join(made, "logo.svg"), logo);
    execFileSync(join(dirname(program), "deltag"), ["gen-family", "d16h5", "--free", "centre", "--method", "lexicode", "--name", "holed", "-o", "holed.json"], { cwd: made });
    const compare = async (files: Record<string, string>, ...given: string[]) => {
      execFileSync(program, [...given, "--no-verify", "--force", "-o", "."], { cwd: made, stdio: "ignore" });
      for (const [button, file] of Object.entries(files)) expect((await press(page, button)).equals(readFileSync(join(made, file))), file).toBe(true);
    };
    await page.goto("/");
    await open(page, "More formats");
    await open(page, "More settings");
    await choose(page, "ChArUco");
    await expect(page.getByText("40 corners, 27 tags")).toBeVisible({ timeout: 30_000 });
    await compare({ "Download PDF": "charuco.pdf", JSON: "charuco.json", "SVG (laser)": "charuco-laser.svg" }, "charuco", "--squares", "9x6", "--pdf", "--laser", "svg");
    await page.getByLabel("Dictionary").selectOption("DICT_APRILTAG_36h11");
    await page.getByLabel("Marker edge, mm").fill("20");
    await page.getByLabel("Pattern of OpenCV before 4.6").check();
    await screen(page, "make-charuco");
    await compare({ "Download PDF": "charuco.pdf", JSON: "charuco.json" }, "charuco", "--squares", "9x6", "--marker", "20mm", "--dictionary", "apriltag_36h11", "--legacy");
    await choose(page, "AprilGrid");
    await page.getByLabel("Gap between tags, in tags").fill("0.25");
    await page.getByLabel("First tag id").fill("12");
    await page.getByLabel("Add a page with instructions").check();
    await compare({ "Download PDF": "aprilgrid.pdf", JSON: "aprilgrid.json", "YAML (Kalibr)": "aprilgrid.yaml" }, "aprilgrid", "--tags", "7x5", "--gap", "0.25", "--first-id", "12", "--guide-page");
    await page.getByLabel("First tag id").fill("0");
    await page.getByLabel("Add a page with instructions").uncheck();
    await choose(page, "Circle grid");
    await page.getByLabel("Circles per row").fill("4");
    await page.getByLabel("Shift every second row").check();
    await page.getByLabel("Note on the label").fill("lab 3");
    await compare({ "Download PDF": "circles.pdf", JSON: "circles.json" }, "circles", "--circles", "4x7", "--asymmetric", "--note", "lab 3");
    await page.getByLabel("Note on the label").fill("");
    for (const [name, size] of [["Cube", []], ["Cuboid", ["--size", "120x90x60mm"]]] as const) {
      await choose(page, name);
      if (size.length > 0) await page.getByLabel("Edges, x × y × z").fill("120x90x60mm");
      const stem = name.toLowerCase();
      await compare({ "Download PDF": `${stem}.pdf`, JSON: `${stem}.json`, GLB: `${stem}.glb`, "3MF": `${stem}.3mf` }, stem, ...size, "--pdf", "--gltf", "--3mf");
    }
    await screen(page, "make-cuboid");
    // A two-sided checkerboard with a logo, cut by a laser.
    await choose(page, "Checkerboard");
    await page.getByLabel("Rows of corners").fill("10");
    await page.getByLabel("Corners per row").fill("11");
    await page.getByLabel("Tag family").selectOption("aprilTag36h11");
    await page.getByLabel("Two sides, this far apart, mm").fill("3");
    await drop(page, [{ name: "logo.svg", content: logo }]);
    await expect(page.getByRole("button", { name: "Remove the logo" })).toBeVisible();
    await page.getByLabel("kerf").fill("0.2");
    await compare({ "Download PDF": "checkerboard.pdf", JSON: "checkerboard.json", "DXF (laser)": "checkerboard-laser.dxf" }, "checkerboard", "--rows", "10", "--cols", "11", "--tags", "aprilTag36h11", "--two-sided", "3mm", "--logo", "logo.svg", "--laser", "dxf", "--kerf", "0.2mm", "--pdf");
    await screen(page, "make-checkerboard-logo");
    await page.getByRole("button", { name: "Remove the logo" }).click();
    await page.getByLabel("Two sides, this far apart, mm").fill("");
    // Holes need the family of the user.
    await choose(page, "Deltille board");
    await page.getByLabel("kerf").fill("");
    await drop(page, [{ name: "holed.json", content: readFileSync(join(made, "holed.json")) }]);
    await page.getByLabel("Hole in each tag, mm").fill("2");
    await page.getByLabel("Tile edge, mm").fill("40");
    await expect(page.getByText(/110 corners, \d+ tags/)).toBeVisible();
    await compare({ "Download PDF": "board.pdf", JSON: "board.json" }, "board", "--rows", "10", "--cols", "11", "--edge", "40mm", "--family", "holed.json", "--hole", "2mm");
    await expect(page.locator(".lines .passed").first()).toContainText("board.pdf: verified, 110 corners", { timeout: 60_000 });
  });

  test("invalid numbers are reported by the label of their field and draw nothing", async ({ page }) => {
    await page.goto("/");
    await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
    for (const [label, wrong, right, said] of [
      ["Rows of corners", "", "8", "Rows of corners: enter a whole number from 2 to 500."],
      ["Corners per row", "3.5", "9", "Corners per row: enter a whole number from 2 to 500."],
      ["Tile edge, mm", "-1", "", "Tile edge, mm: enter a number from 1 to 1000."],
      ["First tag id", "1e10", "0", "First tag id: enter a whole number from 0 to 4294967295."],
    ] as const) {
      if (label === "First tag id") await page.getByText("More settings").click();
      await page.getByLabel(label).fill(wrong);
      await expect(page.getByRole("alert")).toHaveText(said);
      await expect(page.getByRole("button", { name: "Download PDF", exact: true })).toBeDisabled();
      await page.getByLabel(label).fill(right);
      await expect(page.getByRole("alert")).toBeHidden();
    }
    await expect(page.getByText("72 corners")).toBeVisible();
    await expect(page.getByText(/Working range of your camera: 15 cm/)).toBeVisible();
    await page.getByLabel("Field of view, °").fill("0");
    await expect(page.getByText("Horizontal field of view, °: enter a number from 1 to 170.")).toBeVisible();
    await page.getByLabel("Field of view, °").fill("60");
    await expect(page.getByText(/Working range of your camera: 15 cm/)).toBeVisible();
    // A checkerboard has no tags by default.
    await choose(page, "Checkerboard");
    await expect(page.getByLabel("Tag family")).toHaveValue("");
    await expect(page.getByLabel("First tag id")).toHaveCount(0);
    // The reason stays beside the button after another message.
    await page.getByLabel("Name", { exact: true }).fill("größe");
    await expect(page.locator(".get .state")).toContainText("Name: enter 1 to 64 letters");
    await drop(page, [{ name: "logo.png", content: Buffer.from("no logo") }]);
    await expect(page.getByRole("alert")).toContainText("logo.png: choose a file of type");
    await expect(page.locator(".get .state")).toContainText("Name: enter 1 to 64 letters");
  });

  test("invalid settings in an address fall back to defaults, and the address follows the settings", async ({ page }) => {
    for (const nonsense of ["kind=foo&orientation=upside&tags_in=purple", "kind=mesh&name=part", "rows=many&colour=red&paper=B9"]) {
      await page.goto("about:blank");
      await page.goto(`/#make?${nonsense}`);
      await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
      await expect(page.getByRole("alert")).toHaveText(`The address contains unknown settings or invalid values, which are ignored: ${nonsense.replaceAll("&", ", ")}; set them in the form instead.`);
    }
    await page.getByLabel("Rows of corners").fill("9");
    await expect(page.getByRole("alert")).toBeHidden();
    await page.goto("about:blank");
    await page.goto("/#make?first_id=-1");
    await expect(page.getByRole("alert")).toHaveText("First tag id: enter a whole number from 0 to 4294967295.");
    await expect(page.getByLabel("First tag id")).toBeVisible();
    await page.goto("about:blank");
    await page.goto("/#make?kind=icosahedron&paper=900x1300mm");
    await expect(page.getByText("720 corners")).toBeVisible({ timeout: 30_000 });
    await expect(page.getByLabel("Name", { exact: true })).toHaveValue("icosahedron");
    await expect(page.getByLabel("Paper", { exact: true })).toHaveValue("900x1300mm");
    // Settings return to the address after a visit to another part.
    for (const name of ["Detect", "Make"]) await page.getByRole("link", { name, exact: true }).click();
    await expect.poll(() => page.url()).toContain("kind=icosahedron&paper=900x1300mm");
    await page.reload();
    await expect(page.getByText("720 corners")).toBeVisible({ timeout: 30_000 });
    await page.goto("/#make?rows=1");
    await expect(page.getByRole("alert")).toContainText("Rows of corners");
    // A mesh is not part of the address.
    await page.goto("/");
    await drop(page, [{ name: "body.obj", content: Buffer.from(tetrahedron) }]);
    await expect(page.locator(".solid canvas")).toBeVisible({ timeout: 30_000 });
    await expect(page.getByRole("button", { name: "Copy a link" })).toBeHidden();
    expect(page.url()).not.toContain("mesh");
    await drop(page, [{ name: "other.json", content: Buffer.from('{"kind": "other"}') }]);
    await expect(page.getByRole("alert")).toHaveText("other.json: not a settings file");
    await drop(page, [{ name: "logo.png", content: Buffer.from("no logo") }]);
    await expect(page.getByRole("alert")).toHaveText("logo.png: choose a file of type .toml, .json, .obj, .stl, .glb, .svg");
    await drop(page, [{ name: "board.json", content: content("board.json") }]);
    await expect(page.getByRole("alert")).toContainText("board.json: this is the description of a finished target");
  });

  test("meshes of all formats can be dropped", async ({ page }) => {
    await page.goto("/");
    const made = scratch();
    writeFileSync(join(made, "body.obj"), tetrahedron);
    drawn("solid", "--mesh", join(made, "body.obj"), "--gltf", "--pdf", "-o", made);
    await drop(page, [{ name: "body.obj", content: Buffer.from(tetrahedron) }]);
    await expect(page.locator(".solid canvas")).toBeVisible({ timeout: 30_000 });
    await open(page, "More formats");
    expect((await press(page, "JSON")).equals(readFileSync(join(made, "body.json")))).toBe(true);
    expect((await press(page, "GLB")).equals(readFileSync(join(made, "body.glb")))).toBe(true);
    const facts = await page.getByText(/corners, \d+ tags/).textContent();
    await screen(page, "make-mesh");
    drawn("solid", "--mesh", join(made, "body.obj"), "--stl", "-o", made, "--force");
    for (const file of ["body.stl", "body.glb"]) {
      await choose(page, "Deltille board");
      await expect(page.getByText("110 corners")).toBeVisible();
      await drop(page, [{ name: file, content: readFileSync(join(made, file)) }]);
      await expect(page.getByText(facts ?? "")).toBeVisible({ timeout: 30_000 });
    }
    await drop(page, [{ name: "open.obj", content: Buffer.from("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n") }]);
    await expect(page.getByRole("alert")).toContainText(/\w+ \w+/);
    await drop(page, [{ name: "noise.glb", content: Buffer.from("glTF no more") }]);
    await expect(page.getByRole("alert")).toContainText("noise.glb: ");
    await drop(page, [{ name: "a.toml", content: Buffer.from("rows = 5\nnonsense = 3\n") }]);
    await expect(page.getByRole("alert")).toContainText("a.toml: nonsense: unknown setting");
    await drop(page, [{ name: "a.json", content: Buffer.from("[1, 2") }]);
    await expect(page.getByRole("alert")).toContainText("a.json: not a settings file");
  });
});

test.describe("see", () => {
  test("corners and result files of dropped photographs equal those of the program", async ({ page }) => {
    await page.goto("/#see");
    await drop(page, ["board.json", "0.png", "1.png"].map((name) => ({ name, content: content(name) })));
    await expect(page.getByRole("button", { name: /0\.png 72 corners/ })).toBeVisible({ timeout: 30_000 });
    const out = scratch();
    deltille("detect", join(folder, "0.png"), "--target", join(folder, "board.json"), "--ink", "auto", "--format", "json,csv,orpc", "--overlay", "-o", out);
    const json = await press(page, "JSON");
    const [found, expected] = [json.toString(), readFileSync(join(out, "0.json"), "utf8")].map((text) => JSON.parse(text) as Detection);
    expect(corners(found as Detection).length).toBe(72);
    const worst = Math.max(...corners(found as Detection).map(({ x, y }, i) => Math.hypot(x - (corners(expected as Detection)[i]?.x ?? NaN), y - (corners(expected as Detection)[i]?.y ?? NaN))));
    console.log(`corners differ by ${worst} px at most`);
    expect(worst).toBeLessThan(1e-9);
    // Standard deviations of tone and ink depend on the processor's order of summation.
    expect(apart(found, expected)).toBeLessThan(1e-10);
    expect(corners(found as Detection)).toEqual(corners(expected as Detection));
    await open(page, "More formats");
    for (const [button, file] of [["CSV", "0.csv"], ["ORPC", "0.orpc"], ["Overlay (JPEG)", "0.overlay.jpg"]] as const) {
      expect((await press(page, button)).equals(readFileSync(join(out, file))), file).toBe(true);
    }
    const ms = await page.locator(".stage").getByText(/\d+ ms\./).textContent();
    console.log(`1280 × 960 is processed in ${/(\d+) ms/.exec(ms ?? "")?.[1]} ms`);
    const canvas = page.locator("canvas.photo");
    const [box, at] = [await canvas.boundingBox(), corners(found as Detection)[30]];
    if (!box || !at) throw new Error("the image is missing");
    await canvas.hover({ position: { x: ((at.x + 2) * box.width) / 1280, y: ((at.y + 1) * box.width) / 1280 } });
    await expect(page.locator(".lens")).toBeVisible();
    await expect(page.getByText(/Row \d+, column \d+, id \d+: ± 0\.0\d+ × 0\.0\d+ px/)).toBeVisible();
    await screen(page, "see");
    // The keyboard moves from corner to corner.
    await canvas.focus();
    await page.keyboard.press("ArrowRight");
    const one = await page.getByText(/Row \d+, column/).textContent();
    await page.keyboard.press("ArrowDown");
    await expect(page.getByText(one ?? "")).toBeHidden();
    await page.keyboard.press("Escape");
    await expect(page.locator(".lens")).toBeHidden();
  });

  test("photographs of one print are processed with their combined ink estimate, as by the program", async ({ page }) => {
    const out = scratch();
    const photograph = readFileSync(join(root, "tests/photographs/robot-hand-0108.png"));
    const darker = PNG.sync.read(photograph);
    darker.data = Buffer.from(darker.data.map((value, i) => (i % 4 === 3 ? value : 0.8 * value)));
    writeFileSync(join(out, "one.png"), photograph);
    writeFileSync(join(out, "other.png"), PNG.sync.write(darker));
    deltille("detect", join(out, "one.png"), join(out, "other.png"), "--grid", "deltille", "-o", out);
    await page.goto("/#see");
    await chooseFiles(page, [join(out, "one.png"), join(out, "other.png")]);
    await expect(page.getByText(/Combined estimate from 2 photographs of one print: .*[\d.]+ ± [\d.]+ %/)).toBeVisible({ timeout: 60_000 });
    for (const name of ["one", "other"]) {
      await page.getByRole("button", { name: new RegExp(`^${name}\\.png`) }).click();
      const [found, expected] = [(await press(page, "JSON")).toString(), readFileSync(join(out, `${name}.json`), "utf8")].map((text) => JSON.parse(text) as Detection);
      expect(corners(found as Detection).length).toBe(110);
      expect(apart(found, expected)).toBeLessThan(1e-9);
    }
    await screen(page, "see-ink");
  });

  test("targets are identified by their tags, also in the sample images", async ({ page }) => {
    await page.goto("/#see");
    await page.getByRole("button", { name: "Use the rendered sample board" }).click();
    await expect(page.getByText("Identified: a deltille board of 9 × 12 corners with delTag25h7 tags, starting at id 0.")).toBeVisible({ timeout: 60_000 });
    await expect(page.getByRole("button", { name: /board\.png 108 corners, 12 tags/ })).toBeVisible({ timeout: 30_000 });
    await page.getByLabel("Tile edge, mm").fill("0");
    await page.keyboard.press("Tab");
    await expect(page.getByRole("alert")).toHaveText("Tile edge, mm: enter a number from 1 to 1000.");
    await page.getByLabel("Tile edge, mm").fill("24.5");
    await page.keyboard.press("Tab");
    await expect(page.getByRole("alert")).toBeHidden();
    await expect(page.getByRole("button", { name: /board\.png 108 corners, 12 tags/ })).toBeVisible({ timeout: 30_000 });
    await screen(page, "see-recognised");
    await page.getByRole("button", { name: "Remove all" }).click();
    await page.getByRole("button", { name: "Use the sample photograph" }).click();
    await expect(page.getByText("under CC BY 4.0")).toBeVisible({ timeout: 60_000 });
    await expect(page.getByRole("button", { name: /robot-hand\.png 110 corners, 0 tags; target not identified/ })).toBeVisible({ timeout: 60_000 });
    await screen(page, "see-sample");
    await page.getByRole("button", { name: "Remove all" }).click();
    await chooseFiles(page, [join(folder, "solid.png")]);
    await expect(page.getByText(/Identified: the icosahedron, from \d+ tags/)).toBeVisible({ timeout: 60_000 });
    await expect(page.getByRole("button", { name: /solid\.png \d{3} corners/ })).toBeVisible({ timeout: 30_000 });
    await screen(page, "see-solid");
  });

  test("hostile files are rejected with a message, and the page stays usable", async ({ page }) => {
    await page.goto("/#see");
    const png = content("0.png");
    const bomb = Buffer.from(png.subarray(0, 33));
    bomb.writeUInt32BE(60_000, 16);
    bomb.writeUInt32BE(60_000, 20);
    const files = [
      { name: "empty.png", mimeType: "image/png", buffer: Buffer.alloc(0) },
      { name: "cut.png", mimeType: "image/png", buffer: png.subarray(0, 900) },
      { name: "huge.png", mimeType: "image/png", buffer: Buffer.concat([bomb, png.subarray(33)]) },
      { name: "noise.jpg", mimeType: "image/jpeg", buffer: Buffer.from([0xff, 0xd8, 0xff, ...Array.from({ length: 500 }, (_, i) => (i * 37) % 256)]) },
      { name: "text.tif", mimeType: "image/tiff", buffer: Buffer.from("II*\0 this is no picture at all") },
    ];
    await chooseFiles(page, files);
    for (const { name } of files) await expect(page.getByRole("button", { name: new RegExp(name.replace(".", "\\.")) })).toContainText(/damaged, or not an image of a supported type: copy it again, or convert it to JPEG|empty file/, { timeout: 30_000 });
    await screen(page, "see-hostile");
    await chooseFiles(page, [{ name: "broken.json", mimeType: "application/json", buffer: Buffer.from('{"schema": "deltille/target/1"') }]);
    await expect(page.getByRole("button", { name: /cut\.png/ })).toContainText(/\w+ \w+/, { timeout: 30_000 });
    await page.getByLabel("Target in the photographs").selectOption("auto");
    await chooseFiles(page, [join(folder, "0.png")]);
    await expect(page.getByRole("button", { name: /0\.png \d+ corners/ })).toBeVisible({ timeout: 30_000 });
  });
});

test("folders can be dropped, duplicates are skipped, and a photograph can be removed", async ({ page, context }) => {
  await page.goto("/#see");
  const here = scratch();
  mkdirSync(join(here, "more"));
  for (const name of ["0.png", "1.png", "more/2.png"]) writeFileSync(join(here, name), content(name.replace("more/", "")));
  const devtools = await context.newCDPSession(page);
  // Outside the drop area.
  const dropped = async (...files: string[]) => {
    for (const type of ["dragEnter", "dragOver", "drop"] as const) await devtools.send("Input.dispatchDragEvent", { type, x: 900, y: 500, data: { items: [], files, dragOperationsMask: 1 } });
  };
  await expect(page.getByText("No photographs yet.")).toBeVisible();
  await dropped(here);
  const photographs = page.getByRole("button", { name: /\.png 72 corners/ });
  await expect(photographs).toHaveText([/^0\.png/, /^1\.png/, /^2\.png/], { timeout: 60_000 });
  await dropped(here, join(here, "0.png"));
  await expect(photographs).toHaveCount(3);
  await photographs.nth(1).click();
  await page.getByRole("button", { name: "Remove this one" }).click();
  await expect(photographs).toHaveText([/^0\.png/, /^2\.png/]);
  // A file that is not a description is reported and changes nothing.
  for (const [name, text] of [["other.json", '{"kind": "other"}'], ["cut.JSON", '{"schema": "deltille/target/1"']] as const) {
    await chooseFiles(page, [{ name, mimeType: "application/json", buffer: Buffer.from(text) }]);
    await expect(page.getByRole("alert")).toContainText(`${name}: `);
    await expect(photographs).toHaveCount(2);
  }
  await page.getByRole("link", { name: "Calibrate", exact: true }).click();
  await expect(page.getByText("2 images with labelled corners")).toBeVisible();
});

test.describe("calibrate", () => {
  test("a camera is calibrated from photographs", async ({ page }) => {
    await page.goto("/#see");
    const shots = Array.from({ length: 10 }, (_, i) => join(folder, `${i}.png`));
    await chooseFiles(page, [join(folder, "board.json"), ...shots]);
    await page.getByRole("link", { name: "Calibrate", exact: true }).click();
    // Calibration waits for the detection in all of them.
    await page.getByRole("button", { name: "Calibrate", exact: true }).click();
    await expect(page.getByText("Waiting for the detection in the photographs…")).toBeVisible();
    await expect(page.getByText(/Reprojection error: 0\.0\d+ px RMS per axis over 10 views/)).toBeVisible({ timeout: 60_000 });
    await expect(page.getByText("10 images with labelled corners")).toBeVisible();
    const covered = page.getByText(/10 images; \d+ % of the image area covered; tilts from \d+° to \d+°/);
    await expect(covered).toBeVisible({ timeout: 30_000 });
    const [, part, least, most] = (/; (\d+) %.* (\d+)° to (\d+)°/.exec((await covered.textContent()) ?? "") ?? []).map(Number);
    await expect(page.getByRole("img", { name: `${part} % of the image area covered` })).toBeVisible();
    await expect(page.getByRole("img", { name: `tilts from ${least}° to ${most}°` })).toBeVisible();
    await page.getByRole("button", { name: "Calibrate", exact: true }).click();
    await expect(page.getByText(/Reprojection error: 0\.0\d+ px RMS per axis over 10 views/)).toBeVisible({ timeout: 60_000 });
    await screen(page, "calibrate");
    // The program computes the same calibration from the same photographs.
    const [detections, out, target] = [scratch(), scratch(), ["--target", join(folder, "board.json")]];
    deltille("detect", ...shots, ...target, "-o", detections);
    deltille("calibrate", detections, ...target, "--model", "radtan", "--format", "own,opencv,ros,kalibr,colmap,nerfstudio,mrcal", "--report", join(out, "camera-report.html"), "-o", out);
    const read = (file: string) => readFileSync(join(out, file), "utf8");
    // Last digits differ: the order of summation depends on the processor's vector width, which WebAssembly does not share.
    await page.getByText("Formats of other programs").click();
    const ends = ["-opencv.yaml", "-ros.yaml", "-camchain.yaml", "-cameras.txt", "-transforms.json", ".cameramodel"];
    for (const file of ["camera.yaml", "camera.json", ...ends.map((end) => `camera${end}`)]) {
      const [text, others] = [(await press(page, file)).toString(), read(file)].map(split);
      expect(text?.words, file).toEqual(others?.words);
      const worst = apart(text?.numbers, others?.numbers);
      console.log(`${file} differs by ${worst.toExponential(1)} of a number at most`);
      expect(worst, file).toBeLessThan(1e-6);
    }
    // The print scale of the page may be a quotient.
    await page.getByLabel("Print scale").fill("269.3/270, 3");
    await page.keyboard.press("Tab");
    await expect(page.getByRole("alert")).toContainText("Print scale: 269.3/270, 3 is not a ratio from 0.5 to 2");
    await page.getByLabel("Print scale").fill("2");
    await page.keyboard.press("Tab");
    await expect(page.getByRole("status")).toContainText("Print scale: printers change lengths by less than 5 %");
    await page.getByLabel("Print scale").fill("269.325/270, 0.9985");
    await page.getByRole("button", { name: "Calibrate", exact: true }).click();
    await expect(page.getByText(/Reprojection error: 0\.0\d+ px/)).toBeVisible({ timeout: 60_000 });
    const scaled = scratch();
    deltille("calibrate", detections, ...target, "--model", "radtan", "--print-scale", "0.9975,0.9985", "-o", scaled);
    // Diagnoses name settings where those of the program name its options.
    const [own, others] = [(await press(page, "camera.json")).toString(), readFileSync(join(scaled, "camera.json"), "utf8")];
    expect((JSON.parse(own) as { print_scale: number[] }).print_scale).toEqual([269.325 / 270, 0.9985]);
    expect(apart(split(own).numbers, split(others).numbers)).toBeLessThan(1e-6);
    await page.getByLabel("Print scale").fill("");
    await expect(page.getByText("print scale changed after this calibration")).toBeVisible();
    await page.getByRole("button", { name: "Calibrate", exact: true }).click();
    await expect(page.getByText("print scale changed after this calibration")).toBeHidden();
    await expect(page.getByText(/Reprojection error: 0\.0\d+ px/)).toBeVisible({ timeout: 60_000 });
    // Drawings are rounded to a tenth of a pixel. The page names a setting where the program names its option.
    const [drawn, reported] = [(await press(page, "Full report")).toString(), read("camera-report.html").replace(/<span class="option">--(?:print-scale|measured)(.?)<\/span>/, "the print scale$1")].map(split);
    expect(drawn?.words).toEqual(reported?.words);
    expect(Math.max(...(drawn?.numbers ?? []).map((number, i) => Math.abs(number - (reported?.numbers[i] ?? NaN))))).toBeLessThan(0.11);

    // Coverage, counted in the program's files.
    const seen = shots.map((_, i) => corners(JSON.parse(readFileSync(join(detections, `${i}.json`), "utf8")) as Detection));
    const cells = new Set(seen.flat().map(({ x, y }) => `${Math.floor((x + 0.5) / 80)} ${Math.floor((y + 0.5) / 80)}`));
    expect(part).toBe(Math.round((100 * cells.size) / (16 * 12)));
    // Tilt of the board against the line of sight to the centroid of its corners, with a pinhole model.
    const { views } = JSON.parse(read("camera.json")) as { views: { camera_from_target: { rotation: number[] } }[] };
    const tilts = views.map(({ camera_from_target: { rotation } }, i) => {
      const middle = (axis: "x" | "y") => (seen[i] ?? []).reduce((sum, corner) => sum + corner[axis], 0) / (seen[i]?.length ?? NaN);
      const sight = [(middle("x") - 640) / 1100, (middle("y") - 480) / 1100, 1];
      return (180 / Math.PI) * Math.acos(-sight.reduce((sum, at, axis) => sum + at * (rotation[3 * axis + 2] ?? NaN), 0) / Math.hypot(...sight));
    });
    expect(Math.abs(Math.min(...tilts) - (least ?? NaN))).toBeLessThan(1);
    expect(Math.abs(Math.max(...tilts) - (most ?? NaN))).toBeLessThan(1);

    // The result is marked as outdated after a change of the model.
    await page.getByLabel("Camera model").selectOption("rational");
    await expect(page.getByText("The images, the model or the print scale changed after this calibration")).toBeVisible();
    await page.getByRole("button", { name: "Calibrate", exact: true }).click();
    await expect(page.getByText("The images, the model or the print scale changed after this calibration")).toBeHidden();

    for (const scheme of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme: scheme });
      await page.setViewportSize({ width: 390, height: 844 });
      expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
      await screen(page, `calibrate-phone-${scheme}-covered`);
    }
  });

  test("an edge that was not measured is stated, and an invalid one is refused", async ({ page }) => {
    await page.goto("/#see");
    await chooseFiles(page, [0, 1, 2, 3, 4].map((i) => join(folder, `${i}.png`)));
    await expect(page.getByLabel("Tile edge, mm")).toHaveAttribute("placeholder", "20 (default, not measured)", { timeout: 60_000 });
    await page.getByRole("link", { name: "Calibrate", exact: true }).click();
    const calibrate = page.getByRole("button", { name: "Calibrate", exact: true });
    await calibrate.click();
    const assumed = page.getByText("Distances assume an edge of 20 mm, which was not measured");
    await expect(assumed).toBeVisible({ timeout: 60_000 });
    for (const [edge, said] of [["0", "Tile edge, mm: enter a number from 1 to 1000."], ["1000", "larger than 5 m"]] as const) {
      await page.getByRole("link", { name: "Detect", exact: true }).click();
      await page.getByLabel("Tile edge, mm").fill(edge);
      await page.keyboard.press("Tab");
      await expect(page.getByRole("alert")).toContainText(said);
      await page.getByRole("link", { name: "Calibrate", exact: true }).click();
      await calibrate.click();
      await expect(page.getByRole("alert")).toContainText("The tile edge in “Detect” is not valid");
      await expect(page.getByText("Reprojection error")).toBeHidden();
    }
    await page.getByRole("link", { name: "Detect", exact: true }).click();
    await page.getByLabel("Tile edge, mm").fill("24.5");
    await page.keyboard.press("Tab");
    await page.getByRole("link", { name: "Calibrate", exact: true }).click();
    await calibrate.click();
    await expect(page.getByText("Reprojection error")).toBeVisible({ timeout: 60_000 });
    await expect(assumed).toBeHidden();
  });

  test("missing inputs are reported", async ({ page }) => {
    await page.goto("/#calibrate");
    await page.getByRole("button", { name: "Calibrate", exact: true }).click();
    await expect(page.getByRole("alert")).toContainText("no images with labelled corners yet");
    await page.getByRole("button", { name: "Use a webcam" }).click();
    await expect(page.getByRole("alert")).toContainText("No target is selected");
  });

  test("the next image is proposed, and captured once the board is held there", async ({ page, context }) => {
    await context.grantPermissions(["camera"]);
    await page.goto("/#see");
    await chooseFiles(page, [join(folder, "board.json"), join(folder, "0.png")]);
    await expect(page.getByRole("button", { name: /0\.png 72 corners/ })).toBeVisible({ timeout: 30_000 });
    await page.getByRole("link", { name: "Calibrate", exact: true }).click();
    await page.getByRole("button", { name: "Use a webcam" }).click();
    await expect(page.locator(".wish")).toContainText(/25 cm/, { timeout: 30_000 });
    await screen(page, "calibrate-guided-first");
    // It is captured automatically, and another pose is proposed, which the video does not show.
    await expect(page.getByText("1 image captured")).toBeVisible({ timeout: 60_000 });
    await expect(page.locator(".wish")).toContainText(/40°/);
    await screen(page, "calibrate-guided");
    const wish = page.locator(".wish");
    const before = await wish.textContent();
    await page.getByRole("button", { name: "Another pose" }).click();
    await expect(wish).not.toHaveText(before ?? "");
    // Manual captures count, too; once there is a calibration, its uncertainty is shown.
    for (let taken = 2; taken <= 7; taken++) {
      await page.getByRole("button", { name: "Capture now" }).click();
      await expect(page.getByText(new RegExp(`${taken} images captured`))).toBeVisible({ timeout: 30_000 });
      await page.waitForTimeout(400);
    }
    await expect(page.getByText(/Projection uncertainty of distant points: [\d.]+ px, after this image/)).toBeVisible({ timeout: 30_000 });
    // Repeated frames of the video count once.
    await expect(page.getByText(/\d images; \d+ % of the image area covered; tilts? /)).toBeVisible({ timeout: 30_000 });
    await screen(page, "calibrate-guided-sure");
    await page.getByRole("button", { name: "Stop the webcam" }).click();
  });
});

test("a tag is damaged and corrected", async ({ page }) => {
  await page.goto("/#families");
  await expect(page.getByText("Decoded as tag 0.")).toBeVisible({ timeout: 30_000 });
  const cells = page.getByRole("switch");
  // The centre of the bounding box of a triangle lies on its edge, so a click there is ambiguous.
  await cells.nth(3).dispatchEvent("click");
  await expect(page.getByText("Decoded as tag 0, 1 wrong cell corrected.")).toBeVisible();
  await cells.nth(7).press("Space");
  await cells.nth(11).dispatchEvent("click");
  await expect(page.getByText("Decoded as tag 0, 3 wrong cells corrected.")).toBeVisible();
  await screen(page, "families");
  await page.getByRole("button", { name: "Repair" }).click();
  await expect(page.getByText("Decoded as tag 0.")).toBeVisible();
  await page.getByLabel("Tag id").fill("343");
  await expect(page.getByText("Enter a whole number from 0 to 342.")).toBeVisible();
  await page.getByLabel("Tag id").fill("7");
  await expect(page.getByText("Decoded as tag 7.")).toBeVisible();
  await page.getByLabel("Family").selectOption("aprilTag36h11");
  await expect(page.getByText("587 codes")).toBeVisible({ timeout: 30_000 });
  await screen(page, "families-square");
});

test("figures of families agree with independent computations", async ({ page }) => {
  await page.goto("/#families");
  await page.getByLabel("Family").selectOption("d25h7");
  const figures = page.locator(".figures");
  const row = (name: string) => figures.getByRole("row", { name });
  await expect(row("Codes in d25h7")).toContainText("1,208", { timeout: 30_000 });
  // A third of 2^25 words, divided by the size of a ball of radius three. The linear-programming bound is in docs/families.md.
  const ball = 1 + 25 + (25 * 24) / 2 + (25 * 24 * 23) / 6;
  await expect(row("sphere packing")).toContainText(Math.floor(Math.floor(2 ** 25 / ball) / 3).toLocaleString("en"));
  await expect(row("linear programming")).toContainText("3,478");

  // A rotation moves each cell of a cycle to the position of the next.
  await expect(page.getByText("in 8 cycles of 3; the centre cell stays in place")).toBeVisible();
  const cells = page.getByRole("switch");
  const middles = await cells.evaluateAll((all) =>
    all.map((cell) => {
      const corners = (cell.getAttribute("points") ?? "").split(" ").map((corner) => corner.split(",").map(Number));
      return [0, 1].map((axis) => corners.reduce((sum, corner) => sum + (corner[axis] ?? 0), 0) / corners.length);
    }),
  );
  const turned = ([u = 0, v = 0]: number[]) => middles.findIndex(([x = 0, y = 0]) => Math.hypot(x - (1 - u - v), y - u) < 1e-9);
  const cycle = [3, turned(middles[3] ?? []), turned(middles[turned(middles[3] ?? [])] ?? []), 3].map((cell) => `cell ${cell + 1}`);
  await cells.nth(3).focus();
  await expect(page.getByText(`A rotation by 120° moves the content of ${cycle.join(" to ")}.`)).toBeVisible();
  await page.getByRole("button", { name: "Rotate by 120°" }).click();
  await expect(page.getByText("Decoded as tag 0, rotated by 120°.")).toBeVisible();
  await cells.nth(5).press("Space");
  await expect(page.getByText("Decoded as tag 0, rotated by 120°, 1 wrong cell corrected.")).toBeVisible();

  // A tag is read if a code differs from it in few enough cells, regardless of which cells are wrong; the expected
  // fractions are counted cell by cell.
  const rate = 0.1;
  await page.getByRole("slider", { name: "Wrong cells" }).fill(String(200 * rate));
  const family = JSON.parse(readFileSync(join(root, "crates/core/families/d25h7.json"), "utf8")) as { distance_histogram: Record<string, number>; codes: string[] };
  const near = (apart: number): number => {
    let shares = [1];
    for (let cell = 0; cell < 25; cell++) {
      const differs = cell < apart ? 1 - rate : rate;
      shares = [...shares, 0].map((share, count) => share * (1 - differs) + (shares[count - 1] ?? 0) * differs);
    }
    return shares.slice(0, 4).reduce((sum, share) => sum + share, 0);
  };
  const misread = Object.entries(family.distance_histogram).reduce((sum, [apart, pairs]) => sum + ((2 * pairs) / (3 * family.codes.length)) * near(Number(apart)), 0);
  const percent = (share: number) => `${(100 * share).toFixed(1)} %`;
  await expect(figures.getByText("With 10 % of all cells wrong")).toContainText(`${percent(near(0))} of the tags are read, ${percent(1 - near(0) - misread)} are rejected and one in ${Number((1 / misread).toPrecision(2)).toLocaleString("en")} is misread.`);

  // False-positive rates equal those of `deltag info`.
  const stated = JSON.parse(execFileSync(join(dirname(program), "deltag"), ["info", "d25h7", "--json"], { encoding: "utf8" })) as { false_positive_rate: number[]; natural_false_positive_rate: number[]; recommended_correction: number };
  const rates = figures.locator(".rates tbody tr");
  for (const [count, name] of ["none", "1", "up to 2", "up to 3"].entries()) {
    const both = [stated.false_positive_rate[count] ?? NaN, stated.natural_false_positive_rate[count] ?? NaN];
    await expect(rates.nth(count).locator("th, td")).toHaveText([name, ...both.map((rate) => rate.toExponential(1))], { timeout: 30_000 });
  }
  expect(stated.recommended_correction).toBe(0);
  await expect(figures.getByText("To trust single tags, correct no cells")).toBeVisible();
  await cells.nth(9).hover();
  await screen(page, "families-figures");
});

test("a page opened from a file shows what to do", async ({ page }) => {
  // Scripts and the like are refused, which the console reports.
  page.removeAllListeners("console");
  await page.goto(pathToFileURL(join(root, "web/dist/index.html")).href);
  await expect(page.getByText("python3 -m http.server")).toBeVisible();
  await screen(page, "file");
});

test("once loaded, the page works offline", async ({ page, context }) => {
  await page.goto("/");
  await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
  await page.evaluate(async () => void (await navigator.serviceWorker.ready));
  await context.setOffline(true);
  await page.reload();
  await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
  await page.getByRole("link", { name: "Detect" }).click();
  await expect(page.getByRole("button", { name: "Choose photographs" })).toBeVisible();
  await chooseFiles(page, [join(folder, "0.png")]);
  await expect(page.getByRole("button", { name: /0\.png 72 corners/ })).toBeVisible({ timeout: 60_000 });
});

test("the keyboard reaches everything", async ({ page }) => {
  await page.goto("/");
  await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
  await page.keyboard.press("Tab");
  await expect(page.getByRole("link", { name: "Skip to content" })).toBeFocused();
  for (const name of ["Make", "Detect", "Calibrate", "Families"]) {
    await page.keyboard.press("Tab");
    await expect(page.getByRole("link", { name, exact: true })).toBeFocused();
  }
  await page.keyboard.press("Enter");
  await expect(page.getByText("Decoded as tag 0.")).toBeVisible({ timeout: 30_000 });
  // Skips to the content of this part, and continues from there.
  await page.getByRole("link", { name: "Skip to content" }).press("Enter");
  await page.keyboard.press("Tab");
  await expect(page.getByLabel("Family")).toBeFocused();
});

/** A text that each part shows once it is loaded. */
const there = { make: "110 corners", see: "No photographs yet.", calibrate: "0 images with labelled corners", families: "Decoding under noise" };
for (const [part, sign] of Object.entries(there)) {
  test(`${part} fits a phone, light and dark`, async ({ page }) => {
    await page.goto(`/#${part}`);
    await expect(page.getByText(sign)).toBeVisible({ timeout: 30_000 });
    for (const colorScheme of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme });
      await page.setViewportSize({ width: 390, height: 844 });
      await page.evaluate(() => new Promise(requestAnimationFrame));
      expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
      await screen(page, `${part}-phone-${colorScheme}`);
      await page.setViewportSize({ width: 1280, height: 900 });
      await screen(page, `${part}-${colorScheme}`);
    }
  });
}
