// Times the detector in Node on images of 1280 × 960 px rendered by the program (`npm test` makes them).
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { PNG } from "pngjs";

const web = dirname(fileURLToPath(import.meta.url));
const [folder = join(web, "test-results", "pictures"), module = join(web, "pkg", "see")] = process.argv.slice(2);
const see = await import(pathToFileURL(join(module, "deltille.js")));
see.initSync({ module: readFileSync(join(module, "deltille_bg.wasm")) });
const family = readFileSync(join(web, "..", "crates", "core", "families", "delTag25h7.json"), "utf8");
const finder = see.Finder.of_target(readFileSync(join(folder, "board.json"), "utf8"), family);
for (let i = 0; i < 5; i++) {
  const { width, height, data } = PNG.sync.read(readFileSync(join(folder, `${i}.png`)));
  const picture = see.Picture.of_grey(width, height, false, Uint8Array.from({ length: width * height }, (_, at) => data[4 * at]), 1);
  const times = [];
  let corners = 0;
  for (let again = 0; again < 15; again++) {
    const begin = performance.now();
    const found = finder.find(picture, "");
    times.push(performance.now() - begin);
    corners = JSON.parse(found.json()).grids.reduce((sum, grid) => sum + grid.corners.length, 0);
    found.free();
  }
  times.sort((a, b) => a - b);
  console.log(`${i}.png, ${width} × ${height}, ${corners} corners: ${times[7].toFixed(1)} ms (minimum ${times[0].toFixed(1)})`);
}
