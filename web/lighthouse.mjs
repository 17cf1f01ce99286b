// Measures the built page (dist) with Lighthouse in Debian's Chromium (/usr/bin/chromium, or CHROMIUM), as a phone and as a
// desktop. Fails if a category scores below 95. Files are compressed, as web servers do.
import { createServer } from "node:http";
import { readFileSync } from "node:fs";
import { extname, join } from "node:path";
import { gzipSync } from "node:zlib";
import { launch } from "chrome-launcher";
import lighthouse, { desktopConfig } from "lighthouse";

const LEAST = 95;
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
try {
  for (const part of ["make", "see", "calibrate", "families"]) {
    for (const [name, config] of [["phone", undefined], ["desktop", desktopConfig]]) {
      const { lhr } = await lighthouse(`http://127.0.0.1:4174/#${part}`, { port: browser.port, onlyCategories: asked, logLevel: "error" }, config);
      const scores = asked.map((category) => [category, Math.round(100 * lhr.categories[category].score)]);
      console.log(`${part}, ${name}: ${scores.map(([category, score]) => `${category} ${score}`).join(", ")}`);
      for (const { title, score, scoreDisplayMode, details } of Object.values(lhr.audits)) {
        if (score !== null && score < 1 && scoreDisplayMode !== "informative") console.log(`  ${title}: ${(details?.items ?? []).map((item) => item.node?.snippet ?? item.description ?? "").join(" ").slice(0, 300)}`);
      }
      isGood &&= scores.every(([, score]) => score >= LEAST);
    }
  }
} finally {
  await browser.kill();
  server.close();
}
process.exitCode = isGood ? 0 : 1;
