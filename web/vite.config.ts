import { defineConfig } from "vite";

// Relative addresses: the folder is served from anywhere.
export default defineConfig({
  base: "./",
  build: { target: "es2022", outDir: "dist", assetsInlineLimit: 0 },
  worker: { format: "es" },
});
