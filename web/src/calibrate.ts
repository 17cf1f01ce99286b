// Calibrate: from the photographs that were looked at, or from a webcam.
import { el, field, save, select } from "./dom";
import { looking } from "./library";
import { type Shot, made, seen } from "./shared";
import { words } from "./words";
import type { Result } from "./worker";

const models: [string, string][] = ["radtan", "radtan5", "rational", "kannala-brandt", "eucm", "double-sphere"].map((model) => [model, model]);
/** A picture of the webcam is taken where the board's corners moved by less than this part of the width since the last one… */
const STILL = 0.004;
/** …and by more than this since the last that was taken. */
const ELSEWHERE = 0.08;

export function calibrate(): HTMLElement {
  let model = "radtan";
  let taken: Shot[] = [];
  let stream: MediaStream | null = null;

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
    const rows = figures.names.map((name, i) => {
      const [value = 0, sd = null] = [figures.values[i], figures.sd[i]];
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

  type Places = Map<number, [number, number]>;

  /** Mean distance of corners that both have, as a part of the width; infinite where there are none. */
  function moved(one: Places, other: Places | null, width: number): number {
    const both = other ? [...one].flatMap(([id, [x, y]]) => (other.has(id) ? [Math.hypot(x - (other.get(id)?.[0] ?? 0), y - (other.get(id)?.[1] ?? 0))] : [])) : [];
    return both.length > 0 ? both.reduce((sum, by) => sum + by, 0) / both.length / width : Infinity;
  }

  async function watch(): Promise<void> {
    const context = over.getContext("2d", { willReadFrequently: true });
    let last: Places | null = null;
    const views: Places[] = [];
    let rate = 0;
    while (stream && context && over.isConnected) {
      const begin = performance.now();
      const [width, height] = [video.videoWidth, video.videoHeight];
      if (width === 0) {
        await new Promise(requestAnimationFrame);
        continue;
      }
      if (over.width !== width || over.height !== height) [over.width, over.height] = [width, height];
      context.drawImage(video, 0, 0);
      const pixels = context.getImageData(0, 0, width, height);
      const name = `webcam-${String(taken.length).padStart(3, "0")}`;
      try {
        const found = await looking.call("frame", { target: target() }, name, width, height, pixels.data);
        const grids = (JSON.parse(found.json) as { grids: { panel: number | null; corners: { id: number | null; x: number; y: number }[] }[] }).grids;
        const corners = grids.filter((grid) => grid.panel !== null).flatMap((grid) => grid.corners);
        const places: Places = new Map(corners.flatMap(({ id, x, y }) => (id === null ? [] : [[id, [x, y]]])));
        context.putImageData(pixels, 0, 0);
        context.fillStyle = "#30d158";
        for (const [x, y] of places.values()) context.fillRect(x - 2, y - 2, 5, 5);
        const isStill = moved(places, last, width) < STILL;
        const isElsewhere = views.every((view) => moved(places, view, width) > ELSEWHERE);
        if (places.size >= 12 && isStill && isElsewhere) {
          views.push(places);
          taken.push({ name, json: found.json, corners: places.size, labelled: true });
          tally();
        }
        last = places;
      } catch (error) {
        tell(error);
        stop();
        return;
      }
      rate = 0.8 * rate + 0.2 * (1000 / (performance.now() - begin));
      live.textContent = `${words.calibrate.hold} ${words.calibrate.taken(taken.length)}, ${words.calibrate.rate(rate)}.`;
      await new Promise(requestAnimationFrame);
    }
    if (stream) stop();
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
