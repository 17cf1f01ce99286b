// Builds the library as three modules, which the page loads when it needs them: `see` finds corners, `solve` calibrates,
// `make` draws targets and proves their files. Needs the Rust target wasm32-unknown-unknown and wasm-bindgen of the version in
// Cargo.lock.
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, renameSync, rmSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const web = dirname(fileURLToPath(import.meta.url));
const root = dirname(web);
const target = process.env.CARGO_TARGET_DIR ?? join(root, "target");
const built = join(target, "wasm32-unknown-unknown", "web", "deltille_web.wasm");

const parts = process.argv.length > 2 ? process.argv.slice(2) : ["see", "solve", "make"];
for (const part of parts) {
  execFileSync(
    "cargo",
    ["build", "--profile", "web", "--target", "wasm32-unknown-unknown", "-p", "deltille-web", "--no-default-features", "--features", part],
    { cwd: root, stdio: "inherit", env: { ...process.env, RUSTFLAGS: `${process.env.RUSTFLAGS ?? ""} -C target-feature=+simd128`.trim() } },
  );
  const folder = join(web, "pkg", part);
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  const made = join(folder, "deltille.wasm");
  // The name of the module is that of the file.
  renameSync(built, made);
  execFileSync("wasm-bindgen", ["--target", "web", "--out-dir", folder, "--out-name", "deltille", made], { stdio: "inherit" });
  rmSync(made);
  const bytes = readFileSync(join(folder, "deltille_bg.wasm"));
  console.log(`${part}: ${(bytes.length / 1e6).toFixed(2)} MB, ${(gzipSync(bytes).length / 1e3).toFixed(0)} KB gzipped`);
}
