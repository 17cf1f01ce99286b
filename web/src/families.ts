// Families: codes of tags, damaged and decoded.
import { el, field, select } from "./dom";
import { drawing as looking } from "./library";
import { words } from "./words";

type Figures = { name: string; bits: number; codes: number; distance: number; correctable: number; kind: string; histogram: Record<string, number> };
type Family = { figures: Figures; cells: [number, number][][]; codes: bigint[] };

const SVG = "http://www.w3.org/2000/svg";

function shape(tag: string, attributes: Record<string, string>, ...children: Node[]): SVGElement {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

export function families(): HTMLElement {
  let family: Family | null = null;
  let id = 0;
  let word = 0n;
  const chooser = el("div", {});
  const number = el("input", { type: "number", min: 0, value: 0, input: () => pick(Number(number.value)) });
  const facts = el("p", { class: "facts" });
  const verdict = el("p", { class: "facts", "aria-live": "polite" });
  const tag = el("div", { class: "tag" });
  const histogram = el("div", { class: "histogram" });

  async function choose(name: string): Promise<void> {
    const found = await looking.call("family", name);
    family = { figures: JSON.parse(found.figures) as Figures, cells: JSON.parse(found.cells) as [number, number][][], codes: found.codes };
    number.max = String(family.codes.length - 1);
    facts.textContent = words.families.facts(family.figures.codes, family.figures.distance, family.figures.correctable);
    pick(Math.min(id, family.codes.length - 1));
    bars(family.figures.histogram);
  }

  function pick(wanted: number): void {
    if (!family || !Number.isInteger(wanted) || wanted < 0 || wanted >= family.codes.length) return;
    id = wanted;
    number.value = String(id);
    word = family.codes[id] ?? 0n;
    draw();
  }

  function draw(): void {
    if (!family) return;
    const isSquare = family.figures.kind === "checker";
    const code = family.codes[id] ?? 0n;
    const height = Math.sqrt(3) / 2;
    const outline = isSquare ? "0,0 1,0 1,1 0,1" : "0,0 1,0 0,1";
    const cells = family.cells.map((corners, bit) => {
      const isOn = ((word >> BigInt(bit)) & 1n) === 1n;
      const isWrong = ((word ^ code) >> BigInt(bit)) & 1n;
      const flip = () => {
        word ^= 1n << BigInt(bit);
        draw();
        tag.querySelectorAll<SVGElement>("[role=switch]")[bit]?.focus();
      };
      const cell = shape("polygon", {
        points: corners.map(([x, y]) => `${x},${y}`).join(" "),
        class: `cell${isOn ? " on" : ""}${isWrong ? " wrong" : ""}`,
        role: "switch",
        tabindex: "0",
        "aria-checked": String(isOn),
        "aria-label": words.families.cell(bit, isOn),
      });
      cell.addEventListener("click", flip);
      cell.addEventListener("keydown", (event) => {
        if (event.key !== " " && event.key !== "Enter") return;
        event.preventDefault();
        flip();
      });
      return cell;
    });
    const top = isSquare ? 1 : height;
    // The frame of tags has y up; of triangles its axes are 60° apart.
    const axes = isSquare ? "matrix(1 0 0 -1 0 1)" : `matrix(1 0 0.5 ${-height} 0 ${height})`;
    const all = shape("g", { transform: axes }, shape("polygon", { points: outline, class: "border" }), ...cells);
    tag.replaceChildren(shape("svg", { viewBox: `-0.02 -0.02 1.04 ${top + 0.04}` }, all));
    void decode();
  }

  async function decode(): Promise<void> {
    if (!family) return;
    const of = word;
    const found = await looking.call("decode", family.figures.name, word, family.figures.correctable);
    if (of !== word) return;
    const [read = 0, , errors = 0] = found ?? [];
    verdict.textContent = !found ? words.families.refused : read === id ? words.families.read(id, errors) : words.families.mistaken(id, read);
    verdict.className = `facts ${!found ? "plain" : read === id ? "good" : "bad"}`;
  }

  function bars(counts: Record<string, number>): void {
    const all = Object.entries(counts).map(([distance, count]) => [Number(distance), count] as const);
    const most = Math.max(...all.map(([, count]) => count), 1);
    histogram.replaceChildren(
      el("h2", {}, words.families.histogram),
      el(
        "table",
        {},
        el("tbody", {}, ...all.map(([distance, count]) => {
          const meter = shape("svg", { viewBox: "0 0 100 6", preserveAspectRatio: "none", class: "bar", "aria-hidden": "true" }, shape("rect", { width: String((100 * count) / most), height: "6" }));
          return el("tr", {}, el("th", { scope: "row" }, String(distance)), el("td", {}, meter), el("td", {}, count.toLocaleString("en")));
        })),
      ),
    );
  }

  looking.call("families").then((all) => {
    const names = all.map(({ name }) => name);
    const first = names.includes("delTag25h7") ? "delTag25h7" : (names[0] ?? "");
    chooser.replaceChildren(field(words.families.family, select(names.map((name) => [name, name]), first, (name) => void choose(name))));
    return choose(first);
  }, (error: unknown) => (facts.textContent = error instanceof Error && error.message ? error.message : words.failed));

  return el(
    "section",
    { class: "families", "aria-label": words.tabs.families },
    el("p", { class: "lead" }, words.families.lead),
    el(
      "div",
      { class: "columns" },
      el("div", {}, chooser, field(words.families.id, number), facts, el("div", { class: "buttons" }, el("button", { type: "button", click: () => pick(id) }, words.families.repair)), histogram),
      el("div", { class: "stage" }, tag, verdict),
    ),
  );
}
