// Make: settings, the sheet as it will be printed, files, and their proof.
import { el, field, save, select, settled } from "./dom";
import { LibraryError, drawing, looking, proving } from "./library";
import { type Settings, asked, isSolid, query, read } from "./settings";
import { made } from "./shared";
import { words } from "./words";
import type { Pages } from "./worker";

const formats: [string, string][] = [
  ["pdf", "PDF"],
  ["svg", "SVG"],
  ["png", "PNG"],
  ["json", "JSON"],
  ["dsc", "DSC"],
];
const solidFormats: [string, string][] = [
  ["gltf", "GLB"],
  ["obj", "OBJ"],
  ["stl", "STL"],
  ["net", "DXF (net)"],
  ["panels", "DXF (panels)"],
];
const types: Record<string, string> = { pdf: "application/pdf", svg: "image/svg+xml", png: "image/png", json: "application/json" };
const papers = ["A5", "A4", "A3", "A2", "A1", "A0", "letter", "legal", "tabloid"];

export function make(): HTMLElement {
  let settings: Settings = read(location.hash.split("?")[1] ?? "");
  let pages: Pages | null = null;
  let at = 0;
  let drawn = 0;

  const form = el("form", { class: "form", submit: (event) => event.preventDefault() });
  const picture = el("img", { class: "sheet", alt: words.make.preview });
  const solid = el("div", { class: "solid", hidden: true });
  const problem = el("p", { class: "problem", role: "alert", hidden: true });
  const facts = el("p", { class: "facts", "aria-live": "polite" });
  const range = el("p", { class: "facts" });
  const pager = el("p", { class: "pager" });
  const views = el("p", { class: "pager" });
  const downloads = el("div", { class: "buttons" });
  const verdict = el("div", { class: "verdict", "aria-live": "polite" });
  const templates = el("input", { type: "file", accept: ".json,application/json", hidden: true, change: () => void load() });
  let fov = 60;
  let wide = 1920;
  let isTurning = false;

  const changed = (change: Partial<Settings>, isForm = false): void => {
    settings = { ...settings, ...change };
    if (isForm) fill();
    later();
  };

  function number(label: string, key: keyof Settings, least: number, most: number, usual?: string): HTMLElement {
    const value = settings[key] as number | null;
    const control = el("input", {
      type: "number",
      min: least,
      max: most,
      step: key.endsWith("_mm") ? "any" : 1,
      value: value ?? "",
      placeholder: usual,
      input: () => changed({ [key]: control.value === "" ? null : Number(control.value) } as Partial<Settings>),
    });
    return field(label, control);
  }

  function box(label: string, key: keyof Settings): HTMLElement {
    const control = el("input", { type: "checkbox", change: () => changed({ [key]: control.checked } as Partial<Settings>) });
    control.checked = settings[key] as boolean;
    const whole = field(label, control);
    whole.classList.add("box");
    return whole;
  }

  let names: string[] = [];

  function fill(): void {
    const text = words.make;
    const isSquare = settings.kind === "checker";
    const fitting = names.filter((name) => name.startsWith("april") === isSquare);
    const families: [string, string][] = fitting.map((name) => [name, name]);
    const isPlain = isSolid(settings) ? [] : [["", text.noTags] as [string, string]];
    const usualFamily = isSquare ? "" : "delTag25h7";
    const name = el("input", { type: "text", value: settings.name, input: () => changed({ name: name.value }) });
    const isOpen = form.querySelector("details")?.open ?? false;
    const sizes = isSolid(settings)
      ? [number(text.solidEdge, "edge_mm", 1, 100_000, "150"), number(text.tiles, "tiles", 3, 200, "10")]
      : [number(text.rows, "rows", 2, 500), number(text.cols, "cols", 2, 500), number(text.edge, "edge_mm", 0.1, 1000, text.usual)];
    form.replaceChildren(
      field(text.kind, select(Object.entries(text.kinds), settings.kind, (kind) => changed({ kind, family: null, edge_mm: null, name: kind === "deltille" ? "board" : kind === "checker" ? "checkerboard" : kind }, true))),
      ...sizes,
      field(text.family, select([...families, ...isPlain], settings.family ?? usualFamily, (family) => changed({ family }))),
      field(text.paper, select([["", text.smallest], ...papers.map((paper) => [paper, paper] as [string, string])], settings.paper ?? "", (paper) => changed({ paper: paper || null }))),
      field(text.name, name),
      el(
        "details",
        { open: isOpen },
        el("summary", {}, text.more),
        number(text.firstId, "first_id", 0, 1_000_000),
        number(text.boardId, "board_id", 0, 1_000_000),
        isSolid(settings) ? box(text.perFace, "per_face") : box(text.inverted, "inverted"),
      ),
    );
    downloads.replaceChildren(
      ...[...formats, ...(isSolid(settings) ? solidFormats : [])].map(([format, text]) =>
        el("button", { type: "button", click: () => void download(format) }, text),
      ),
    );
    views.replaceChildren(
      ...(isSolid(settings)
        ? [
            el("button", { type: "button", click: () => turn(false) }, text.view.sheet),
            el("button", { type: "button", click: () => turn(true) }, text.view.solid),
          ]
        : []),
    );
    if (!isSolid(settings)) turn(false);
  }

  function turn(isOn: boolean): void {
    isTurning = isOn;
    picture.hidden = isOn;
    pager.hidden = isOn;
    solid.hidden = !isOn;
    if (isOn) void showSolid();
  }

  async function showSolid(): Promise<void> {
    const of = asked(settings);
    try {
      const [{ showMesh }, [file]] = await Promise.all([import("./solid"), drawing.call("files", of, "gltf")]);
      if (file && of === asked(settings)) showMesh(solid, file.bytes, words.make.solidView);
    } catch (error) {
      tell(error);
    }
  }

  function tell(error: unknown): void {
    const text = error instanceof Error ? error.message : String(error);
    problem.textContent = text || words.failed;
    problem.hidden = false;
  }

  async function draw(): Promise<void> {
    const turnNumber = ++drawn;
    const of = asked(settings);
    verdict.replaceChildren();
    history.replaceState(null, "", `#make${query(settings) ? `?${query(settings)}` : ""}`);
    try {
      const found = await drawing.call("draw", of);
      if (turnNumber !== drawn) return;
      pages = found;
      made.json = found.json;
      made.name = settings.name;
      problem.hidden = true;
      at = Math.min(at, found.pages.length - 1);
      show();
      if (isTurning) await showSolid();
    } catch (error) {
      if (turnNumber !== drawn) return;
      pages = null;
      facts.textContent = "";
      range.textContent = "";
      tell(error);
    }
  }

  function show(): void {
    if (!pages) return;
    const count = pages.pages.length;
    const before = picture.src;
    picture.src = URL.createObjectURL(new Blob([pages.pages[at] ?? ""], { type: "image/svg+xml" }));
    if (before) setTimeout(() => URL.revokeObjectURL(before), 1000);
    const step = (by: number) => () => {
      at = (at + by + count) % count;
      show();
    };
    pager.replaceChildren(
      ...(count > 1
        ? [
            el("button", { type: "button", "aria-label": words.make.before, click: step(-1) }, "‹"),
            words.make.page(at + 1, count),
            el("button", { type: "button", "aria-label": words.make.after, click: step(1) }, "›"),
          ]
        : []),
    );
    facts.textContent = words.make.facts(pages.corners, pages.tags, count);
    const left = pages.codes - settings.first_id - pages.tags;
    if (pages.tags > 0 && left > 0) facts.textContent += `; ${words.make.idsLeft(left, settings.family ?? "delTag25h7")}`;
    showRange();
  }

  /** How near the target fills the picture, and how far its tags are read, or its tiles found (docs/choosing.md). */
  function showRange(): void {
    if (!pages) return;
    const [edge = 0, cell = 0, size = 0] = pages.sizes;
    const focal = wide / 2 / Math.tan((fov * Math.PI) / 360);
    const far = cell > 0 ? (focal * cell) / 2 : (focal * edge) / 7;
    const near = (focal * size) / wide;
    const told = (mm: number) => (mm >= 1000 ? `${(mm / 1000).toFixed(1)} m` : `${(mm / 10).toFixed(0)} cm`);
    range.textContent = far > near ? words.make.range(told(near), told(far)) : words.make.never;
  }

  async function download(format: string): Promise<void> {
    try {
      const files = await drawing.call("files", asked(settings), format);
      for (const { name, bytes } of files) save(name, bytes as Uint8Array<ArrayBuffer>, types[format]);
    } catch (error) {
      tell(error);
    }
  }

  async function prove(): Promise<void> {
    verdict.replaceChildren(el("p", { class: "busy" }, words.make.proving));
    const of = asked(settings);
    try {
      const proof = await proving.call("prove", of, "pdf");
      if (of !== asked(settings)) return;
      const lines = proof.sentences.map((sentence) => el("li", {}, sentence));
      verdict.replaceChildren(
        el("p", { class: proof.passed ? "good" : "bad" }, proof.passed ? words.make.proved : words.make.notProved),
        el("p", {}, proof.summary),
        lines.length > 0 ? el("ul", {}, ...lines) : "",
      );
    } catch (error) {
      verdict.replaceChildren();
      tell(error);
    }
  }

  async function load(): Promise<void> {
    const file = templates.files?.[0];
    templates.value = "";
    if (!file) return;
    try {
      settings = read(new URLSearchParams(Object.entries(JSON.parse(await file.text()) as Record<string, unknown>).filter(([, value]) => value !== null).map(([key, value]) => [key, String(value)])).toString());
      fill();
      await draw();
    } catch {
      tell(new LibraryError(`${file.name}: these are no settings of a target`));
    }
  }

  const link = el("button", { type: "button", click: () => void copy() }, words.make.link);
  async function copy(): Promise<void> {
    await navigator.clipboard.writeText(location.href).catch(() => undefined);
    link.textContent = words.make.copied;
    setTimeout(() => (link.textContent = words.make.link), 2000);
  }

  const later = settled(() => void draw(), 60);
  const view = el("input", { type: "number", min: 1, max: 170, value: fov, input: () => ((fov = Number(view.value) || fov), showRange()) });
  const pixels = el("input", { type: "number", min: 64, max: 20_000, value: wide, input: () => ((wide = Number(pixels.value) || wide), showRange()) });
  fill();
  void draw();
  looking.call("families").then((all) => {
    names = all;
    fill();
  }, tell);

  return el(
    "section",
    { class: "make", "aria-label": words.tabs.make },
    el("p", { class: "lead" }, words.make.lead),
    el(
      "div",
      { class: "columns" },
      el("div", {}, form, el("fieldset", {}, el("legend", {}, words.make.camera), field(words.make.fieldOfView, view), field(words.make.pixels, pixels), range)),
      el(
        "div",
        { class: "stage" },
        problem,
        views,
        picture,
        solid,
        pager,
        facts,
        el("h2", {}, words.make.download),
        downloads,
        el("div", { class: "buttons" }, el("button", { type: "button", class: "first", click: () => void prove() }, words.make.prove), el("a", { class: "button", href: "#see" }, words.make.seeIt)),
        verdict,
        el(
          "div",
          { class: "buttons quiet" },
          link,
          el("button", { type: "button", click: () => save(`${settings.name}.settings.json`, JSON.stringify(settings, null, 2), "application/json") }, words.make.template),
          el("button", { type: "button", click: () => templates.click() }, words.make.load),
          templates,
        ),
      ),
    ),
  );
}
