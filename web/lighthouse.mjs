// Measures the built page (dist) with Lighthouse in Debian's Chromium (/usr/bin/chromium, or CHROMIUM), as a phone and as a
// desktop. Fails if accessibility or best practices score below 95.
import { preview } from "vite";
import { launch } from "chrome-launcher";
import lighthouse, { desktopConfig } from "lighthouse";

const LEAST = 95;
const asked = ["accessibility", "best-practices"];

const server = await preview({ preview: { host: "127.0.0.1", port: 4174, strictPort: true } });
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
  await server.close();
}
process.exitCode = isGood ? 0 : 1;
