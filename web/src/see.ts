// See: photographs that are dropped, and what is found in them.
import { el, field, save, select } from "./dom";
import { LibraryError, looking } from "./library";
import { made, seen } from "./shared";
import { words } from "./words";
import type { Seen, Sought } from "./worker";

type Corner = { row: number; col: number; id: number | null; x: number; y: number; cov: [number, number, number] | null };
type Detection = { grids: { kind: string; panel: number | null; corners: Corner[]; tags: { id: number }[] }[] };
type Photo = { file: File; result: Seen | null; found: Detection | null; error: string };

/** Pixels of the picture that the magnifier shows. */
const MAGNIFIED = 24;
/** By how much ellipses are larger than one standard deviation. */
const ELLIPSE = 100;
const COLOURS = ["#0a84ff", "#ff9f0a", "#30d158", "#ff453a", "#bf5af2", "#64d2ff"];

export function see(): HTMLElement {
  let sought: Sought = { grid: "deltille" };
  let photos: Photo[] = [];
  let at = -1;

  const canvas = el("canvas", { class: "photo", role: "img", width: 0, height: 0, mousemove: (event) => magnify(event as MouseEvent), mouseleave: () => (lens.hidden = true) });
  const lens = el("canvas", { class: "lens", width: 240, height: 240, hidden: true });
  const told = el("p", { class: "facts", "aria-live": "polite" });
  const hint = el("p", { class: "facts", hidden: true }, words.see.magnifier);
  const list = el("ul", { class: "photos" });
  const downloads = el("div", { class: "buttons" });
  const chooser = el("input", { type: "file", multiple: true, hidden: true, accept: ".jpg,.jpeg,.png,.tif,.tiff,.webp,.bmp,.pgm,.ppm,.json", change: () => void take([...(chooser.files ?? [])]) });
  const zone = el(
    "div",
    {
      class: "drop",
      dragover: (event) => {
        event.preventDefault();
        zone.classList.add("over");
      },
      dragleave: () => zone.classList.remove("over"),
      drop: (event) => {
        event.preventDefault();
        zone.classList.remove("over");
        void take([...((event as DragEvent).dataTransfer?.files ?? [])]);
      },
    },
    el("p", {}, words.see.drop),
    el("div", { class: "buttons" }, el("button", { type: "button", class: "first", click: () => chooser.click() }, words.see.choose)),
    chooser,
  );
  const choice = el("div", {});
  let described: { name: string; json: string } | null = null;

  function choose(value: string): void {
    if (value === "made") sought = { target: made.json };
    else if (value === "described" && described) sought = { target: described.json };
    else sought = { grid: value };
    for (const photo of photos) {
      photo.result = photo.found = null;
      photo.error = "";
    }
    void look();
  }

  function offer(value: string): void {
    const options: [string, string][] = Object.entries(words.see.grid);
    if (described) options.unshift(["described", words.see.loaded(described.name)]);
    if (made.json) options.unshift(["made", words.see.made]);
    choice.replaceChildren(field(words.see.target, select(options, value, choose), words.see.description));
    choose(value);
  }

  async function take(files: File[]): Promise<void> {
    chooser.value = "";
    const target = files.find((file) => file.name.endsWith(".json"));
    const shots = files.filter((file) => file !== target);
    photos = photos.concat(shots.map((file) => ({ file, result: null, found: null, error: "" })));
    if (!target) return look();
    described = { name: target.name, json: await target.text() };
    offer("described");
  }

  async function look(): Promise<void> {
    const of = sought;
    seen.sought = of;
    for (const [index, photo] of photos.entries()) {
      if (of !== sought) return;
      if (photo.result || photo.error) continue;
      try {
        photo.result = await looking.call("photograph", of, photo.file.name, new Uint8Array(await photo.file.arrayBuffer()));
        photo.found = JSON.parse(photo.result.json) as Detection;
      } catch (error) {
        photo.error = error instanceof LibraryError && error.message ? error.message : words.failed;
      }
      if (at < 0 || at === index) {
        at = index;
        draw();
      }
      fill();
    }
    share();
    fill();
  }

  function share(): void {
    seen.shots = photos
      .filter((photo) => photo.found && photo.result)
      .map((photo) => {
        const grids = photo.found?.grids ?? [];
        const corners = grids.reduce((sum, grid) => sum + grid.corners.length, 0);
        return { name: photo.file.name, json: photo.result?.json ?? "", corners, labelled: grids.some((grid) => grid.panel !== null) };
      });
  }

  function figures(photo: Photo): string {
    if (photo.error) return photo.error;
    if (!photo.found || !photo.result) return words.loading;
    const corners = photo.found.grids.reduce((sum, grid) => sum + grid.corners.length, 0);
    const tags = photo.found.grids.reduce((sum, grid) => sum + grid.tags.length, 0);
    return corners === 0 ? words.see.none : words.see.found(corners, tags);
  }

  function fill(): void {
    list.replaceChildren(
      ...photos.map((photo, index) =>
        el(
          "li",
          {},
          el("button", { type: "button", "aria-pressed": index === at ? "true" : "false", click: () => ((at = index), draw(), fill()) }, el("strong", {}, photo.file.name), ` ${figures(photo)}`),
        ),
      ),
      ...(photos.length > 0 ? [el("li", {}, el("button", { type: "button", class: "quiet", click: () => clear() }, words.see.remove))] : []),
    );
  }

  function clear(): void {
    photos = [];
    at = -1;
    canvas.width = canvas.height = 0;
    told.textContent = "";
    hint.hidden = true;
    downloads.replaceChildren();
    share();
    fill();
  }

  function tell(error: unknown): void {
    told.textContent = error instanceof Error && error.message ? error.message : words.failed;
  }

  function draw(): void {
    const photo = photos[at];
    downloads.replaceChildren();
    if (!photo) return;
    if (!photo.result || !photo.found) {
      canvas.width = canvas.height = 0;
      hint.hidden = true;
      told.textContent = figures(photo);
      return;
    }
    const { width, height, grey, ms, reasons } = photo.result;
    canvas.width = width;
    canvas.height = height;
    const context = canvas.getContext("2d");
    if (!context) return;
    context.putImageData(new ImageData(grey as Uint8ClampedArray<ArrayBuffer>, width, height), 0, 0);
    const thick = Math.max(width / 900, 1);
    photo.found.grids.forEach((grid, index) => {
      context.strokeStyle = context.fillStyle = COLOURS[index % COLOURS.length] ?? "#0a84ff";
      context.lineWidth = thick;
      const places = new Map(grid.corners.map((corner) => [`${corner.row},${corner.col}`, corner]));
      context.beginPath();
      for (const corner of grid.corners) {
        for (const next of [places.get(`${corner.row},${corner.col + 1}`), places.get(`${corner.row + 1},${corner.col}`)]) {
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
    canvas.setAttribute("aria-label", `${photo.file.name}: ${figures(photo)}`);
    told.textContent = `${figures(photo)}, ${words.see.time(ms)}${reasons ? `. ${reasons.split("\n").join("; ")}` : ""}`;
    hint.hidden = false;
    downloads.replaceChildren(
      ...(["json", "csv", "orpc", "overlay"] as const).map((format) => el("button", { type: "button", click: () => void download(photo, format) }, format === "overlay" ? "PNG" : format.toUpperCase())),
    );
  }

  async function download(photo: Photo, format: "json" | "csv" | "orpc" | "overlay"): Promise<void> {
    if (format === "overlay") {
      canvas.toBlob((drawn) => drawn && save(`${photo.file.name.replace(/\.[^.]*$/, "")}.overlay.png`, drawn, "image/png"));
      return;
    }
    try {
      const content = await looking.call("export", sought, photo.file.name, new Uint8Array(await photo.file.arrayBuffer()), format);
      const stem = photo.file.name.replace(/\.[^.]*$/, "");
      save(`${stem}.${format}`, content);
    } catch (error) {
      tell(error);
    }
  }

  /** Shows the pixels about the pointer, with the corners there and their uncertainty. */
  function magnify(event: MouseEvent): void {
    const photo = photos[at];
    const context = lens.getContext("2d");
    if (!photo?.result || !photo.found || !context) return;
    const { width, height, grey } = photo.result;
    const box = canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * width - 0.5;
    const y = ((event.clientY - box.top) / box.height) * height - 0.5;
    const scale = lens.width / MAGNIFIED;
    const [left, top] = [Math.round(x - MAGNIFIED / 2), Math.round(y - MAGNIFIED / 2)];
    const part = new ImageData(MAGNIFIED, MAGNIFIED);
    for (let j = 0; j < MAGNIFIED; j++) {
      for (let i = 0; i < MAGNIFIED; i++) {
        const [px, py] = [left + i, top + j];
        const value = px >= 0 && py >= 0 && px < width && py < height ? (grey[4 * (py * width + px)] ?? 0) : 0;
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
    lens.hidden = false;
    const found = nearest as Corner | null;
    hint.textContent = found?.cov ? words.see.corner(found.row, found.col, found.id, Math.sqrt(found.cov[0]), Math.sqrt(found.cov[2])) : words.see.magnifier;
  }

  offer(made.json ? "made" : "deltille");
  return el(
    "section",
    { class: "see", "aria-label": words.tabs.see },
    el("p", { class: "lead" }, words.see.lead),
    el("div", { class: "columns" }, el("div", {}, zone, choice, el("h2", {}, words.see.list), list), el("div", { class: "stage" }, el("div", { class: "frame" }, canvas, lens), told, hint, downloads)),
  );
}
