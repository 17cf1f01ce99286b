// Make: settings, a preview of the printed sheet, files, and their verification.
import { dropZone, el, field, latest, save, select, settled } from "./dom";
import { LibraryError, drawing, folding, proving } from "./library";
import { type Settings, asked, isKind, isSolid, nameOf, ofTemplate, query, read, settled as settingsOf, template, PLACES, DEFAULT_FAMILY } from "./settings";
import { made } from "./shared";
import type { Folding } from "./solid";
import { templates } from "./templates";
import { words } from "./words";
import type { FamilyFacts, Pages } from "./worker";

/** Formats that the library writes, and their labels. */
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
/** The description is not verified: the other files are compared with it. */
const PROVED_BY_ALL = "json";
const types: Record<string, string> = { pdf: "application/pdf", svg: "image/svg+xml", png: "image/png", json: "application/json" };
/** Ids are 32-bit numbers. */
const MAX_IDS = 2 ** 32 - 1;
// list: papers (written by tests/it/files/lists.rs)
const papers = ["A0", "A1", "A2", "A3", "A4", "A5", "letter", "legal", "tabloid"];
// end of list

export function make(): HTMLElement {
  let settings: Settings = read(location.hash.split("?")[1] ?? "");
  /** The address as last read or written. */
  let addressed = location.hash;
  let pages: Pages | null = null;
  let at = 0;
  let isTurning = false;
  let folded: Folding | null = null;
  /** The settings of the solid shown. */
  let foldedOf = "";
  let families: FamilyFacts[] = [];
  let familyChoice: HTMLSelectElement;

  const form = el("form", { class: "form", submit: (event) => event.preventDefault() });
  const picture = el("img", { class: "sheet", alt: words.make.preview });
  const solid = el("div", { class: "solid" });
  const slider = el("input", { type: "range", min: 0, max: 100, value: 0, input: () => folded?.unfold(Number(slider.value) / 100) });
  const fold = field(words.make.unfold, slider);
  fold.hidden = true;
  const making = el("p", { class: "busy", hidden: true }, words.make.making);
  const space = el("div", { hidden: true }, solid, fold, making);
  const problem = el("p", { class: "problem", role: "alert", hidden: true });
  const facts = el("p", { class: "facts", "aria-live": "polite" });
  const range = el("p", { class: "facts", "aria-live": "polite" });
  const pager = el("p", { class: "pager" });
  const views = el("p", { class: "pager" });
  const downloads = el("div", { class: "buttons" });
  const prover = el("button", { type: "button", class: "first", click: () => void prove() }, words.make.prove);
  const verdict = el("div", { class: "verdict", "aria-live": "polite" });
  const chooser = el("input", { type: "file", accept: ".toml,.json,.obj,.stl,.glb", hidden: true, change: () => void load([...(chooser.files ?? [])]) });

  const changed = (change: Partial<Settings>, isForm = false): void => {
    settings = { ...settings, ...change };
    if (isForm) fill();
    draw();
  };

  function number(label: string, key: keyof Settings, least: number, most: number, usual?: string): HTMLElement {
    const value = settings[key] as number | null;
    const control = el("input", {
      type: "number",
      min: least,
      max: most,
      step: key.endsWith("_mm") || key === "tag_border" ? "any" : 1,
      value: value ?? "",
      placeholder: usual,
      required: usual === undefined,
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

  function fill(): void {
    const text = words.make;
    const isSquare = settings.kind === "checker";
    const ofSolid = isSolid(settings);
    const names = families.filter(({ kind }) => kind === (isSquare ? "checker" : "deltille")).map(({ name }) => name);
    const options: [string, string][] = names.map((name) => [name, name]);
    if (!isSquare) options.push([PLACES, text.places]);
    options.push(["", text.noTags]);
    const usualFamily = isSquare ? "" : DEFAULT_FAMILY;
    // Keep a family from a link or template visible, even if it is unknown.
    if (settings.family && !options.some(([name]) => name === settings.family)) options.push([settings.family, settings.family]);
    const sizes = settings.paper === null || papers.includes(settings.paper) ? papers : [...papers, settings.paper];
    familyChoice = select(options, settings.family ?? usualFamily, (family) => changed(family === PLACES ? { family, tag_spacing: null, first_id: 0 } : { family }, true));
    const name = el("input", { type: "text", value: settings.name, input: () => changed({ name: name.value }) });
    const isOpen = form.querySelector("details")?.open ?? false;
    const isDense = settings.family === PLACES;
    const hasTags = (settings.family ?? usualFamily) !== "";
    const kinds = Object.entries(text.kinds).filter(([kind]) => kind !== "mesh" || settings.mesh !== null);
    const measures = ofSolid
      ? [number(text.solidEdge, "edge_mm", 1, 100_000, settings.kind === "mesh" ? text.usualEdge : text.usual), number(text.tiles, "tiles", 3, 200, text.usual)]
      : [number(text.rows, "rows", 2, 500), number(text.cols, "cols", 2, 500), number(text.edge, "edge_mm", 1, 1000, text.fitting)];
    const choose = (kind: string) => changed({ kind, family: null, edge_mm: null, name: settings.name === nameOf(settings.kind) ? nameOf(kind) : settings.name }, true);
    form.replaceChildren(
      field(text.kind, select(kinds, settings.kind, choose)),
      ...measures,
      field(text.family, familyChoice),
      field(text.paper, select([["", text.smallest], ...sizes.map((paper) => [paper, paper] as [string, string])], settings.paper ?? "", (paper) => changed({ paper: paper || null }))),
      field(text.name, name),
      el(
        "details",
        { open: isOpen },
        el("summary", {}, text.more),
        field(text.orientation, select(Object.entries(text.orientations), settings.orientation, (orientation) => changed({ orientation }))),
        number(text.margin, "margin_mm", 0, 100, text.usual),
        ...(hasTags
          ? [
              ...(ofSolid || settings.kind === "deltille" ? [] : [field(text.tagsIn, select(Object.entries(text.tagsInColours), settings.tags_in, (tags_in) => changed({ tags_in })))]),
              ...(isDense ? [] : [number(text.spacing, "tag_spacing", 1, 500, text.usual)]),
              number(text.border, "tag_border", 0.6, 10, text.usual),
              ...(isDense ? [] : [number(text.firstId, "first_id", 0, MAX_IDS)]),
            ]
          : []),
        number(text.boardId, "board_id", 0, MAX_IDS),
        box(text.inverted, "inverted"),
        ...(ofSolid
          ? [number(text.faceMargin, "face_margin_mm", 0, 1000, text.usual), box(text.skeleton, "skeleton"), box(text.perFace, "per_face"), box(text.allowSeams, "allow_seams")]
          : [number(text.boards, "boards", 1, 500), box(text.poster, "poster"), box(text.packed, "packed")]),
      ),
    );
    downloads.replaceChildren(
      ...[...formats, ...(ofSolid ? solidFormats : [])].map(([format, text]) => el("button", { type: "button", click: () => void download(format) }, text)),
    );
    views.replaceChildren(
      ...(ofSolid
        ? ([false, true] as const).map((space) => el("button", { type: "button", "aria-pressed": String(isTurning === space), click: () => turn(space) }, space ? text.view.solid : text.view.sheet))
        : []),
    );
    link.hidden = settings.kind === "mesh";
    if (!ofSolid && isTurning) turn(false);
  }

  function turn(isOn: boolean): void {
    isTurning = isOn;
    picture.hidden = isOn;
    pager.hidden = isOn;
    space.hidden = !isOn;
    for (const [index, button] of [...views.children].entries()) button.setAttribute("aria-pressed", String((index === 1) === isOn));
    if (isOn) void showSolid();
  }

  const showSolid = latest(async () => {
    const of = asked(settings);
    if (of === foldedOf) return folded?.fit();
    making.hidden = false;
    try {
      const [{ showMesh }, { glb, hinges }] = await Promise.all([import("./solid"), folding.call("solid", of)]);
      if (of !== asked(settings)) return;
      folded?.end();
      folded = await showMesh(solid, glb, hinges, words.make.solidView);
      foldedOf = of;
      fold.hidden = hinges.length === 0;
      folded.unfold(Number(slider.value) / 100);
    } catch (error) {
      // Drawing the sheet reports wrong settings.
      if (pages && of === asked(settings)) showError(error);
    } finally {
      making.hidden = true;
    }
  });

  function showError(error: unknown): void {
    const text = error instanceof Error ? error.message : String(error);
    problem.textContent = text || words.failed;
    problem.hidden = false;
  }

  /** The message about an invalid number; the library's own message would not name the form field. */
  function mistaken(numbers: Iterable<HTMLInputElement>): string | undefined {
    const wrong = [...numbers].find((control) => !control.validity.valid);
    const details = wrong?.closest("details");
    if (details) details.open = true;
    return wrong && words.make.mistaken(wrong.labels?.[0]?.textContent ?? "", Number(wrong.min), Number(wrong.max), wrong.step !== "any");
  }

  const redraw = latest(async (isStale) => {
    const of = asked(settings);
    address();
    try {
      const mistake = mistaken(form.querySelectorAll<HTMLInputElement>("input[type=number]"));
      if (mistake) throw new LibraryError(mistake);
      show(await drawing.call("draw", of));
      if (isTurning && !isStale()) void showSolid();
    } catch (error) {
      if (isStale()) return;
      show(null);
      showError(error);
    }
  });

  function draw(): void {
    verdict.replaceChildren();
    void redraw();
  }

  /** Shows the sheet that was drawn, or null after an error. */
  function show(drawn: Pages | null): void {
    pages = drawn;
    picture.classList.toggle("past", !drawn);
    for (const button of [prover, ...downloads.querySelectorAll("button")]) button.disabled = !drawn;
    if (!drawn) {
      facts.textContent = range.textContent = "";
      return;
    }
    made.json = drawn.json;
    made.name = settings.name;
    problem.hidden = true;
    turnTo(Math.min(at, drawn.pages.length - 1));
    showFacts(drawn);
    // Do not rebuild the form: the user may be typing in it.
    if (settings.family === null) familyChoice.value = drawn.family ?? "";
  }

  const address = settled(() => {
    // A link that was just followed has not been read yet.
    if (!form.isConnected || location.hash !== addressed) return;
    const of = query(settings);
    history.replaceState(null, "", `#make${of ? `?${of}` : ""}`);
    addressed = location.hash;
  }, 250);

  /** Shows another page of the sheets. */
  function turnTo(page: number): void {
    if (!pages) return;
    at = page;
    const count = pages.pages.length;
    const before = picture.src;
    picture.src = URL.createObjectURL(new Blob([pages.pages[at] ?? ""], { type: "image/svg+xml" }));
    if (before) URL.revokeObjectURL(before);
    const step = (by: number) => () => turnTo((at + by + count) % count);
    pager.replaceChildren(
      ...(count > 1
        ? [
            el("button", { type: "button", "aria-label": words.make.before, click: step(-1) }, "‹"),
            words.make.page(at + 1, count),
            el("button", { type: "button", "aria-label": words.make.after, click: step(1) }, "›"),
          ]
        : []),
    );
  }

  function showFacts({ pages, reach, family }: Pages): void {
    facts.textContent = words.make.facts(reach.corners, reach.tags, pages.length);
    if (reach.tags > 0 && family !== PLACES) facts.textContent += ` ${words.make.idsLeft(reach.ids_left, family ?? "")}`;
    void showRange();
  }

  /** Shows the working range of a camera, as computed by the library. */
  async function showRange(): Promise<void> {
    const mistake = mistaken([view, pixels]);
    if (mistake || !pages) {
      range.textContent = mistake && pages ? mistake : "";
      return;
    }
    const { reach } = pages;
    const found = await drawing.call("distances", asked(settings), Number(view.value), Number(pixels.value)).catch(() => undefined);
    if (found === undefined || reach !== pages?.reach) return;
    const length = (mm: number) => (mm >= 1000 ? `${(mm / 1000).toFixed(1)} m` : `${(mm / 10).toFixed(0)} cm`);
    range.textContent = found ? words.make.range(length(found[0]), length(found[1]), reach.tags > 0) : words.make.never;
  }

  async function download(format: string): Promise<void> {
    try {
      const files = await drawing.call("files", asked(settings), format);
      for (const { name, bytes } of files) save(name, bytes as Uint8Array<ArrayBuffer>, types[format]);
    } catch (error) {
      showError(error);
    }
  }

  /** Verifies all files, each with the line that `deltille verify` prints. */
  async function prove(): Promise<void> {
    const of = asked(settings);
    const lines = el("ul", { class: "lines" });
    const all = [...formats, ...(isSolid(settings) ? solidFormats : [])].filter(([format]) => format !== PROVED_BY_ALL);
    const sum = el("p", { class: "busy" }, words.make.proving(0, all.length));
    verdict.replaceChildren(sum, lines);
    prover.disabled = true;
    let failed = false;
    let count = 0;
    for (const [index, [format, name]] of all.entries()) {
      try {
        const proof = await proving.call("prove", of, format);
        if (of !== asked(settings)) return;
        count += proof.files;
        if (!proof.passed) failed = true;
        const findings = proof.sentences.map((sentence) => el("li", {}, sentence));
        lines.append(el("li", { class: proof.passed ? "passed" : "refused" }, proof.line, findings.length > 0 ? el("ul", {}, ...findings) : ""));
      } catch (error) {
        if (of !== asked(settings)) return;
        // A message of the library says why this file does not exist. If there is no message, the library crashed, and
        // nothing is verified.
        const reason = error instanceof LibraryError ? error.message : "";
        if (!reason) failed = true;
        lines.append(el("li", { class: reason ? "plain" : "refused" }, `${name}: ${reason || words.failed}`));
      }
      sum.textContent = words.make.proving(index + 1, all.length);
    }
    prover.disabled = false;
    const isProved = !failed && count > 0;
    sum.className = isProved ? "good" : "bad";
    sum.textContent = isProved ? words.make.proved(count) : words.make.notProved;
  }

  async function load(files: File[]): Promise<void> {
    chooser.value = "";
    const [file] = files;
    if (!file) return;
    try {
      if (/\.(obj|stl|glb)$/i.test(file.name)) {
        const { inObj } = await import("./meshes");
        const mesh = await inObj(file.name, new Uint8Array(await file.arrayBuffer()));
        changed({ ...settings, kind: "mesh", mesh, edge_mm: null, family: null, name: file.name.replace(/\.[^.]*$/, "") }, true);
        turn(true);
        return;
      }
      const text = await file.text();
      settings = /\.toml$/i.test(file.name) ? ofTemplate(text) : ofValues(text);
      fill();
      draw();
    } catch (error) {
      showError(new LibraryError(`${file.name}: ${error instanceof SyntaxError || !(error instanceof Error) ? words.make.noSettings : error.message}`));
    }
  }

  function ofValues(text: string): Settings {
    const values = JSON.parse(text) as Record<string, unknown>;
    if (typeof values !== "object" || values === null) throw new Error(words.make.noSettings);
    if ("schema" in values) throw new Error(words.make.isDescription);
    if (!isKind(values.kind)) throw new Error(words.make.noSettings);
    const given = Object.entries(values).filter(([, value]) => value !== null);
    return settingsOf(given.map(([key, value]) => [key, String(value)]));
  }

  function store(): void {
    if (isSolid(settings)) save(`${settings.name}.settings.json`, JSON.stringify(settings, null, 2), "application/json");
    else save(`${settings.name}.toml`, template(settings), "application/toml");
  }

  const link = el("button", { type: "button", click: () => void copy() }, words.make.link);
  async function copy(): Promise<void> {
    const of = query(settings);
    const url = new URL(location.href);
    url.hash = `make${of ? `?${of}` : ""}`;
    const isCopied = await navigator.clipboard.writeText(url.href).then(() => true, () => false);
    if (!isCopied) {
      history.replaceState(null, "", url);
      addressed = location.hash;
    }
    link.textContent = isCopied ? words.make.copied : words.make.inAddress;
    setTimeout(() => (link.textContent = words.make.link), 3000);
  }

  const view = el("input", { type: "number", min: 1, max: 170, value: 60, step: "any", required: true, input: () => void showRange() });
  const pixels = el("input", { type: "number", min: 64, max: 20_000, value: 1920, required: true, input: () => void showRange() });
  const offered = select([["", words.make.noTemplate], ...templates.map(({ name }) => [name, name] as [string, string])], "", (name) => {
    const chosen = templates.find((template) => template.name === name);
    if (!chosen) return;
    settings = ofTemplate(chosen.text);
    fill();
    draw();
  });
  // A link to other settings, followed while the page is open.
  window.addEventListener("hashchange", () => {
    addressed = location.hash;
    const [part, of = ""] = addressed.slice(1).split("?");
    if (part !== "make" || of === query(settings)) return;
    // A plain link to this part has no settings: write the current ones into the address.
    if (!location.hash.includes("?")) {
      address();
      return;
    }
    settings = read(of);
    fill();
    draw();
  });
  fill();
  draw();
  drawing.call("families").then((all) => {
    families = all;
    fill();
  }, showError);

  return el(
    "section",
    { class: "make", "aria-label": words.tabs.make },
    el("p", { class: "lead" }, words.make.lead),
    el(
      "div",
      { class: "columns" },
      el(
        "div",
        { class: "settings" },
        field(words.make.templates, offered),
        form,
        el("fieldset", {}, el("legend", {}, words.make.camera), field(words.make.fieldOfView, view), field(words.make.pixels, pixels)),
        dropZone((files) => void load(files), el("p", {}, words.make.drop), el("div", { class: "buttons" }, el("button", { type: "button", click: () => chooser.click() }, words.make.load)), chooser),
      ),
      el(
        "div",
        { class: "stage" },
        problem,
        views,
        picture,
        space,
        pager,
        facts,
        range,
        el("p", { class: "printed" }, words.make.printed),
        el("h2", {}, words.make.download),
        downloads,
        el("div", { class: "buttons" }, prover, el("a", { class: "button", href: "#see", click: () => (made.isWanted = true) }, words.make.seeIt)),
        verdict,
        el("div", { class: "buttons quiet" }, link, el("button", { type: "button", click: store }, words.make.template)),
      ),
    ),
  );
}
