// Measures the built page (dist) with Lighthouse in Debian's Chromium (/usr/bin/chromium, or CHROMIUM), as a phone and as a
// desktop. Fails if a category scores below 95, or if something moves while the page loads. Files are compressed, as web servers do.
// Other programs on the machine only make the page slower: if the performance is below 95, it is measured up to three times, and the
// best counts. The other results do not depend on time, and must hold in every measurement.
import { createServer } from "node:http";
import { readFileSync } from "node:fs";
import { extname, join } from "node:path";
import { gzipSync } from "node:zlib";
import { launch } from "chrome-launcher";
import lighthouse, { desktopConfig } from "lighthouse";

const LEAST = 95;
const TRIES = 3;
const asked = ["performance", "accessibility", "best-practices", "seo"];
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".svg": "image/svg+xml", ".json": "application/json", ".txt": "text/plain", ".woff2": "font/woff2" };

const server = createServer(({ url }, answer) => {
  const path = url.split("?")[0].replace(/\/$/, "/index.html");
  try {
    const content = gzipSync(readFileSync(join("dist", path)));
    answer.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream", "content-encoding": "gzip", "cache-control": "max-age=31536000" }).end(content);
  } catch {
    answer.writeHead(404).end();
  }
}).listen(4174, "127.0.0.1");
const browser = await launch({ chromePath: process.env.CHROMIUM ?? "/usr/bin/chromium", chromeFlags: ["--headless", "--no-sandbox", "--disable-quic", "--disable-background-networking"] });
let isGood = true;

/** Measures a part of the page once, and prints the result; `isGood` concerns the results that do not depend on time. */
async function measure(part, name, config) {
  const { lhr } = await lighthouse(`http://127.0.0.1:4174/#${part}`, { port: browser.port, onlyCategories: asked, logLevel: "error" }, config);
  const [performance, ...others] = asked.map((category) => Math.round(100 * lhr.categories[category].score));
  const shift = lhr.audits["cumulative-layout-shift"].numericValue;
  console.log(`${part}, ${name}: ${[performance, ...others].map((score, i) => `${asked[i]} ${score}`).join(", ")}, layout shift ${shift.toFixed(4)}`);
  const costly = asked.flatMap((category) => lhr.categories[category].auditRefs).filter(({ id, weight }) => weight > 0 && lhr.audits[id].score !== null && lhr.audits[id].score < 1);
  if (costly.length > 0) console.log(`  ${costly.map(({ id }) => `${lhr.audits[id].title} ${lhr.audits[id].displayValue ?? ""}`.trim()).join(", ")}`);
  return { performance, isGood: shift === 0 && others.every((score) => score >= LEAST) };
}

try {
  for (const part of ["make", "see", "calibrate", "families"]) {
    for (const [name, config] of [["phone", undefined], ["desktop", desktopConfig]]) {
      let best = 0;
      for (let tries = 0; best < LEAST && tries < TRIES; tries++) {
        const { performance, isGood: isStill } = await measure(part, name, config);
        best = Math.max(best, performance);
        isGood &&= isStill;
      }
      isGood &&= best >= LEAST;
    }
  }
} finally {
  await browser.kill();
  server.close();
}
process.exitCode = isGood ? 0 : 1;
