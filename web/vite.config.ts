import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { type Plugin, defineConfig } from "vite";

/** Files cached at installation, so that the page works offline once loaded: all except images. */
const KEPT = /\.(html|js|css|svg|wasm|json|txt|woff2)$/;

/** Writes the service worker with the names of all files, and a version that changes with any of them. */
function offline(): Plugin {
  let folder = "dist";
  return {
    name: "offline",
    apply: "build",
    configResolved: (config) => void (folder = config.build.outDir),
    closeBundle() {
      const files = readdirSync(folder, { recursive: true, withFileTypes: true })
        .filter((entry) => entry.isFile())
        .map((entry) => join(entry.parentPath, entry.name).slice(folder.length + 1))
        .filter((name) => name !== "sw.js" && KEPT.test(name))
        .sort();
      const sum = createHash("sha256");
      for (const name of files) sum.update(name).update(readFileSync(join(folder, name)));
      const filled = readFileSync("src/offline.js", "utf8")
        .replace('"VERSION"', JSON.stringify(sum.digest("hex").slice(0, 16)))
        .replace('["FILES"]', JSON.stringify(files));
      writeFileSync(join(folder, "sw.js"), filled);
    },
  };
}

/** Draws the default board, which the page shows until the library has started. */
const firstSheet: Plugin = {
  name: "first-sheet",
  apply: "build",
  async generateBundle() {
    const { Made, family_of_settings, initSync } = await import("./pkg/make/deltille.js");
    initSync({ module: readFileSync("pkg/make/deltille_bg.wasm") });
    const family = readFileSync(`../crates/core/families/${family_of_settings("{}")}.json`, "utf8");
    const [, svg] = new Made("{}", family).files("svg");
    this.emitFile({ type: "asset", fileName: "board.svg", source: svg as Uint8Array });
  },
};

/** Loads styles without CORS, so that they apply to the page opened from a file, which then shows how to serve it. */
const styles: Plugin = { name: "styles", transformIndexHtml: { order: "post", handler: (html) => html.replace('rel="stylesheet" crossorigin', 'rel="stylesheet"') } };

// Relative addresses, so that the folder can be served from any path.
export default defineConfig({
  base: "./",
  build: { target: "es2022", outDir: "dist", assetsInlineLimit: 0, chunkSizeWarningLimit: 800 },
  worker: { format: "es" },
  server: { fs: { allow: [".."] } },
  plugins: [firstSheet, offline(), styles],
});
