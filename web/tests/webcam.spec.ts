import { type Page, expect, test } from "@playwright/test";
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { chooseFiles, screen, strict } from "./page";
import { folder } from "./pictures";

test.beforeEach(strict);

test("webcam images are captured automatically, and memory stays constant", async ({ page, context }) => {
  test.setTimeout(300_000);
  await context.grantPermissions(["camera"]);
  await page.goto("/#see");
  await chooseFiles(page, [join(folder, "board.json"), join(folder, "0.png")]);
  await expect(page.getByRole("button", { name: /0\.png 72 corners/ })).toBeVisible({ timeout: 30_000 });
  await page.getByRole("link", { name: "Calibrate", exact: true }).click();
  await page.getByLabel("Capture images").selectOption("free");
  await page.getByRole("button", { name: "Use a webcam" }).click();
  await expect(page.getByText(/[3-9] images captured/)).toBeVisible({ timeout: 60_000 });
  await expect(page.getByText(/[3-9] images; \d+ % of the image area covered/)).toBeVisible();
  await screen(page, "calibrate-webcam");
  const canvas = page.locator("canvas.photo");
  const frames = async () => Number(await canvas.getAttribute("data-frames"));
  await expect.poll(frames, { timeout: 120_000 }).toBeGreaterThan(100);
  const [before, begin, first] = [await memory(page), Date.now(), await frames()];
  await expect.poll(frames, { timeout: 120_000 }).toBeGreaterThan(first + 300);
  const [end, last, after] = [Date.now(), await frames(), await memory(page)];
  console.log(`webcam of 640 × 480: ${((1000 * (last - first)) / (end - begin)).toFixed(1)} frames per second; memory of the browser ${before.toFixed(0)} MB, ${last - first} frames later ${after.toFixed(0)} MB`);
  // A frame has 1.2 MB of pixels and 0.03 MB of detections.
  expect(after - before).toBeLessThan(20);
  await page.getByRole("button", { name: "Stop the webcam" }).click();
  // The photograph counts again once the webcam's images are discarded.
  await page.getByRole("button", { name: "Discard the webcam's images" }).click();
  await expect(page.getByText(/1 image; \d+ % of the image area covered; tilt /)).toBeVisible({ timeout: 30_000 });
});

/** Memory of the browser's renderer processes, MB: the smallest of several samples, each after garbage collection. */
async function memory(page: Page): Promise<number> {
  const all: number[] = [];
  for (let moment = 0; moment < 5; moment++) {
    for (const one of [page, ...page.workers()]) await one.evaluate(() => (globalThis as unknown as { gc: () => void }).gc());
    const lines = execFileSync("ps", ["-eo", "rss=,args="], { encoding: "utf8" }).split("\n");
    const own = lines.filter((line) => /--type=renderer/.test(line) && /chrom/.test(line));
    all.push(own.reduce((sum, line) => sum + Number(line.trim().split(/\s+/)[0]), 0) / 1000);
  }
  return Math.min(...all);
}
