// Make: settings, a preview of the printed sheet, files, and their verification.
import { dropZone, el, field, latest, mistaken, save, select, settled } from "./dom";
import { LibraryError, drawing, folding, proving } from "./library";
import { type Format, proof } from "./proof";
import { type Settings, PLACES, applies, asked, hasFiles, isBoard, isKind, isSolid, ofTemplate, query, read, settled as settingsOf, template } from "./settings";
import { made } from "./shared";
import type { Folding } from "./solid";
import { type Known, targetForm } from "./target-form";
import { templates } from "./templates";
import { words } from "./words";
import type { Pages } from "./worker";

/** Formats that the library writes besides PDF, their labels, and the kinds of targets that have them. */
const FORMATS: [string, string, (settings: Settings) => boolean][] = [
  ["svg", "SVG", () => true],
  ["png", "PNG", () => true],
  ["json", "JSON", () => true],
  ["laser-dxf", "DXF (laser)", () => true],
  ["laser-svg", "SVG (laser)", () => true],
  ["gltf", "GLB", ({ kind }) => kind !== "circles"],
  ["obj", "OBJ", ({ kind }) => kind !== "circles"],
  ["3mf", "3MF", ({ kind }) => kind !== "circles"],
  ["stl", "STL", isSolid],
  ["skeleton", "STL (skeleton)", (settings) => isSolid(settings) && settings.skeleton],
  ["net", "DXF (net)", isSolid],
  ["panels", "DXF (panels)", isSolid],
  ["kalibr", "YAML (Kalibr)", ({ kind }) => kind === "aprilgrid"],
  ["dsc", "DSC", (settings) => isBoard(settings) || isSolid(settings)],
];
const PDF: Format = ["pdf", "PDF"];
/** These are not verified: the other files are compared with the description, and Kalibr's file follows from it. */
const NOT_PROVED = ["json", "kalibr", "skeleton"];
const types: Record<string, string> = { pdf: "application/pdf", svg: "image/svg+xml", png: "image/png", json: "application/json" };
/** Width and height of the smallest paper that is selected automatically. */
const A4_MM = [210, 297];
/** Time without a change before slow figures are computed, ms. */
const IDLE_MS = 500;
/** Time after which an earlier preview is marked as past, ms. */
const LATE_MS = 300;
/** Files with settings or parts of a target. */
const ACCEPTED = ".toml,.json,.obj,.stl,.glb,.svg";

export function make(): HTMLElement {
  const first = read(location.hash.split("?")[1] ?? "");
  let settings = first.settings;
  /** The address as last read or written. */
  let addressed = location.hash;
  let pages: Pages | null = null;
  let at = 0;
  let isFirstDrawing = true;
  /** Whether the build has drawn these settings. */
  const isBuilt = () => isFirstDrawing && query(settings) === "";
  let isTurning = false;
  let folded: Folding | null = null;
  /** The settings of the solid shown. */
  let foldedOf = "";
  let known: Known = { families: [], dictionaries: [] };

  const text = words.make;
  // The build draws the default board.
  const picture = el("img", { class: "sheet", alt: text.preview, src: import.meta.env.PROD && isBuilt() ? "./board.svg" : undefined, hidden: true, load: () => (picture.hidden = isTurning) });
  const solid = el("div", { class: "solid" });
  const slider = el("input", { type: "range", min: 0, max: 100, value: 0, input: () => (folded?.unfold(Number(slider.value) / 100), shown()) });
  const play = el("button", { type: "button", click: () => folded?.play(Number(slider.value) < 50 ? 1 : 0, moved) }, text.play.unfold);
  const fold = el("div", { class: "fold", hidden: true }, field(text.unfold, slider), play);
  const making = el("p", { class: "busy", hidden: true }, text.making);
  const space = el("div", { hidden: true }, making, solid, fold);
  const problem = el("p", { class: "problem", role: "alert", hidden: true });
  const notice = el("p", { class: "problem", role: "alert", hidden: true });
  const printing = el("p", { class: "hint" }, text.printing);
  const sheets = el("p", { class: "sheets", "aria-live": "polite" });
  const facts = el("p", { class: "facts", "aria-live": "polite" });
  const range = el("p", { class: "facts range", "aria-live": "polite" });
  const pager = el("p", { class: "pager" });
  const views = el("p", { class: "pager views" });
  const pdf = el("button", { type: "button", class: "first download", click: () => void download("pdf") }, text.pdf);
  const others = el("dl", { class: "formats" });
  const more = el("details", { class: "more", toggle: () => more.open && restart() }, el("summary", {}, text.formats), others);
  const verification = proof(() => [PDF, ...(more.open ? formats().filter(([format]) => !NOT_PROVED.includes(format)) : [])]);
  more.append(el("p", { class: "hint" }, text.laser), verification.lines);
  const chooser = el("input", { type: "file", accept: ACCEPTED, hidden: true, change: () => void load([...(chooser.files ?? [])], chooser.accept) });
  const choose = (accept: string) => {
    chooser.accept = accept;
    chooser.click();
  };
  const { kinds, form, fill: fillForm, showFamily } = targetForm({ changed, chooseMesh: () => choose(".obj,.stl,.glb"), chooseLogo: () => choose(".svg") });

  function formats(): Format[] {
    return FORMATS.flatMap(([format, label, has]): Format[] => (has(settings) ? [[format, label]] : []));
  }

  function changed(change: Partial<Settings>, isForm = false): void {
    settings = { ...settings, ...change };
    notice.hidden = true;
    if (isForm) fill();
    draw();
  }

  /** Shows other settings, and names those that are ignored. */
  function take(given: Settings, ignored: string[] = []): void {
    settings = given;
    notice.textContent = text.ignored(ignored);
    notice.hidden = ignored.length === 0;
    fill();
    draw();
  }

  function fill(): void {
    fillForm(settings, known);
    others.replaceChildren(...formats().flatMap(([format, label]) => [el("dt", {}, el("button", { type: "button", disabled: pages === null, click: () => void download(format) }, label)), el("dd", {}, text.about[format])]));
    const ofSolid = isSolid(settings);
    views.replaceChildren(
      ...(ofSolid ? [false, true].map((isOn) => el("button", { type: "button", "aria-pressed": String(isOn === isTurning), click: () => turn(isOn) }, isOn ? text.view.solid : text.view.sheet)) : []),
    );
    link.hidden = hasFiles(settings);
    seeIt.hidden = settings.kind === "circles";
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
    solid.classList.add("past");
    try {
      const [{ showMesh }, { glb, hinges }] = await Promise.all([import("./solid"), folding.call("solid", of)]);
      if (of !== asked(settings)) return;
      folded?.end();
      folded = await showMesh(solid, glb, hinges, text.solidView);
      solid.classList.remove("past");
      // The first time, the net folds into the solid.
      const isFirst = foldedOf === "" && hinges.length > 0;
      foldedOf = of;
      fold.hidden = hinges.length === 0;
      folded.unfold(isFirst ? 1 : Number(slider.value) / 100);
      if (isFirst) folded.play(0, moved);
    } catch (error) {
      // Drawing the sheet reports wrong settings.
      if (pages && of === asked(settings)) showError(error);
    } finally {
      making.hidden = true;
    }
  });

  /** Follows the motion of the net. */
  function moved(part: number): void {
    slider.value = String(Math.round(100 * part));
    shown();
  }

  function shown(): void {
    play.textContent = Number(slider.value) < 50 ? text.play.unfold : text.play.fold;
  }

  function showError(error: unknown): void {
    const message = error instanceof Error ? error.message : String(error);
    problem.textContent = labelled(message) || words.failed;
    problem.hidden = false;
  }

  /** A message of the library with the labels of fields instead of the keys of settings. */
  function labelled(message: string): string {
    return message.replace(/`(\w+)`/g, (key, name: string) => {
      const label = form.querySelector<HTMLInputElement>(`[name="${name}"]`)?.labels?.[0]?.textContent;
      return label ? `“${label.replace(/, mm$/, "")}”` : key;
    });
  }

  const redraw = latest(async (isStale) => {
    const of = asked(settings);
    address();
    const late = setTimeout(() => {
      // The board drawn by the build is not past.
      if (isBuilt()) return;
      show(null);
      problem.hidden = true;
      sheets.replaceChildren(el("span", { class: "busy" }, text.drawing));
    }, LATE_MS);
    try {
      const mistake = mistaken(form.querySelectorAll<HTMLInputElement>("input"));
      if (mistake) {
        form.querySelector("details:has(:invalid)")?.toggleAttribute("open", true);
        throw new LibraryError(mistake);
      }
      show(await drawing.call("draw", of));
      if (isTurning && !isStale()) void showSolid();
      if (!isStale()) restart();
    } catch (error) {
      if (isStale()) return;
      show(null);
      showError(error);
      verification.restart(null, problem.textContent ?? "");
    } finally {
      clearTimeout(late);
    }
  });

  function draw(): void {
    verification.restart(null);
    void redraw();
  }

  /** Verifies what is drawn. */
  function restart(): void {
    verification.restart(pages ? asked(settings) : null);
  }

  /** Shows the sheet that was drawn, or null after an error. */
  function show(drawn: Pages | null): void {
    pages = drawn;
    for (const part of [picture, solid]) part.classList.toggle("past", !drawn);
    for (const button of [pdf, ...others.querySelectorAll("button")]) button.disabled = !drawn;
    if (!drawn) {
      for (const part of [sheets, facts, range]) part.textContent = "";
      return;
    }
    made.json = drawn.json;
    made.name = settings.name;
    made.family = applies("family_file", settings) ? settings.family_file : null;
    problem.hidden = true;
    turnTo(Math.min(at, drawn.pages.length - 1), isBuilt());
    isFirstDrawing = false;
    showFacts(drawn);
    // Do not rebuild the form: the user may be typing in it.
    if (settings.family === null && drawn.family) showFamily(drawn.family);
  }

  const address = settled(() => {
    // A link that was just followed has not been read yet.
    if (!form.isConnected || location.hash !== addressed) return;
    const of = query(settings);
    history.replaceState(null, "", `#make${of ? `?${of}` : ""}`);
    addressed = location.hash;
  }, 250);

  /** Shows another page of the sheets. */
  function turnTo(page: number, isFirst = false): void {
    if (!pages) return;
    at = page;
    const count = pages.pages.length;
    const before = picture.src;
    // The board drawn by the build is the same.
    if (isFirst && before && at === 0) return;
    picture.src = URL.createObjectURL(new Blob([pages.pages[at] ?? ""], { type: "image/svg+xml" }));
    if (before) URL.revokeObjectURL(before);
    const step = (by: number) => () => turnTo((at + by + count) % count);
    pager.replaceChildren(
      ...(count > 1
        ? [
            el("button", { type: "button", "aria-label": text.before, click: step(-1) }, "‹"),
            text.page(at + 1, count),
            el("button", { type: "button", "aria-label": text.after, click: step(1) }, "›"),
          ]
        : []),
    );
  }

  function showFacts(drawn: Pages): void {
    const { reach, family } = drawn;
    facts.textContent = settings.kind === "circles" ? text.circles(reach.corners) : text.facts(reach.corners, reach.tags);
    if (reach.tags > 0 && family && family !== PLACES) facts.textContent += ` ${text.idsLeft(reach.ids_left, family)}`;
    showSheets(drawn);
    void showRange();
  }

  /** States the paper and the edge, and for larger paper the number of A4 pages. */
  function showSheets(drawn: Pages): void {
    printing.textContent = isSolid(settings) && !settings.per_face ? text.printingNet : text.printing;
    if (!drawn.sheets) return void (sheets.textContent = "");
    const { paper, size_mm, pages: count, edge_mm } = drawn.sheets;
    const noun = ({ charuco: "square", aprilgrid: "tag", circles: "spacing" } as const)[settings.kind] ?? "tile";
    const said = text.sheets(paper, size_mm, count, edge_mm === null ? "" : text.edgeOf[noun](edge_mm));
    sheets.textContent = `${said}.`;
    const isLarger = [...size_mm].sort((a, b) => a - b).some((side, i) => side > (A4_MM[i] ?? 0));
    const use = () => changed({ paper: "A4", orientation: "auto", ...(edge_mm === null ? {} : { edge_mm }), ...(isBoard(settings) ? { poster: true } : {}) }, true);
    if (isLarger) showA4(drawn, said, el("button", { type: "button", class: "quiet", click: use }, text.useA4));
  }

  /** Laying out the net of an icosahedron on small paper takes a second. */
  const showA4 = settled(async (drawn: Pages, said: string, use: HTMLElement) => {
    if (drawn !== pages) return;
    const count = await proving.call("pagesOnA4", asked(settings)).catch(() => null);
    if (drawn === pages && count !== null) sheets.replaceChildren(`${said}${text.fitsOnA4(count)}. `, use);
  }, IDLE_MS);

  /** Shows the working range of a camera, as computed by the library. */
  async function showRange(): Promise<void> {
    const mistake = mistaken([view, pixels]);
    if (mistake || !pages || settings.kind === "circles") {
      range.textContent = mistake && pages ? mistake : "";
      return;
    }
    const { reach } = pages;
    const found = await drawing.call("distances", asked(settings), Number(view.value), Number(pixels.value)).catch(() => undefined);
    if (found === undefined || reach !== pages?.reach) return;
    const length = (mm: number) => (mm >= 1000 ? `${(mm / 1000).toFixed(1)} m` : `${(mm / 10).toFixed(0)} cm`);
    range.textContent = found ? text.range(length(found[0]), length(found[1]), reach.tags > 0) : text.never;
  }

  async function download(format: string): Promise<void> {
    try {
      // The others may take long, or need a large module.
      const files = await (format === "pdf" ? drawing : folding).call("files", asked(settings), format);
      for (const { name, bytes } of files) save(name, bytes as Uint8Array<ArrayBuffer>, types[format]);
    } catch (error) {
      showError(error);
    }
  }

  async function load(files: File[], accepted = ACCEPTED): Promise<void> {
    chooser.value = "";
    const [file] = files;
    if (!file) return;
    try {
      const endings = accepted.split(",");
      if (!endings.some((ending) => file.name.toLowerCase().endsWith(ending))) throw new Error(text.notAccepted(endings));
      if (/\.(obj|stl|glb)$/i.test(file.name)) {
        const { inObj } = await import("./meshes");
        const mesh = await inObj(file.name, new Uint8Array(await file.arrayBuffer()));
        changed({ ...settings, kind: "mesh", mesh, edge_mm: null, family: null, name: file.name.replace(/\.[^.]*$/, "") }, true);
        turn(true);
        return;
      }
      const content = await file.text();
      if (/\.svg$/i.test(file.name)) return changed({ logo: await folding.call("logo", content) }, true);
      take(/\.toml$/i.test(file.name) ? ofTemplate(content) : ofValues(content, file.name));
    } catch (error) {
      showError(new LibraryError(`${file.name}: ${error instanceof SyntaxError || !(error instanceof Error) ? text.noSettings : error.message}`));
    }
  }

  /** The settings in a JSON file; of a family file, the current ones with this family. */
  function ofValues(content: string, name: string): Settings {
    const values = JSON.parse(content) as Record<string, unknown>;
    if (typeof values !== "object" || values === null) throw new Error(text.noSettings);
    if (String(values.schema).startsWith("deltille/family/")) return { ...settings, family: name, family_file: content };
    if ("schema" in values) throw new Error(text.isDescription);
    if (!isKind(values.kind)) throw new Error(text.noSettings);
    const given = Object.entries(values).filter(([, value]) => value !== null);
    return settingsOf(given.map(([key, value]) => [key, String(value)]));
  }

  /** Saves the settings: those of a board as a template of the program. */
  function store(): void {
    const isTemplate = isBoard(settings) && !hasFiles(settings) && !settings.mirrored && settings.kerf_mm === null;
    if (isTemplate) save(`${settings.name}.toml`, template(settings), "application/toml");
    else save(`${settings.name}.settings.json`, JSON.stringify(settings, null, 2), "application/json");
  }

  const link = el("button", { type: "button", click: () => void copy() }, text.link);
  async function copy(): Promise<void> {
    const of = query(settings);
    const url = new URL(location.href);
    url.hash = `make${of ? `?${of}` : ""}`;
    const isCopied = await navigator.clipboard.writeText(url.href).then(() => true, () => false);
    if (!isCopied) {
      history.replaceState(null, "", url);
      addressed = location.hash;
    }
    link.textContent = isCopied ? text.copied : text.inAddress;
    setTimeout(() => (link.textContent = text.link), 3000);
  }

  const seeIt = el("a", { class: "button", href: "#see", click: () => (made.isWanted = true) }, text.seeIt);
  const view = el("input", { type: "number", min: 1, max: 170, value: 60, step: "any", required: true, input: () => void showRange() });
  const pixels = el("input", { type: "number", min: 64, max: 20_000, value: 1920, required: true, input: () => void showRange() });
  const offered = select([["", text.noTemplate], ...templates.map(({ name }) => [name, name] as [string, string])], "", (name) => {
    const chosen = templates.find((template) => template.name === name);
    if (chosen) take(ofTemplate(chosen.text));
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
    const given = read(of);
    take(given.settings, given.ignored);
  });
  take(first.settings, first.ignored);
  Promise.all([drawing.call("families"), drawing.call("dictionaries")]).then(([families, dictionaries]) => {
    known = { families, dictionaries };
    fill();
  }, showError);

  return el(
    "section",
    { class: "make", "aria-label": words.tabs.make },
    el("h2", { class: "title" }, text.title),
    el("p", { class: "lead" }, text.lead),
    kinds,
    el(
      "div",
      { class: "bench" },
      el(
        "div",
        {},
        form,
        el(
          "div",
          { class: "rest" },
          el("fieldset", {}, el("legend", {}, text.camera), field(text.fieldOfView, view), field(text.pixels, pixels)),
          field(text.templates, offered),
          dropZone((files) => void load(files), el("p", {}, text.drop), el("div", { class: "buttons" }, el("button", { type: "button", click: () => choose(ACCEPTED) }, text.load)), chooser),
        ),
      ),
      el(
        "div",
        {},
        el("div", { class: "stage" }, notice, problem, views, el("div", { class: "board" }, picture, space), pager, sheets, facts, range, el("p", { class: "printed" }, text.printed)),
        el(
          "div",
          { class: "get" },
          el("div", { class: "buttons" }, pdf, verification.state),
          printing,
          more,
          el("div", { class: "buttons" }, seeIt),
          el("div", { class: "buttons quiet" }, link, el("button", { type: "button", click: store }, text.template)),
        ),
      ),
    ),
  );
}
