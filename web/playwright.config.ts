import { defineConfig } from "@playwright/test";
import { fileURLToPath } from "node:url";

const video = fileURLToPath(new URL("./test-results/webcam.y4m", import.meta.url));

// Debian's Chromium, with a fake webcam that shows a board.
export default defineConfig({
  testDir: "tests",
  timeout: 120_000,
  // The page may respond slowly on a busy machine.
  expect: { timeout: 20_000 },
  workers: 2,
  fullyParallel: true,
  projects: [
    { name: "journeys", testMatch: "journeys.spec.ts" },
    // Alone: it measures the memory of the whole browser.
    { name: "webcam", testMatch: "webcam.spec.ts", dependencies: ["journeys"] },
  ],
  outputDir: "test-results/out",
  globalSetup: "./tests/pictures.ts",
  use: {
    baseURL: "http://127.0.0.1:4173",
    launchOptions: {
      executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
      args: [
        "--no-sandbox",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--js-flags=--expose-gc",
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--use-fake-ui-for-media-stream",
        "--use-fake-device-for-media-stream",
        `--use-file-for-fake-video-capture=${video}`,
      ],
    },
  },
  webServer: { command: "npx vite preview --host 127.0.0.1 --port 4173 --strictPort", url: "http://127.0.0.1:4173", reuseExistingServer: true },
});
