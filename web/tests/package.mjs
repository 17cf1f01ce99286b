// Tests the npm package as users get it: packs it, installs it in an empty folder and runs the examples of its README. The corners
// are compared with those of the program (target/release/deltille, or DELTILLE_PROGRAM).
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const web = dirname(dirname(fileURLToPath(import.meta.url)));
const program = process.env.DELTILLE_PROGRAM ?? join(web, "../target/release/deltille");
const folder = mkdtempSync(join(tmpdir(), "package-"));
const run = (command, ...given) => execFileSync(command, given, { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "inherit"] });

const [{ filename }] = JSON.parse(run("npm", "pack", "--json", join(web, "npm-package")));
writeFileSync(join(folder, "package.json"), '{ "type": "module", "private": true }');
run("npm", "install", "--no-audit", "--no-fund", "--silent", join(folder, filename));

const [corners, target] = [...readFileSync(join(web, "npm/README.md"), "utf8").matchAll(/```js\n(.*?)```/gs)].map(([, code]) => code);
copyFileSync(join(web, "samples/board.png"), join(folder, "board.png"));
writeFileSync(join(folder, "corners.mjs"), corners);
const found = run("node", "corners.mjs").trim().split("\n");
run(program, "detect", "board.png", "--grid", "deltille", "-o", "out");
const expected = JSON.parse(readFileSync(join(folder, "out/board.json"), "utf8")).grids[0].corners;
assert.equal(found.length, expected.length);
expected.forEach(({ row, col, x, y }, i) => assert.equal(found[i].split(" ").slice(0, 4).join(" "), `${row} ${col} ${x} ${y}`));

writeFileSync(join(folder, "target.mjs"), `import { writeFileSync } from "node:fs";\n${target}\nwriteFileSync(name, pdf);\nconsole.log(name);\n`);
const name = run("node", "target.mjs").trim();
run(program, "board", "--rows", "10", "--cols", "11", "--paper", "A4", "--name", "board", "-o", "made");
assert.ok(readFileSync(join(folder, name)).equals(readFileSync(join(folder, "made/board.pdf"))));

// The type declarations compile.
writeFileSync(join(folder, "typed.ts"), 'import { Finder } from "deltille/see";\nexport const finder: Finder = Finder.of_grid("checker", 0, 0);\n');
run("node", join(web, "node_modules/typescript/bin/tsc"), "--noEmit", "--strict", "--module", "nodenext", "--target", "es2022", "--lib", "es2022,dom,esnext.disposable", "typed.ts");
rmSync(folder, { recursive: true });
console.log(`the examples of the README work: ${found.length} corners equal those of the program, and so does ${name}`);
