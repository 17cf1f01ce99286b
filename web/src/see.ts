// Detect: dropped photographs, and the targets found in them.
import { dropZone, el, field, mistaken, save, select } from "./dom";
import { LibraryError, drawing, looking } from "./library";
import { type Sample, samples } from "./samples";
import { asked, usual } from "./settings";
import { photographPicture } from "./pictures";
import { made, seen, stem } from "./shared";
import { words } from "./words";
import type { Recognised, Shown, Sought } from "./worker";

type Corner = { row: number; col: number; id: number | null; x: number; y: number; cov: [number, number, number] | null };
type Detection = { ink?: unknown; grids: { kind: string; panel: number | null; corners: Corner[]; tags: { id: number }[] }[] };
type Photo = {
  name: string;
  /** Identifies the file, to skip duplicates. */
  key: string;
  bytes: () => Promise<Uint8Array>;
  /** The target searched for, and the ink estimate from this photograph alone. */
  of: Sought | null;
  ink: unknown;
  result: Shown | null;
  found: Detection | null;
  thumb: HTMLCanvasElement | null;
  error: string;
};
type BoardSpec = {
  kind: "board";
  grid?: string;
  rows: number;
  cols: number;
  edge_mm: number;
  inverted: boolean;
  tags: { family: string; first_id: number; spacing: number; border_bits: number; tags_in?: string };
};

/** Width of the magnified area, px of the image. */
const MAGNIFIED = 24;
/** Size of the ellipses, in standard deviations. */
const ELLIPSE = 100;
/** The largest paper: a board found in a photograph is not drawn. */
const LARGEST = "5080x5080mm";
/** File formats of the results; the last is behind “More formats”. */
const RESULTS = ["json", "csv", "orpc"] as const;
/** Width and height of a thumbnail, px. */
const THUMB = [128, 96] as const;
const COLOURS = ["#0a84ff", "#ff9f0a", "#30d158", "#ff453a", "#bf5af2", "#64d2ff"];

const photoOf = (name: string, key: string, bytes: () => Promise<ArrayBuffer>): Photo => ({
  name,
  key,
  bytes: () => bytes().then((buffer) => new Uint8Array(buffer), () => Promise.reject(new LibraryError(words.see.unreadable))),
  of: null,
  ink: null,
  result: null,
  found: null,
  thumb: null,
  error: "",
});

/** A small copy of a photograph, cropped to one aspect ratio; each pixel is the mean of those that it replaces. */
function thumbnail({ width, height, grey }: Shown): HTMLCanvasElement {
  const [wide, high] = THUMB;
  const step = Math.min(width / wide, height / high);
  const [left, top] = [(width - step * wide) / 2, (height - step * high) / 2];
  const canvas = el("canvas", { class: "thumb", width: wide, height: high, "aria-hidden": "true" });
  const shades = new ImageData(wide, high);
  for (let j = 0; j < high; j++) {
    for (let i = 0; i < wide; i++) {
      let [sum, count] = [0, 0];
      for (let y = Math.floor(top + j * step); y < Math.max(top + (j + 1) * step, top + j * step + 1) && y < height; y++) {
        for (let x = Math.floor(left + i * step); x < Math.max(left + (i + 1) * step, left + i * step + 1) && x < width; x++) {
          sum += grey[y * width + x] ?? 0;
          count += 1;
        }
      }
      const shade = sum / Math.max(count, 1);
      shades.data.set([shade, shade, shade, 255], 4 * (j * wide + i));
    }
  }
  canvas.getContext("2d")?.putImageData(shades, 0, 0);
  return canvas;
}

/** The message about a photograph, without the internals of its decoder and settings that the page lacks. */
const undecoded = (message: string): string => message.replace(/(^|: )(not a readable|damaged) .*/s, `$1${words.see.undecoded}`).replace(/[:;] (raise )?`max_pixels`.*/s, words.see.larger);

export function see(): HTMLElement {
  /** The target searched for; null until it is chosen or identified. */
  let sought: Sought | null = null;
  let choice = "auto";
  let recognised: Recognised | null = null;
  let photos: Photo[] = [];
  let at = -1;
  /** Counts requests, so that results of earlier ones are discarded. */
  let asking = 0;
  /** Position of the magnifier, px of the image. */
  let pointed: [number, number] = [0, 0];

  const canvas = el("canvas", {
    class: "photo",
    role: "img",
    width: 0,
    height: 0,
    pointermove: (event) => point(event as PointerEvent),
    pointerdown: (event) => point(event as PointerEvent),
    // Touch users lift the finger to see the magnified area.
    pointerleave: (event) => (lens.hidden ||= (event as PointerEvent).pointerType === "mouse"),
    blur: () => (lens.hidden = true),
    keydown: (event) => step(event as KeyboardEvent),
  });
  const lens = el("canvas", { class: "lens", width: 240, height: 240, hidden: true, "aria-hidden": "true" });
  const problem = el("p", { class: "problem", role: "alert", hidden: true });
  const status = el("p", { class: "facts", "aria-live": "polite" });
  const credit = el("p", { class: "credit", hidden: true });
  const hint = el("p", { class: "facts", hidden: true }, words.see.magnifier);
  const list = el("ul", { class: "photos" });
  const inked = el("p", { class: "facts", "aria-live": "polite" });
  const downloads = el("div", { class: "buttons" });
  const chooser = el("input", { type: "file", multiple: true, hidden: true, accept: ".jpg,.jpeg,.png,.tif,.tiff,.webp,.bmp,.pgm,.ppm,.json", change: () => begin(take([...(chooser.files ?? [])])) });
  const zone = dropZone(
    (files) => begin(take(files)),
    el("p", {}, words.see.drop),
    el("div", { class: "buttons" }, el("button", { type: "button", class: "first", click: () => chooser.click() }, words.see.choose)),
    el("div", { class: "buttons quiet" }, ...samples.map((sample) => el("button", { type: "button", click: () => begin(sampled(sample)) }, sample.label))),
    chooser,
  );
  const options = el("div", {});
  const known = el("div", { "aria-live": "polite" });
  let described: { name: string; json: string } | null = null;
  let isMoreOpen = false;

  /** Runs detection, whose end calibration awaits. */
  function begin(work: Promise<void>): void {
    seen.done = Promise.allSettled([seen.done, work]);
  }

  function choose(value: string): void {
    choice = value;
    recognised = null;
    seen.assumedEdge = null;
    seen.measuredEdge = false;
    seen.wrongEdge = "";
    known.replaceChildren();
    if (value === "auto") sought = null;
    else if (value === "made") sought = { target: made.json, family: made.family };
    else if (value === "described" && described) sought = { target: described.json };
    else sought = { grid: value };
    begin(again());
  }

  /** Repeats detection in all photographs. */
  function again(): Promise<void> {
    for (const photo of photos) {
      photo.result = photo.found = null;
      photo.error = "";
    }
    return look();
  }

  /** Shows the available targets and the current choice. */
  function offer(): void {
    const all: [string, string][] = [["auto", words.see.auto], ...Object.entries(words.see.grid)];
    if (described) all.unshift(["described", words.see.loaded(described.name)]);
    if (made.json) all.unshift(["made", words.see.made]);
    options.replaceChildren(field(words.see.target, select(all, choice, choose), words.see.description));
  }

  async function take(files: File[]): Promise<void> {
    chooser.value = "";
    problem.hidden = true;
    const isDescription = ({ name }: File) => /\.json$/i.test(name);
    for (const file of files.filter((file) => !isDescription(file))) add(photoOf(file.name, `${file.name} ${file.size} ${file.lastModified}`, () => file.arrayBuffer()));
    fill();
    let isOther = false;
    for (const file of files.filter(isDescription)) isOther = (await describe(file)) || isOther;
    if (!isOther) return look();
    choose("described");
    offer();
  }

  /** Uses the target that a file describes; a file without a valid description changes nothing. */
  async function describe(file: File): Promise<boolean> {
    try {
      const json = await file.text();
      if (!/"schema"\s*:\s*"deltille\/target\//.test(json)) throw new LibraryError(words.see.noDescription);
      await looking.call("know", { target: json });
      described = { name: file.name, json };
      return true;
    } catch (error) {
      problem.textContent = `${file.name}: ${error instanceof LibraryError && error.message ? error.message : words.see.unreadable}`;
      problem.hidden = false;
      return false;
    }
  }

  /** Adds a photograph unless it is there already: duplicates would make the calibration look more certain than it is. */
  function add(photo: Photo): void {
    if (!photos.some(({ key }) => key === photo.key)) photos.push(photo);
  }

  async function sampled(sample: Sample): Promise<void> {
    add(photoOf(sample.name, sample.address, async () => (await fetch(sample.address)).arrayBuffer()));
    at = photos.findIndex(({ key }) => key === sample.address);
    draw();
    await look();
  }

  /** Identifies the target in a photograph. */
  async function guess(photo: Photo): Promise<Sought> {
    const bytes = await photo.bytes();
    recognised = await looking.call("recognise", photo.name, bytes);
    if (recognised) return { target: recognised.target };
    // Without tags, choose the tiling with more corners.
    const counts = await Promise.all(
      Object.keys(words.see.grid).map(async (grid): Promise<[number, string]> => {
        const { json } = await looking.call("photograph", { grid }, null, photo.name, bytes);
        return [(JSON.parse(json) as Detection).grids.reduce((sum, { corners }) => sum + corners.length, 0), grid];
      }),
    );
    const [[most = 0, grid = "deltille"] = []] = counts.sort(([a], [b]) => b - a);
    return most > 0 ? { grid } : { grid: "deltille" };
  }

  async function look(): Promise<void> {
    const turn = ++asking;
    list.setAttribute("aria-busy", "true");
    inked.textContent = "";
    fill();
    for (const [index, photo] of photos.entries()) {
      if (photo.result || photo.error) continue;
      try {
        // An untagged photograph does not identify the target for the others: a later one may.
        const of = sought ?? (await guess(photo));
        if (turn !== asking) return;
        if (!sought && recognised) {
          sought = of;
          showTarget(recognised);
        }
        const result = await looking.call("photograph", of, null, photo.name, await photo.bytes());
        if (turn !== asking) return;
        photo.result = result;
        photo.thumb ??= thumbnail(result);
        photo.found = JSON.parse(result.json) as Detection;
        photo.ink = photo.found.ink ?? null;
        photo.of = seen.sought = of;
      } catch (error) {
        if (turn !== asking) return;
        photo.error = error instanceof LibraryError && error.message ? undecoded(error.message) : words.failed;
      }
      if (at < 0 || at === index) {
        at = index;
        draw();
      }
      fill();
    }
    try {
      await lookTogether(turn);
    } catch (error) {
      if (turn === asking) showError(error);
    }
    if (turn !== asking) return;
    share();
    list.removeAttribute("aria-busy");
  }

  /** Repeats detection in photographs of one print with their combined ink estimate, as `deltille detect` does. */
  async function lookTogether(turn: number): Promise<void> {
    const { sought: of } = seen;
    const alike = photos.filter((photo) => photo.result && JSON.stringify(photo.of) === JSON.stringify(of));
    if (!of || alike.length < 2) return;
    const ink = await looking.call("ink", of, alike.map((photo) => photo.ink));
    for (const photo of ink ? alike : []) {
      const result = await looking.call("photograph", of, ink, photo.name, await photo.bytes());
      if (turn !== asking) return;
      photo.result = result;
      photo.found = JSON.parse(result.json) as Detection;
      if (photo === photos[at]) draw();
    }
    if (turn !== asking) return;
    inked.textContent = ink ? words.see.inked(ink.words, (JSON.parse(ink.estimate) as { images: number }).images) : "";
    fill();
  }

  /** Shows the identified target, and asks for its tile edge, which a photograph cannot show. */
  function showTarget(found: Recognised): void {
    const spec = found.spec as BoardSpec;
    seen.assumedEdge = spec.edge_mm;
    seen.measuredEdge = false;
    if (spec.kind !== "board") {
      const shape = String((found.spec as { shape?: unknown }).shape ?? "");
      known.replaceChildren(el("p", { class: "good" }, words.see.recognisedSolid(shape, found.tags)), el("p", { class: "facts" }, words.see.assumedSolid(spec.edge_mm)));
      return;
    }
    const edge = el("input", { type: "number", min: 1, max: 1000, step: "any", placeholder: words.see.assumedEdge(spec.edge_mm), input: () => check(edge, wrong), change: () => begin(resize(spec, edge, wrong)) });
    const wrong = el("p", { class: "problem", role: "alert", hidden: true });
    known.replaceChildren(
      el("p", { class: "good" }, words.see.recognised(spec.grid ?? "deltille", spec.rows, spec.cols, spec.tags.family, spec.tags.first_id)),
      el("p", { class: "facts" }, words.see.recognisedBy(found.tags, found.shown, found.corners)),
      field(words.see.edge, edge, words.see.edgeHint),
      wrong,
    );
  }

  /** Whether an edge is valid; shows the message otherwise. */
  function check(edge: HTMLInputElement, wrong: HTMLElement): boolean {
    showWrong(wrong, mistaken([edge]) ?? "");
    return edge.validity.valid;
  }

  /** Shows the message about an invalid edge, which calibration refuses; an empty one hides it. */
  function showWrong(wrong: HTMLElement, message: string): void {
    wrong.textContent = seen.wrongEdge = message;
    wrong.hidden = message === "";
  }

  async function resize(spec: BoardSpec, edge: HTMLInputElement, wrong: HTMLElement): Promise<void> {
    if (!check(edge, wrong)) return;
    const edge_mm = edge.value === "" ? spec.edge_mm : Number(edge.value);
    seen.assumedEdge = edge.value === "" ? spec.edge_mm : null;
    seen.measuredEdge = edge.value !== "";
    const { family, first_id, spacing, border_bits, tags_in } = spec.tags;
    const { rows, cols, inverted, grid = "deltille" } = spec;
    try {
      const settings = { ...usual, kind: grid, rows, cols, edge_mm, inverted, family, first_id, tag_spacing: spacing, tag_border: border_bits, tags_in: tags_in ?? "black", paper: LARGEST };
      sought = { target: (await drawing.call("draw", asked(settings))).json };
      await again();
    } catch (error) {
      showWrong(wrong, error instanceof LibraryError && error.message ? words.see.tooLarge : words.failed);
    }
  }

  function share(): void {
    seen.shots = photos
      .filter((photo) => photo.found && photo.result)
      .map((photo) => {
        const grids = photo.found?.grids ?? [];
        const corners = grids.reduce((sum, grid) => sum + grid.corners.length, 0);
        return { name: photo.name, json: photo.result?.json ?? "", corners, labelled: grids.some((grid) => grid.panel !== null) };
      });
    window.dispatchEvent(new Event("seen"));
  }

  /** What was found in a photograph, and why it is not more. */
  function figures(photo: Photo): string {
    // The list shows the name already.
    if (photo.error) return photo.error.startsWith(`${photo.name}: `) ? photo.error.slice(photo.name.length + 2) : photo.error;
    // The first part of a sentence is the reason, the rest a remedy.
    const reason = isUnidentified(photo) ? words.see.unidentified : photo.result?.reasons[0]?.split(/[:;]/)[0];
    const state = stateOf(photo);
    if (state === "missing") return reason ?? words.see.none;
    return state === "unlabelled" && reason ? `${counts(photo)}; ${reason}` : counts(photo);
  }

  function counts(photo: Photo): string {
    if (!photo.found) return words.see.looking;
    const corners = photo.found.grids.reduce((sum, grid) => sum + grid.corners.length, 0);
    const tags = photo.found.grids.reduce((sum, grid) => sum + grid.tags.length, 0);
    return corners === 0 ? words.see.none : words.see.found(corners, tags);
  }

  /** Whether a photograph shows corners, but its target was to be identified by tags, and was not. */
  function isUnidentified({ of, found }: Photo): boolean {
    return choice === "auto" && of !== null && "grid" in of && found !== null && found.grids.length > 0;
  }

  function stateOf(photo: Photo): "failed" | "looking" | "missing" | "unlabelled" | "found" {
    if (photo.error) return "failed";
    if (!photo.found) return "looking";
    if (photo.found.grids.length === 0) return "missing";
    // Corners of untagged boards have no labels.
    const isUntagged = photo.of !== null && "grid" in photo.of && choice !== "auto";
    return isUntagged || photo.found.grids.some(({ panel }) => panel !== null) ? "found" : "unlabelled";
  }

  function pick(index: number): void {
    at = index;
    draw();
    fill();
    frame.scrollIntoView({ block: "nearest" });
  }

  function fill(): void {
    list.replaceChildren(
      ...photos.map((photo, index) =>
        el(
          "li",
          {},
          el(
            "button",
            { type: "button", "aria-pressed": index === at ? "true" : "false", class: stateOf(photo), click: () => pick(index) },
            photo.thumb ?? el("span", { class: "thumb" }),
            el("span", {}, el("strong", {}, photo.name), " ", el("span", { class: "figures-of" }, figures(photo))),
          ),
        ),
      ),
      ...(photos.length > 0
        ? [
            el(
              "li",
              { class: "buttons quiet" },
              photos.length > 1 && at >= 0 ? el("button", { type: "button", click: () => removeThis() }, words.see.removeThis) : null,
              el("button", { type: "button", click: () => clear() }, words.see.remove),
            ),
          ]
        : []),
    );
    heading.hidden = photos.length === 0;
    empty.hidden = photos.length > 0;
    waiting.hidden = photos.length === 0 || at >= 0;
    const usable = photos.filter(({ found }) => found?.grids.some(({ panel }) => panel !== null)).length;
    next.hidden = usable === 0;
    next.textContent = words.see.next(usable);
  }

  function removeThis(): void {
    photos.splice(at, 1);
    at = Math.min(at, photos.length - 1);
    draw();
    begin(look());
  }

  function clear(): void {
    photos = [];
    at = -1;
    asking += 1;
    problem.hidden = true;
    if (choice === "auto") choose("auto");
    blank();
    inked.textContent = "";
    share();
    fill();
  }

  function blank(): void {
    canvas.width = canvas.height = 0;
    status.textContent = "";
    hint.hidden = credit.hidden = lens.hidden = true;
    downloads.replaceChildren();
  }

  function showError(error: unknown): void {
    status.textContent = error instanceof Error && error.message ? error.message : words.failed;
  }

  function draw(): void {
    const photo = photos[at];
    downloads.replaceChildren();
    lens.hidden = true;
    if (!photo) return;
    status.className = `facts${photo.error ? " bad" : ""}`;
    const sample = samples.find(({ address }) => address === photo.key);
    credit.textContent = sample?.credit ?? "";
    credit.hidden = !sample?.credit;
    if (!photo.result || !photo.found) {
      canvas.width = canvas.height = 0;
      hint.hidden = true;
      status.textContent = photo.error || counts(photo);
      return;
    }
    const { width, height, grey, ms, reasons } = photo.result;
    canvas.width = width;
    canvas.height = height;
    canvas.tabIndex = 0;
    pointed = [width / 2, height / 2];
    const context = canvas.getContext("2d");
    if (!context) return;
    const shades = new ImageData(width, height);
    // Red, green and blue are the grey value; every pixel is opaque.
    const pixels = new Uint32Array(shades.data.buffer);
    for (let i = 0; i < pixels.length; i++) pixels[i] = 0xff000000 | (0x010101 * (grey[i] ?? 0));
    context.putImageData(shades, 0, 0);
    const thick = Math.max(width / 900, 1);
    photo.found.grids.forEach((grid, index) => {
      context.strokeStyle = context.fillStyle = COLOURS[index % COLOURS.length] ?? "#0a84ff";
      context.lineWidth = thick;
      const places = new Map(grid.corners.map((corner) => [`${corner.row},${corner.col}`, corner]));
      const steps = [[0, 1], [1, 0], ...(grid.kind === "checker" ? [] : [[1, -1]])];
      context.beginPath();
      for (const corner of grid.corners) {
        for (const [rows = 0, cols = 0] of steps) {
          const next = places.get(`${corner.row + rows},${corner.col + cols}`);
          if (!next) continue;
          context.moveTo(corner.x + 0.5, corner.y + 0.5);
          context.lineTo(next.x + 0.5, next.y + 0.5);
        }
      }
      context.globalAlpha = 0.5;
      context.stroke();
      context.globalAlpha = 1;
      for (const corner of grid.corners) {
        context.beginPath();
        context.arc(corner.x + 0.5, corner.y + 0.5, 2.2 * thick, 0, 2 * Math.PI);
        context.fill();
      }
    });
    canvas.setAttribute("aria-label", `${photo.name}: ${figures(photo)}. ${words.see.keys}`);
    const sentences = reasons.map((reason) => `${reason.charAt(0).toUpperCase()}${reason.slice(1)}${reason.endsWith("?") ? "" : "."}`);
    if (isUnidentified(photo)) sentences.push(words.see.chooseTarget);
    if (photo.of && "target" in photo.of && /"kind"\s*:\s*"charuco"/.test(photo.of.target)) sentences.push(words.see.innerTags);
    status.textContent = [`${counts(photo)}, ${words.see.time(ms)}.`, ...sentences].join(" ");
    hint.hidden = photo.found.grids.length === 0;
    hint.textContent = words.see.magnifier;
    const [first, second, other] = RESULTS.map((format) => el("button", { type: "button", click: () => save(`${stem(photo.name)}.${format}`, photo.result?.[format] ?? "") }, format.toUpperCase()));
    const more = el("details", { open: isMoreOpen, toggle: () => (isMoreOpen = more.open) }, el("summary", {}, words.see.more), other);
    downloads.replaceChildren(first ?? "", second ?? "", el("button", { type: "button", click: () => void overlay(photo) }, words.see.overlay), more);
  }

  async function overlay(photo: Photo): Promise<void> {
    try {
      const jpeg = await looking.call("overlay", photo.name, await photo.bytes(), photo.result?.json ?? "");
      save(`${stem(photo.name)}.overlay.jpg`, jpeg as Uint8Array<ArrayBuffer>, "image/jpeg");
    } catch (error) {
      showError(error);
    }
  }

  function point(event: PointerEvent): void {
    const box = canvas.getBoundingClientRect();
    pointed = [((event.clientX - box.left) / box.width) * canvas.width - 0.5, ((event.clientY - box.top) / box.height) * canvas.height - 0.5];
    magnify();
  }

  /** Moves from corner to corner by the arrow keys. */
  function step(event: KeyboardEvent): void {
    const way = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] } as Record<string, [number, number]>)[event.key];
    const corners = photos[at]?.found?.grids.flatMap((grid) => grid.corners) ?? [];
    if (event.key === "Escape") lens.hidden = true;
    if (!way) return;
    event.preventDefault();
    // The nearest corner that lies more along the direction than across it.
    const ahead = corners.flatMap(({ x, y }) => {
      const [along, across] = [(x - pointed[0]) * way[0] + (y - pointed[1]) * way[1], Math.abs((x - pointed[0]) * way[1] - (y - pointed[1]) * way[0])];
      return along > 0.5 && along > across ? [{ x, y, far: along + across }] : [];
    });
    const next = ahead.sort((a, b) => a.far - b.far)[0];
    if (next) pointed = [next.x, next.y];
    magnify();
  }

  /** Shows the pixels around a position, with the corners there and their uncertainty. */
  function magnify(): void {
    const photo = photos[at];
    const context = lens.getContext("2d");
    if (!photo?.result || !photo.found || !context) return;
    const { width, height, grey } = photo.result;
    const [x, y] = pointed;
    const scale = lens.width / MAGNIFIED;
    const [left, top] = [Math.round(x - MAGNIFIED / 2), Math.round(y - MAGNIFIED / 2)];
    const part = new ImageData(MAGNIFIED, MAGNIFIED);
    for (let j = 0; j < MAGNIFIED; j++) {
      for (let i = 0; i < MAGNIFIED; i++) {
        const [px, py] = [left + i, top + j];
        const value = px >= 0 && py >= 0 && px < width && py < height ? (grey[py * width + px] ?? 0) : 0;
        part.data.set([value, value, value, 255], 4 * (j * MAGNIFIED + i));
      }
    }
    const small = el("canvas", { width: MAGNIFIED, height: MAGNIFIED });
    small.getContext("2d")?.putImageData(part, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(small, 0, 0, lens.width, lens.height);
    let nearest: Corner | null = null;
    photo.found.grids.forEach((grid, index) => {
      context.strokeStyle = COLOURS[index % COLOURS.length] ?? "#0a84ff";
      context.lineWidth = 2;
      for (const corner of grid.corners) {
        const [cx, cy] = [(corner.x - left + 0.5) * scale, (corner.y - top + 0.5) * scale];
        if (cx < 0 || cy < 0 || cx > lens.width || cy > lens.height) continue;
        if (!nearest || Math.hypot(corner.x - x, corner.y - y) < Math.hypot(nearest.x - x, nearest.y - y)) nearest = corner;
        context.beginPath();
        context.moveTo(cx - 6, cy);
        context.lineTo(cx + 6, cy);
        context.moveTo(cx, cy - 6);
        context.lineTo(cx, cy + 6);
        context.stroke();
        if (!corner.cov) continue;
        const [xx, xy, yy] = corner.cov;
        const middle = (xx + yy) / 2;
        const spread = Math.hypot((xx - yy) / 2, xy);
        context.beginPath();
        context.ellipse(cx, cy, ELLIPSE * scale * Math.sqrt(middle + spread), ELLIPSE * scale * Math.sqrt(Math.max(middle - spread, 0)), 0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
        context.stroke();
      }
    });
    // Keep the magnifier away from the pointer.
    lens.classList.toggle("left", x > width / 2);
    lens.hidden = false;
    const found = nearest as Corner | null;
    hint.textContent = found?.cov ? words.see.corner(found.row, found.col, found.id, Math.sqrt(found.cov[0]), Math.sqrt(found.cov[2])) : words.see.magnifier;
  }

  const frame = el("div", { class: "frame" }, canvas, lens);
  const heading = el("h2", {}, words.see.list);
  const waiting = el("p", { class: "busy" }, words.see.looking);
  const empty = el("div", { class: "empty" }, photographPicture(), el("p", {}, words.see.empty), el("ol", {}, ...words.see.steps.map((step) => el("li", {}, step))));
  const next = el("a", { class: "button first", href: "#calibrate", hidden: true });
  /** Updates the choices, as the target of “Make” may have changed while this part was hidden. */
  function shown(): void {
    if (!location.hash.startsWith("#see")) return;
    const isOther = choice === "made" && !(sought && "target" in sought && sought.target === made.json);
    if (made.json && (made.isWanted || isOther)) choose("made");
    made.isWanted = false;
    offer();
  }
  window.addEventListener("hashchange", shown);
  fill();
  shown();
  offer();
  return el(
    "section",
    { class: "see", "aria-label": words.tabs.see },
    el("h2", { class: "title" }, words.see.title),
    el("p", { class: "lead" }, words.see.lead),
    el("div", { class: "columns" }, el("div", { class: "settings" }, zone, options, known, heading, list, inked), el("div", { class: "stage" }, problem, empty, waiting, frame, status, hint, downloads, next, credit)),
  );
}
