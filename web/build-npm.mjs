// Makes the npm package `deltille`, in npm-package, from the modules in pkg and the page in dist. It has the version of the library.
import { cpSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const web = dirname(fileURLToPath(import.meta.url));
const root = dirname(web);
const folder = join(web, "npm-package");
const modules = ["make", "photo", "prove", "see", "solve"];

rmSync(folder, { recursive: true, force: true });
mkdirSync(join(folder, "families"), { recursive: true });
let readme = readFileSync(join(web, "npm", "README.md"), "utf8");
for (const name of modules) {
  cpSync(join(web, "pkg", name), join(folder, name), { recursive: true });
  writeFileSync(join(folder, name, "browser.js"), `import init from "./deltille.js";\n\nawait init({ module_or_path: new URL("./deltille_bg.wasm", import.meta.url) });\n\nexport * from "./deltille.js";\n`);
  writeFileSync(
    join(folder, name, "node.js"),
    `import { readFileSync } from "node:fs";\nimport { initSync } from "./deltille.js";\n\ninitSync({ module: readFileSync(new URL("./deltille_bg.wasm", import.meta.url)) });\n\nexport * from "./deltille.js";\n`,
  );
  const kilobytes = gzipSync(readFileSync(join(folder, name, "deltille_bg.wasm"))).length / 1e3;
  readme = readme.replace(`${name}.size`, `${kilobytes.toFixed(0)} KB`);
}
const families = join(root, "crates", "core", "families");
for (const name of readdirSync(families).filter((name) => /\.(json|md)$/.test(name))) cpSync(join(families, name), join(folder, "families", name));
cpSync(join(web, "dist"), join(folder, "page"), { recursive: true });
for (const name of ["LICENSE-MIT", "LICENSE-APACHE"]) cpSync(join(root, name), join(folder, name));
writeFileSync(join(folder, "README.md"), readme);
const [, version] = /^version = "([^"]+)"/m.exec(readFileSync(join(root, "Cargo.toml"), "utf8"));
const about = JSON.parse(readFileSync(join(web, "npm", "package.json"), "utf8"));
writeFileSync(join(folder, "package.json"), `${JSON.stringify({ ...about, version }, null, 2)}\n`);
console.log(`npm-package: deltille ${version}`);
