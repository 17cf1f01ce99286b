// Figures for the mathematics of families: upper bounds on their size, and decoding under noise.
import { el, field, shape } from "./dom";
import { words } from "./words";
import type { FalsePositives, FamilyFigures } from "./worker";

/** Rates of wrong cells shown, as fractions. */
export const RATES = Array.from({ length: 81 }, (_, i) => i / 200);
/** The rate shown first. */
const FIRST = 0.05;

const [WIDE, HIGH] = [200, 90];

/** A bar that fills a fraction of its available width. */
export const bar = (part: number) =>
  shape("svg", { viewBox: "0 0 100 6", preserveAspectRatio: "none", class: "bar", "aria-hidden": "true" }, shape("rect", { width: 100 * part, height: 6 }));

/** Number of codes of a family, and upper bounds on it; bars are logarithmic. */
export function sizes({ name, codes, distance, correctable, linear_programming, sphere_packing }: FamilyFigures): HTMLElement {
  const text = words.families.sizes;
  const all: [string, number][] = [
    [text.codes(name), codes],
    [text.linear, linear_programming],
    [text.spheres, sphere_packing],
  ];
  const most = Math.log(Math.max(...all.map(([, count]) => count)));
  const rows = all.map(([label, count]) => el("tr", {}, el("th", { scope: "row" }, label), el("td", {}, bar(Math.log(count) / most)), el("td", {}, count.toLocaleString("en"))));
  return el("div", {}, el("h2", {}, text.heading), el("table", {}, el("tbody", {}, ...rows)), el("p", { class: "credit" }, text.why(distance, correctable)));
}

/** False-positive rate for each number of corrected cells. */
export function falsePositives({ coins, natural, accepted, recommended }: FalsePositives, kind: string): HTMLElement {
  const text = words.families.falsePositives;
  const rate = (value: number | undefined) => el("td", {}, value === undefined ? "" : value.toExponential(1));
  const head = el("tr", {}, ...[text.corrected, text.coins, ...(natural ? [text.natural] : [])].map((label) => el("th", { scope: "col" }, label)));
  const rows = coins.map((coin, count) => el("tr", {}, el("th", { scope: "row" }, text.cells(count)), rate(coin), ...(natural ? [rate(natural[count])] : [])));
  const advice = natural ? text.recommended(recommended, accepted) : text.unknown;
  return el("div", {}, el("h2", {}, text.heading), el("table", { class: "rates" }, el("thead", {}, head), el("tbody", {}, ...rows)), el("p", { class: "credit" }, `${text.why(kind)} ${advice}`));
}

/** Decoding results at a rate of wrong cells, chosen by a slider; `shares` are the fractions read and misread at each rate. */
export function reading(shares: [number, number][], correctable: number): HTMLElement {
  const text = words.families.reading;
  const x = (i: number) => (WIDE * i) / (RATES.length - 1);
  const area = (name: string, from: (share: [number, number]) => number, to: (share: [number, number]) => number) => {
    const there = shares.map((share, i) => `${x(i)},${HIGH * (1 - from(share))}`);
    const back = shares.map((share, i) => `${x(i)},${HIGH * (1 - to(share))}`).reverse();
    return shape("polygon", { points: [...there, ...back].join(" "), class: name });
  };
  const marker = shape("line", { y1: 0, y2: HIGH, class: "marker" });
  const chart = shape(
    "svg",
    { viewBox: `-1 -1 ${WIDE + 2} ${HIGH + 12}`, role: "img", "aria-label": text.chart, class: "shares" },
    area("read", () => 0, ([read]) => read),
    area("refused", ([read]) => read, ([, misread]) => 1 - misread),
    area("misread", ([, misread]) => 1 - misread, () => 1),
    marker,
    ...[0, 10, 20, 30, 40].map((percent) => shape("text", { x: x(2 * percent), y: HIGH + 9, "text-anchor": percent === 0 ? "start" : percent === 40 ? "end" : "middle" }, `${percent} %`)),
  );
  const summary = el("p", { class: "facts", "aria-live": "polite" });
  const slider = el("input", { type: "range", min: 0, max: RATES.length - 1, value: RATES.indexOf(FIRST), input: () => update() });
  function update(): void {
    const at = Number(slider.value);
    const [read, misread] = shares[at] ?? [0, 0];
    marker.setAttribute("x1", String(x(at)));
    marker.setAttribute("x2", String(x(at)));
    const rate = text.rate(100 * (RATES[at] ?? 0));
    slider.setAttribute("aria-valuetext", rate);
    summary.textContent = text.summary(rate, read, 1 - read - misread, misread);
  }
  update();
  const key = el("p", { class: "key" }, ...(["read", "refused", "misread"] as const).map((name) => el("span", { class: name }, text.key[name])));
  return el("div", {}, el("h2", {}, text.heading), chart, key, field(text.slider, slider), summary, el("p", { class: "credit" }, text.why(correctable)));
}
