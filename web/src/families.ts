// Families: codes of tags, damaged and decoded interactively.
import { el, field, select, shape } from "./dom";
import { RATES, bar, falsePositives, reading, sizes } from "./family-figures";
import { drawing as looking } from "./library";
import { DEFAULT_FAMILY } from "./settings";
import { words } from "./words";
import type { FamilyFigures } from "./worker";

type Family = { figures: FamilyFigures; cells: [number, number][][]; codes: bigint[] };

/** The cycle of cells that a rotation permutes, starting from one: the content of each moves to the next. */
function cycleOf(bit: number, rotation: number[]): number[] {
  const cycle = [bit];
  for (let at = rotation.indexOf(bit); at !== bit; at = rotation.indexOf(at)) cycle.push(at);
  return cycle;
}

export function families(): HTMLElement {
  let family: Family | null = null;
  /** The family requested last. */
  let asked = "";
  let id = 0;
  let word = 0n;
  /** The code of the tag, and its number of rotation steps. */
  let code = 0n;
  let turns = 0;
  const chooser = el("div", {});
  const number = el("input", { type: "number", min: 0, value: 0, required: true, input: () => pick(number.valueAsNumber) });
  const facts = el("p", { class: "facts" });
  const verdict = el("p", { class: "facts", "aria-live": "polite" });
  const tag = el("div", { class: "tag" });
  const cycles = el("p", { class: "facts", "aria-live": "polite" });
  const turn = el("button", { type: "button", click: () => void turned() }, words.families.turn(120));
  const histogram = el("div", { class: "histogram" });
  const figures = el("div", { class: "figures" });

  async function choose(name: string): Promise<void> {
    asked = name;
    const found = await looking.call("family", name);
    if (name !== asked) return;
    family = { figures: found.figures, cells: JSON.parse(found.cells) as [number, number][][], codes: found.codes };
    number.max = String(family.codes.length - 1);
    facts.textContent = words.families.facts(family.figures.codes, family.figures.distance, family.figures.correctable);
    turn.textContent = words.families.turn(angle());
    pick(Math.min(id, family.codes.length - 1));
    bars(family.figures.histogram);
    const shares = await looking.call("reading", name, RATES);
    if (name !== asked) return;
    figures.replaceChildren(sizes(family.figures), reading(shares, family.figures.correctable));
    ready();
    // Takes a second or two for large families.
    const rates = await looking.call("falsePositives", name);
    if (name === asked) figures.append(falsePositives(rates, family.figures.kind));
  }

  /** Shows this part once it is complete, so that nothing visible moves. */
  function ready(): void {
    loading.hidden = true;
    columns.hidden = false;
  }

  function failed(error: unknown): void {
    facts.textContent = error instanceof Error && error.message ? error.message : words.failed;
    ready();
  }

  /** One rotation step, degrees. */
  const angle = () => 360 / (family?.figures.turns ?? 3);

  function pick(wanted: number): void {
    if (!family) return;
    if (!Number.isInteger(wanted) || wanted < 0 || wanted >= family.codes.length) {
      verdict.textContent = words.families.noId(family.codes.length - 1);
      verdict.className = "facts bad";
      return;
    }
    id = wanted;
    number.value = String(id);
    word = code = family.codes[id] ?? 0n;
    turns = 0;
    draw();
  }

  async function turned(): Promise<void> {
    if (!family) return;
    const { name, turns: all } = family.figures;
    const of = word;
    const [next, nextCode] = await Promise.all([looking.call("turned", name, word), looking.call("turned", name, code)]);
    if (of !== word) return;
    [word, code, turns] = [next, nextCode, (turns + 1) % all];
    draw();
  }

  function draw(): void {
    if (!family) return;
    const isSquare = family.figures.kind === "checker";
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
      for (const event of ["pointerenter", "focus"]) cell.addEventListener(event, () => show(bit));
      for (const event of ["pointerleave", "blur"]) cell.addEventListener(event, () => show(null));
      return cell;
    });
    const ring = shape("polygon", { class: "cycle" });
    /** Shows where a rotation moves the content of a cell; without a cell, the number of cycles. */
    const show = (bit: number | null) => {
      if (!family) return;
      const { rotation, turns: all } = family.figures;
      const cycle = bit === null ? [] : cycleOf(bit, rotation);
      const middle = (corners: [number, number][]) => [0, 1].map((axis) => corners.reduce((sum, corner) => sum + (corner[axis] ?? 0), 0) / corners.length);
      ring.setAttribute("points", cycle.map((bit) => middle(family?.cells[bit] ?? []).join(",")).join(" "));
      const stay = rotation.filter((from, to) => from === to).length;
      cycles.textContent = bit === null ? words.families.cycles(angle(), (rotation.length - stay) / all, all, stay) : words.families.cycle(angle(), cycle.map((bit) => bit + 1));
    };
    const top = isSquare ? 1 : height;
    // The tag frame has y up; for triangles its axes are 60° apart.
    const axes = isSquare ? "matrix(1 0 0 -1 0 1)" : `matrix(1 0 0.5 ${-height} 0 ${height})`;
    const all = shape("g", { transform: axes }, shape("polygon", { points: outline, class: "border" }), ...cells, ring);
    tag.replaceChildren(shape("svg", { viewBox: `-0.02 -0.02 1.04 ${top + 0.04}` }, all));
    show(null);
    void decode();
  }

  async function decode(): Promise<void> {
    if (!family) return;
    const of = word;
    const found = await looking.call("decode", family.figures.name, word, family.figures.correctable);
    if (of !== word) return;
    const [read = 0, turn = 0, errors = 0] = found ?? [];
    const isRight = read === id && turn === turns;
    verdict.textContent = !found ? words.families.refused : isRight ? words.families.read(id, turn * angle(), errors) : words.families.mistaken(id, turns * angle(), read, turn * angle());
    verdict.className = `facts ${!found ? "plain" : isRight ? "good" : "bad"}`;
  }

  function bars(counts: Record<string, number>): void {
    const all = Object.entries(counts).map(([distance, count]) => [Number(distance), count] as const);
    const most = Math.max(...all.map(([, count]) => count), 1);
    histogram.replaceChildren(
      el("h2", {}, words.families.histogram),
      el(
        "table",
        {},
        el("tbody", {}, ...all.map(([distance, count]) => el("tr", {}, el("th", { scope: "row" }, String(distance)), el("td", {}, bar(count / most)), el("td", {}, count.toLocaleString("en"))))),
      ),
    );
  }

  looking.call("families").then((all) => {
    const names = all.map(({ name }) => name);
    const first = names.includes(DEFAULT_FAMILY) ? DEFAULT_FAMILY : (names[0] ?? "");
    chooser.replaceChildren(field(words.families.family, select(names.map((name) => [name, name]), first, (name) => void choose(name).catch(failed))));
    return choose(first);
  }).catch(failed);

  const loading = el("p", { class: "busy" }, words.loading);
  const columns = el(
    "div",
    { class: "columns", hidden: true },
    el("div", {}, chooser, field(words.families.id, number), facts, el("div", { class: "buttons" }, el("button", { type: "button", click: () => pick(id) }, words.families.repair), turn), histogram),
    el("div", { class: "stage" }, tag, verdict, cycles, figures),
  );

  return el(
    "section",
    { class: "families", "aria-label": words.tabs.families },
    el("h2", { class: "title" }, words.families.title),
    el("p", { class: "lead" }, words.families.lead),
    loading,
    columns,
  );
}
