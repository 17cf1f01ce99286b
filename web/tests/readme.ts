import { type Page, test } from "@playwright/test";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { deltille, folder } from "./pictures";

// Screenshots of the page for README.md, not a test; `npm run pictures` takes them.
test.use({ viewport: { width: 1100, height: 800 }, deviceScaleFactor: 0.8, colorScheme: "light" });

const images = fileURLToPath(new URL("../../docs/images", import.meta.url));
const picture = (page: Page, name: string) => page.screenshot({ path: join(images, `page-${name}.png`), fullPage: true });
const show = (page: Page, files: string[]) => page.locator("input[type=file]").setInputFiles([join(folder, "board.json"), ...files]);

test("make", async ({ page }) => {
  await page.goto("/#make?kind=icosahedron&name=icosahedron");
  await page.getByRole("button", { name: "Solid", exact: true }).click();
  await page.locator(".solid canvas").waitFor();
  await page.getByLabel("Unfold the net").fill("45");
  await picture(page, "make");
});

test("see", async ({ page }) => {
  // Without noise, which would make the PNG large.
  const desk = join(folder, "desk.png");
  deltille("render", join(folder, "board.json"), "--camera", fileURLToPath(new URL("../../templates/camera.yaml", import.meta.url)), "--eye", "330,-90,290", "--noise", "0", "-o", desk, "--force");
  await page.goto("/#see");
  await show(page, [desk]);
  await page.getByRole("button", { name: /desk\.png 72 corners/ }).waitFor();
  await page.locator("canvas.photo").focus();
  for (let step = 0; step < 3; step++) await page.keyboard.press("ArrowRight");
  await picture(page, "see");
});

test("calibrate", async ({ page }) => {
  await page.goto("/#see");
  await show(page, Array.from({ length: 10 }, (_, i) => join(folder, `${i}.png`)));
  await page.getByRole("button", { name: /9\.png 72 corners/ }).waitFor();
  await page.getByRole("link", { name: "Calibrate", exact: true }).click();
  await page.getByRole("button", { name: "Calibrate", exact: true }).click();
  await page.getByText("Reprojection error").waitFor();
  await picture(page, "calibrate");
});
