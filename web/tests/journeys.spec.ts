import { type Page, expect, test } from "@playwright/test";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { content, deltille, folder } from "./pictures";

async function downloaded(page: Page, click: () => Promise<void>): Promise<Buffer> {
  const [download] = await Promise.all([page.waitForEvent("download"), click()]);
  return readFileSync(await download.path());
}

test.beforeEach(({ page }) => {
  page.on("console", (message) => {
    if (message.type() === "error") throw new Error(message.text());
  });
});

test("a board is designed, proved, and downloaded as the program writes it", async ({ page }) => {
  await page.goto("/");
  await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
  await page.getByLabel("Rows of corners").fill("1");
  await expect(page.getByRole("alert")).toContainText("rows: 1 is not between 2 and 500");
  await page.getByLabel("Rows of corners").fill("8");
  await page.getByLabel("Corners in a row").fill("9");
  await expect(page.getByText("72 corners")).toBeVisible();
  await expect(page.getByRole("alert")).toBeHidden();
  expect(page.url()).toContain("rows=8&cols=9");

  const made = mkdtempSync(join(tmpdir(), "page-"));
  deltille("board", "--rows", "8", "--cols", "9", "--pdf", "--svg", "--dsc", "-o", made);
  for (const [button, file] of [["PDF", "board.pdf"], ["SVG", "board.svg"], ["JSON", "board.json"], ["DSC", "board.dsc"]] as const) {
    const found = await downloaded(page, () => page.getByRole("button", { name: button, exact: true }).click());
    expect(found.equals(readFileSync(join(made, file))), file).toBe(true);
  }
  await page.getByRole("button", { name: "Prove it" }).click();
  await expect(page.getByText("Proved: the file shows this target")).toBeVisible({ timeout: 60_000 });
  // The address carries the settings.
  await page.reload();
  await expect(page.getByText("72 corners")).toBeVisible({ timeout: 30_000 });
});

test("an icosahedron is turned in space, and its mesh is the program's", async ({ page }) => {
  await page.goto("/");
  await page.getByLabel("Target", { exact: true }).selectOption("icosahedron");
  await expect(page.getByText("720 corners")).toBeVisible({ timeout: 30_000 });
  await page.getByRole("button", { name: "Solid", exact: true }).click();
  await expect(page.locator(".solid canvas")).toBeVisible({ timeout: 30_000 });
  const made = mkdtempSync(join(tmpdir(), "page-"));
  deltille("icosahedron", "--gltf", "-o", made);
  const found = await downloaded(page, () => page.getByRole("button", { name: "GLB", exact: true }).click());
  expect(found.equals(readFileSync(join(made, "icosahedron.glb")))).toBe(true);
});

test("a sheet is drawn anew at every change", async ({ page }) => {
  await page.goto("/");
  await expect(page.getByText("110 corners")).toBeVisible({ timeout: 30_000 });
  const times: number[] = [];
  for (let rows = 11; rows < 20; rows++) {
    const begin = Date.now();
    await page.getByLabel("Rows of corners").fill(String(rows));
    await expect(page.getByText(`${11 * rows} corners`)).toBeVisible();
    times.push(Date.now() - begin);
  }
  console.log(`redraw: ${times.join(", ")} ms`);
});

test("corners of dropped photographs are those of the program", async ({ page }) => {
  await page.goto("/#see");
  await page.locator("input[type=file]").setInputFiles([join(folder, "board.json"), ...[0, 1].map((i) => join(folder, `${i}.png`))]);
  await expect(page.getByRole("button", { name: /0\.png 72 corners/ })).toBeVisible({ timeout: 30_000 });
  const found = JSON.parse((await downloaded(page, () => page.getByRole("button", { name: "JSON" }).click())).toString()) as Detection;
  const out = mkdtempSync(join(tmpdir(), "page-"));
  deltille("detect", join(folder, "0.png"), "--target", join(folder, "board.json"), "--ink", "auto", "-o", out);
  const expected = JSON.parse(readFileSync(join(out, "0.json"), "utf8")) as Detection;
  type Detection = { grids: { corners: { id: number; x: number; y: number }[] }[] };
  const corners = (of: Detection) => of.grids.flatMap((grid) => grid.corners);
  expect(corners(found).length).toBe(72);
  const worst = Math.max(...corners(found).map((corner, i) => Math.hypot(corner.x - (corners(expected)[i]?.x ?? NaN), corner.y - (corners(expected)[i]?.y ?? NaN))));
  console.log(`corners differ by ${worst} px at most`);
  expect(worst).toBeLessThan(1e-9);
});

test("hostile files are refused in a sentence, and the page goes on", async ({ page }) => {
  await page.goto("/#see");
  const files = [
    { name: "empty.png", mimeType: "image/png", buffer: Buffer.alloc(0) },
    { name: "cut.png", mimeType: "image/png", buffer: content("0.png").subarray(0, 900) },
    { name: "noise.jpg", mimeType: "image/jpeg", buffer: Buffer.from([0xff, 0xd8, 0xff, ...Array.from({ length: 500 }, (_, i) => (i * 37) % 256)]) },
  ];
  await page.locator("input[type=file]").setInputFiles(files);
  for (const { name } of files) await expect(page.getByRole("button", { name: new RegExp(name.replace(".", "\\.")) })).toContainText(/not|damaged|cannot|empty/i, { timeout: 30_000 });
  await page.locator("input[type=file]").setInputFiles([join(folder, "0.png")]);
  await expect(page.getByRole("button", { name: /0\.png \d+ corners/ })).toBeVisible({ timeout: 30_000 });
});

test("a camera is calibrated from photographs", async ({ page }) => {
  await page.goto("/#see");
  const shots = Array.from({ length: 10 }, (_, i) => join(folder, `${i}.png`));
  await page.locator("input[type=file]").setInputFiles([join(folder, "board.json"), ...shots]);
  await expect(page.getByRole("button", { name: /9\.png \d+ corners/ })).toBeVisible({ timeout: 60_000 });
  await page.getByRole("link", { name: "Calibrate" }).click();
  await expect(page.getByText("10 photographs with labelled corners")).toBeVisible();
  await page.getByRole("button", { name: "Calibrate", exact: true }).click();
  await expect(page.getByText(/Residuals of 0\.0\d+ px over 10 views/)).toBeVisible({ timeout: 60_000 });
  const yaml = (await downloaded(page, () => page.getByRole("button", { name: "camera.yaml" }).click())).toString();
  expect(yaml).toContain("focal_px");
  const report = (await downloaded(page, () => page.getByRole("button", { name: "The whole report" }).click())).toString();
  expect(report).toContain("<html");
});

test("a webcam is watched, and pictures are taken by themselves", async ({ page, context }) => {
  await context.grantPermissions(["camera"]);
  await page.goto("/#see");
  await page.locator("input[type=file]").setInputFiles([join(folder, "board.json"), join(folder, "0.png")]);
  await expect(page.getByRole("button", { name: /0\.png 72 corners/ })).toBeVisible({ timeout: 30_000 });
  await page.getByRole("link", { name: "Calibrate" }).click();
  await page.getByRole("button", { name: "Use a webcam" }).click();
  await expect(page.getByText(/[3-9] pictures taken/)).toBeVisible({ timeout: 60_000 });
  console.log(await page.getByText("pictures taken").textContent());
});

test("a tag is damaged and corrected", async ({ page }) => {
  await page.goto("/#families");
  await expect(page.getByText("Read as tag 0.")).toBeVisible({ timeout: 30_000 });
  const cells = page.getByRole("switch");
  // The middle of the box around a triangle lies on its edge.
  await cells.nth(3).dispatchEvent("click");
  await expect(page.getByText("Read as tag 0, 1 wrong cells corrected.")).toBeVisible();
  await cells.nth(7).press("Space");
  await cells.nth(11).dispatchEvent("click");
  await expect(page.getByText("Read as tag 0, 3 wrong cells corrected.")).toBeVisible();
  await page.getByRole("button", { name: "Repair" }).click();
  await expect(page.getByText("Read as tag 0.")).toBeVisible();
});

for (const part of ["make", "see", "calibrate", "families"]) {
  test(`${part} fits a phone`, async ({ page }) => {
    await page.setViewportSize({ width: 390, height: 844 });
    await page.goto(`/#${part}`);
    await page.waitForTimeout(1500);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(wide).toBeLessThanOrEqual(390);
    await page.screenshot({ path: `test-results/${part}-phone.png`, fullPage: true });
    await page.setViewportSize({ width: 1280, height: 900 });
    await page.screenshot({ path: `test-results/${part}.png`, fullPage: true });
  });
}
