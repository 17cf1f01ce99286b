// Calibrate: from the photographs that were looked at, or from a webcam.
import { el, field, save, select } from "./dom";
import { looking } from "./library";
import { type Shot, made, seen } from "./shared";
import { words } from "./words";
import type { Result } from "./worker";

const models: [string, string][] = ["radtan", "radtan5", "rational", "kannala-brandt", "eucm", "double-sphere"].map((model) => [model, model]);

export function calibrate(): HTMLElement {
  let model = "radtan";
  let taken: Shot[] = [];
  let stream: MediaStream | null = null;
  /** Frames that were looked at since the page was opened. */
  let frames = 0;

  const count = el("p", { class: "facts", "aria-live": "polite" });
  const result = el("div", { class: "result", "aria-live": "polite" });
  const problem = el("p", { class: "problem", role: "alert", hidden: true });
  const video = el("video", { playsinline: true, muted: true, hidden: true });
  const over = el("canvas", { class: "photo", role: "img", "aria-label": words.calibrate.webcam, hidden: true });
  const live = el("p", { class: "facts", "aria-live": "off" });
  const webcam = el("button", { type: "button", click: () => void (stream ? stop() : start()) }, words.calibrate.webcam);

  const shots = () => [...seen.shots.filter((shot) => shot.labelled), ...taken];
  const target = () => (seen.sought && "target" in seen.sought ? seen.sought.target : made.json);
  const tally = () => (count.textContent = words.calibrate.few(shots().length));

  function tell(error: unknown): void {
    problem.textContent = error instanceof Error && error.message ? error.message : words.failed;
    problem.hidden = false;
  }

  async function solve(): Promise<void> {
    problem.hidden = true;
    tally();
    if (shots().length === 0) {
      tell(new Error(words.calibrate.noShots));
      return;
    }
    result.replaceChildren(el("p", { class: "busy" }, words.calibrate.solving));
    try {
      const all = shots();
      show(await looking.call("calibrate", target(), all.map(({ json }) => json), all.map(({ name }) => name), model));
    } catch (error) {
      result.replaceChildren();
      tell(error);
    }
  }

  function show({ figures, said, files }: Result): void {
    const text = words.calibrate;
    const digits = (value: number, sd: number | null) => (sd && sd > 0 ? value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(sd)))) : value.toPrecision(7));
    const rows = figures.names.flatMap((name, i) => {
      const [value = 0, sd = null] = [figures.values[i], figures.sd[i]];
      // What the model does not have.
      if (sd === null && value === 0) return [];
      return el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, digits(value, sd)), el("td", {}, sd ? sd.toPrecision(2) : ""));
    });
    const sure = figures.projection_sd_px;
    result.replaceChildren(
      el("p", { class: "good" }, text.rms(figures.rms_px.toFixed(4), figures.views)),
      sure ? el("p", {}, text.sure(sure.toFixed(4))) : "",
      said.length > 0 ? el("ul", {}, ...said.map((sentence) => el("li", {}, sentence))) : el("p", {}, text.nothing),
      el("table", {}, el("thead", {}, el("tr", {}, ...[text.parameter, text.value, text.deviation].map((head) => el("th", { scope: "col" }, head)))), el("tbody", {}, ...rows)),
      el("div", { class: "buttons" }, ...files.map(({ name, text }) => el("button", { type: "button", click: () => save(name, text) }, name === "camera.html" ? words.calibrate.page : name))),
    );
  }

  async function start(): Promise<void> {
    if (!target()) {
      tell(new Error(words.calibrate.noTarget));
      return;
    }
    try {
      stream = await navigator.mediaDevices.getUserMedia({ video: { width: { ideal: 1280 }, facingMode: "environment" } });
    } catch {
      tell(new Error(words.calibrate.denied));
      return;
    }
    problem.hidden = true;
    webcam.textContent = words.calibrate.stop;
    video.srcObject = stream;
    await video.play();
    over.hidden = false;
    void watch();
  }

  function stop(): void {
    for (const track of stream?.getTracks() ?? []) track.stop();
    stream = null;
    webcam.textContent = words.calibrate.webcam;
    over.hidden = true;
    live.textContent = "";
  }

  async function watch(): Promise<void> {
    const context = over.getContext("2d");
    // A frame is shown with what was found in it, not before.
    const hidden = el("canvas", {});
    const frame = hidden.getContext("2d", { willReadFrequently: true });
    await looking.call("watch");
    let rate = 0;
    while (stream && context && frame && over.isConnected) {
      const begin = performance.now();
      const [width, height] = [video.videoWidth, video.videoHeight];
      if (width === 0) {
        await new Promise(requestAnimationFrame);
        continue;
      }
      if (over.width !== width || over.height !== height) [over.width, over.height, hidden.width, hidden.height] = [width, height, width, height];
      frame.drawImage(video, 0, 0);
      const { data } = frame.getImageData(0, 0, width, height);
      const name = `webcam-${String(taken.length).padStart(3, "0")}`;
      try {
        // The pixels are handed over, and come back with what was found.
        const found = await looking.handing([data.buffer], "frame", { target: target() }, name, width, height, data);
        if (!stream) break;
        context.putImageData(new ImageData(found.pixels as Uint8ClampedArray<ArrayBuffer>, width, height), 0, 0);
        const corners = mark(context, found.json);
        if (found.keep) {
          taken.push({ name, json: found.json, corners, labelled: true });
          tally();
        }
      } catch (error) {
        tell(error);
        stop();
        return;
      }
      frames += 1;
      over.dataset.frames = String(frames);
      rate = 0.8 * rate + 0.2 * (1000 / (performance.now() - begin));
      live.textContent = `${words.calibrate.hold} ${words.calibrate.taken(taken.length)}, ${words.calibrate.rate(rate)}.`;
      await new Promise(requestAnimationFrame);
    }
    if (stream) stop();
  }

  /** Marks the labelled corners of a frame, and counts them. */
  function mark(context: CanvasRenderingContext2D, json: string): number {
    const { grids } = JSON.parse(json) as { grids: { panel: number | null; corners: { x: number; y: number }[] }[] };
    const corners = grids.filter((grid) => grid.panel !== null).flatMap((grid) => grid.corners);
    context.fillStyle = "#30d158";
    for (const { x, y } of corners) context.fillRect(x - 2, y - 2, 5, 5);
    return corners.length;
  }

  const whole = el(
    "section",
    { class: "calibrate", "aria-label": words.tabs.calibrate },
    el("p", { class: "lead" }, words.calibrate.lead),
    el(
      "div",
      { class: "columns" },
      el("div", {}, field(words.calibrate.model, select(models, model, (value) => (model = value))), count, el("div", { class: "buttons" }, el("button", { type: "button", class: "first", click: () => void solve() }, words.calibrate.start), webcam)),
      el("div", { class: "stage" }, problem, video, over, live, result),
    ),
  );
  window.addEventListener("hashchange", () => tally());
  tally();
  return whole;
}
