// Builds the library as five modules, which the page loads on demand: `make` draws targets, `prove` makes PNG pages and meshes and
// verifies files, `photo` decodes photographs, `see` detects corners, `solve` calibrates. Needs the Rust target
// wasm32-unknown-unknown.
//
//     node build-wasm.mjs [MODULE…]
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const web = dirname(fileURLToPath(import.meta.url));
const root = dirname(web);
const target = process.env.CARGO_TARGET_DIR ?? join(root, "target");
const built = join(target, "wasm32-unknown-unknown", "web", "examples");
const all = ["make", "prove", "photo", "see", "solve"];

const parts = process.argv.slice(2);
const unknown = parts.find((part) => !all.includes(part));
if (unknown !== undefined) {
  console.error(`unknown module ${unknown} (known: ${all.join(", ")})`);
  process.exit(1);
}

const cargo = (more, ...given) => execFileSync("cargo", given, { cwd: root, stdio: "inherit", env: { ...process.env, ...more } });
cargo({}, "build", "--quiet", "-p", "deltille-bindgen");
const simd = { RUSTFLAGS: `${process.env.RUSTFLAGS ?? ""} -C target-feature=+simd128`.trim() };
const wanted = parts.length > 0 ? parts : all;
const examples = wanted.flatMap((part) => ["--example", part]);
cargo(simd, "build", "--profile", "web", "--target", "wasm32-unknown-unknown", "-p", "deltille-web", ...examples);
for (const part of wanted) {
  const folder = join(web, "pkg", part);
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  const named = [join(built, `${part}.wasm`), folder, "deltille"];
  execFileSync(join(target, "debug", "deltille-bindgen"), named, { stdio: "inherit" });
  const made = join(folder, "deltille_bg.wasm");
  console.log(`${part}: ${(statSync(made).size / 1e6).toFixed(2)} MB, ${(gzipSync(readFileSync(made)).length / 1e3).toFixed(0)} KB gzipped`);
}
