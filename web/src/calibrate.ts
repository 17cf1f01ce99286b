// Calibrate: from processed photographs, or from a webcam.
import { el, field, save, select } from "./dom";
import { looking } from "./library";
import { type Shot, made, seen, stem } from "./shared";
import { posesPicture } from "./pictures";
import { surveyed, tints } from "./survey";
import { words } from "./words";
import type { HoldStatus, Next, Result, Sought, Survey, TextFile } from "./worker";

/** Range of the print scale: beyond it, the check bars were misread. */
const SCALES = [0.5, 2] as const;
/** Largest deviation of the print scale from 1 that printers cause. */
const DEVIATION = 0.05;
/** Time after which a proposed pose that was not reached can be exchanged, ms. */
const STUCK_MS = 10_000;

/** The print scale across and up the sheet from ratios, or from quotients of measured and stated lengths; null without any. */
function printScale(text: string): [number, number] | null {
  if (text.trim() === "") return null;
  const ratios = text.split(",").map((part) => {
    const [, measured, stated = "1"] = /^\s*(\d*\.?\d+)\s*(?:\/\s*(\d*\.?\d+))?\s*$/.exec(part) ?? [];
    return Number(measured) / Number(stated);
  });
  const [across = NaN, up = across] = ratios;
  if (ratios.length > 2 || ![across, up].every((ratio) => ratio >= SCALES[0] && ratio <= SCALES[1])) throw new Error(words.calibrate.noScale(text));
  return [across, up];
}

export function calibrate(): HTMLElement {
  let model = "radtan";
  let taken: Shot[] = [];
  let stream: MediaStream | null = null;
  /** Whether images are captured at proposed poses, or at any new pose. */
  let guided = true;
  let next: Next | null = null;
  let proposedAt = 0;
  /** Image coverage so far, and the inputs it was computed from. */
  let survey: Survey | null = null;
  let surveyOf: string[] = [];
  /** Inputs of the calibration shown. */
  let solvedOf: string[] = [];
  /** Mode and model of the running webcam session; null to restart it. */
  let watched: string | null = null;
  /** Frames processed since the page was opened. */
  let frames = 0;

  const count = el("p", { class: "facts", "aria-live": "polite" });
  const covered = el("p", { class: "facts", "aria-live": "polite" });
  const drawings = el("div", { class: "survey" });
  const result = el("div", { class: "result", "aria-live": "polite" });
  const outdated = el("p", { class: "problem", hidden: true }, words.calibrate.outdated);
  const problem = el("p", { class: "problem", role: "alert", hidden: true });
  const video = el("video", { playsinline: true, muted: true, hidden: true });
  const over = el("canvas", { class: "photo", role: "img", "aria-label": words.calibrate.webcam, hidden: true });
  const live = el("p", { class: "facts", "aria-live": "off" });
  const wish = el("p", { class: "wish", "aria-live": "polite", hidden: true });
  const state = el("p", { class: "facts", "aria-live": "polite", hidden: true });
  const elsewhere = el("button", { type: "button", hidden: true, click: () => void refuse() }, words.calibrate.refuse);
  const now = el("button", { type: "button", hidden: true, click: () => (takeNow = true) }, words.calibrate.now);
  let takeNow = false;
  const forget = el("button", { type: "button", hidden: true, click: () => forgetAll() }, words.calibrate.forget);
  const scale = el("input", { type: "text", inputmode: "decimal", placeholder: words.calibrate.printScaleUsual, input: () => (scale.setCustomValidity(""), tally()), change: () => checkScale() });
  const farScale = el("p", { class: "warning", role: "status", hidden: true }, words.calibrate.farScale(100 * DEVIATION));
  const empty = el(
    "div",
    { class: "empty" },
    posesPicture(),
    el("p", {}, words.calibrate.empty),
    el("ol", {}, ...words.calibrate.steps.map(({ text, link, href }) => el("li", {}, text, link ? " " : null, link ? el("a", { href }, link) : null))),
  );
  const aim = el("p", { class: "facts" });
  const webcam = el("button", { type: "button", click: () => void (stream ? stop() : start()) }, words.calibrate.webcam);

  /** The webcam's images if there are any, otherwise the photographs: they come from different cameras. */
  const shots = () => (stream || taken.length > 0 ? taken : seen.shots.filter((shot) => shot.labelled));
  /** Inputs of the survey, and of a calibration. */
  const given = () => [target(), model, ...shots().map(({ json }) => json)];
  const asked = () => [scale.value, ...given()];
  const isSame = (one: string[], other: string[]) => one.length === other.length && one.every((part, i) => part === other[i]);
  const sought = (): Sought & { target: string } => (seen.sought && "target" in seen.sought ? seen.sought : { target: made.json, family: made.family });
  const target = () => sought().target;

  function tally(): void {
    count.textContent = words.calibrate.few(shots().length);
    const isOfDetect = seen.sought && "target" in seen.sought;
    aim.textContent = isOfDetect ? words.calibrate.aim.seen : made.json ? words.calibrate.aim.made(made.name) : words.calibrate.aim.none;
    forget.hidden = taken.length === 0;
    outdated.hidden = solvedOf.length === 0 || isSame(solvedOf, asked());
    empty.hidden = stream !== null || shots().length > 0;
    if (location.hash.startsWith("#calibrate")) void look();
  }

  /** Shows the image coverage if the inputs changed. */
  async function look(): Promise<void> {
    const all = shots();
    const of = given();
    if (isSame(of, surveyOf)) return;
    surveyOf = of;
    // An earlier problem concerned other inputs.
    problem.hidden = true;
    let found: Survey | null = null;
    try {
      found = all.length > 0 ? await looking.call("survey", target(), all.map(({ json }) => json), all.map(({ name }) => stem(name)), model) : null;
    } catch {
      // Calibrating reports problems with the images.
    }
    if (of !== surveyOf) return;
    survey = found;
    const { said, figures } = found ? surveyed(found) : { said: "", figures: [] };
    covered.textContent = said;
    drawings.replaceChildren(...figures);
  }

  function forgetAll(): void {
    taken = [];
    watched = null;
    tally();
  }

  function showError(error: unknown): void {
    problem.textContent = error instanceof Error && error.message ? error.message : words.failed;
    problem.hidden = false;
  }

  /** Reports an invalid print scale, and marks its field. */
  function checkScale(): void {
    problem.hidden = farScale.hidden = true;
    try {
      farScale.hidden = (printScale(scale.value) ?? []).every((ratio) => Math.abs(ratio - 1) <= DEVIATION);
    } catch (error) {
      scale.setCustomValidity((error as Error).message);
      showError(error);
    }
  }

  /** Refuses to continue with an earlier edge. */
  function checkEdge(): void {
    if (seen.wrongEdge) throw new Error(words.calibrate.wrongEdge(seen.wrongEdge));
  }

  async function solve(): Promise<void> {
    problem.hidden = true;
    solvedOf = [];
    tally();
    try {
      result.replaceChildren(el("p", { class: "busy" }, words.calibrate.detecting));
      result.scrollIntoView({ block: "nearest" });
      for (let known; known !== seen.done; ) await (known = seen.done);
      checkEdge();
      const all = shots();
      if (all.length === 0) throw new Error(words.calibrate.noShots);
      result.replaceChildren(el("p", { class: "busy" }, words.calibrate.solving));
      solvedOf = asked();
      tally();
      show(await looking.call("calibrate", target(), all.map(({ json }) => json), all.map(({ name }) => stem(name)), model, printScale(scale.value) ?? (seen.measuredEdge ? [1, 1] : null)));
      result.scrollIntoView({ block: "nearest" });
    } catch (error) {
      solvedOf = [];
      tally();
      result.replaceChildren();
      showError(error);
    }
  }

  function show({ figures, said, files, others }: Result): void {
    const text = words.calibrate;
    const digits = (value: number, sd: number | null) => (sd && sd > 0 ? value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(sd)))) : value.toPrecision(7));
    const rows = figures.names.flatMap((name, i) => {
      const [value = 0, sd = null] = [figures.values[i], figures.sd[i]];
      // The model does not have this parameter.
      if (sd === null && value === 0) return [];
      return el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, digits(value, sd)), el("td", {}, sd ? sd.toPrecision(2) : ""));
    });
    const sure = figures.projection_sd_px;
    const download = ({ name, text }: TextFile) => el("button", { type: "button", click: () => save(name, text) }, name === "camera-report.html" ? words.calibrate.page : name);
    result.replaceChildren(
      el("p", { class: said.length > 0 ? "facts" : "good" }, text.rms(figures.rms_px.toFixed(4), figures.views)),
      sure ? el("p", {}, text.sure(sure.toFixed(4), figures.is_observed)) : "",
      seen.assumedEdge === null ? "" : el("p", { class: "warning" }, text.assumedEdge(seen.assumedEdge)),
      said.length > 0 ? el("ul", {}, ...said.map((sentence) => el("li", {}, sentence))) : el("p", {}, text.nothing),
      el("table", {}, el("thead", {}, el("tr", {}, ...[text.parameter, text.value, text.deviation].map((head) => el("th", { scope: "col" }, head)))), el("tbody", {}, ...rows)),
      el("div", { class: "buttons" }, ...files.map(download), el("details", { hidden: others.length === 0 }, el("summary", {}, text.more), el("div", { class: "buttons" }, ...others.map(download)))),
    );
  }

  /** Shows a proposed pose, or hides it. */
  function propose(proposed: Next | null): void {
    next = proposed;
    proposedAt = performance.now();
    for (const part of [wish, state, elsewhere]) part.hidden = next === null;
    if (!next) return;
    const { description: proposal, uncertainty_px: px, expected_px: then, sufficient } = next;
    const sure = px === null ? "" : words.calibrate.guided(px, then);
    wish.textContent = sufficient ? `${words.calibrate.enough} ${sure}` : `${proposal.charAt(0).toUpperCase()}${proposal.slice(1)}. ${sure}`;
  }

  async function refuse(): Promise<void> {
    propose(await looking.call("refuse"));
  }

  async function start(): Promise<void> {
    try {
      checkEdge();
      if (!target()) throw new Error(words.calibrate.noTarget);
    } catch (error) {
      return showError(error);
    }
    try {
      stream = await navigator.mediaDevices.getUserMedia({ video: { width: { ideal: 1280 }, facingMode: "environment" } });
    } catch {
      showError(new Error(words.calibrate.denied));
      return;
    }
    problem.hidden = true;
    webcam.textContent = words.calibrate.stop;
    video.srcObject = stream;
    await video.play();
    over.hidden = false;
    now.hidden = false;
    tally();
    void watch();
  }

  function stop(): void {
    for (const track of stream?.getTracks() ?? []) track.stop();
    stream = null;
    webcam.textContent = words.calibrate.webcam;
    over.hidden = true;
    now.hidden = true;
    live.textContent = "";
    propose(null);
    tally();
  }

  async function watch(): Promise<void> {
    const context = over.getContext("2d");
    // A frame is drawn together with its detection, not before.
    const hidden = el("canvas", {});
    const frame = hidden.getContext("2d", { willReadFrequently: true });
    let rate = 0;
    watched = null;
    while (stream && context && frame && over.isConnected) {
      const begin = performance.now();
      const [width, height] = [video.videoWidth, video.videoHeight];
      if (width === 0) {
        await new Promise(requestAnimationFrame);
        continue;
      }
      if (over.width !== width || over.height !== height) [over.width, over.height, hidden.width, hidden.height] = [width, height, width, height];
      try {
        // The first frame, another model or another capture mode starts a new session, with the images captured so far.
        const asking = guided ? `${model} ${width} ${height}` : "";
        if (asking !== watched) {
          watched = asking;
          await looking.call("watch");
          const begun = guided ? await looking.call("guide", target(), width, height, model, taken) : null;
          if (!stream) break;
          propose(begun);
        }
      } catch (error) {
        showError(error);
        guided = false;
        way.value = "free";
        continue;
      }
      frame.drawImage(video, 0, 0);
      const { data } = frame.getImageData(0, 0, width, height);
      const name = `webcam-${String(taken.length).padStart(3, "0")}`;
      try {
        // The pixel buffer is transferred, and comes back with the detection.
        const found = await looking.handing([data.buffer], "frame", sought(), name, width, height, data, begin / 1000);
        if (!stream) break;
        context.putImageData(new ImageData(found.pixels as Uint8ClampedArray<ArrayBuffer>, width, height), 0, 0);
        // Without a proposal, show where corners are still missing.
        if (!guided && survey) tint(context, survey);
        const corners = mark(context, found.json);
        if (takeNow && corners === 0) {
          takeNow = false;
          showError(new Error(words.calibrate.held.unseen));
        }
        if (next) outline(context, next, found.held);
        const isStuck = performance.now() - proposedAt > STUCK_MS;
        state.textContent = found.held ? `${words.calibrate.held[found.held.held] ?? ""}${isStuck ? ` ${words.calibrate.stuck}` : ""}` : "";
        if (corners > 0 && (takeNow || (guided ? found.held?.held === "taken" : found.keep))) {
          taken.push({ name, json: found.json, corners, labelled: true });
          tally();
          if (guided) propose(await looking.call("take", name, found.json));
          takeNow = false;
          problem.hidden = true;
        }
      } catch (error) {
        stop();
        showError(error);
        return;
      }
      frames += 1;
      over.dataset.frames = String(frames);
      if (rate === 0) over.scrollIntoView({ block: "center" });
      rate = 0.8 * rate + 0.2 * (1000 / (performance.now() - begin));
      live.textContent = `${guided ? "" : `${words.calibrate.hold} `}${words.calibrate.taken(taken.length)}, ${words.calibrate.rate(rate)}.`;
      await new Promise(requestAnimationFrame);
    }
    if (stream) stop();
  }

  /** Draws the proposed outline of the board, with an arrow to its upper side; it fills while the board is held there. */
  function outline(context: CanvasRenderingContext2D, { outlines_px, up_px }: Next, held: HoldStatus | null): void {
    const there = held?.held === "steady" || held?.held === "taken";
    context.save();
    context.strokeStyle = there ? "#30d158" : "#ff9600";
    context.fillStyle = there ? `rgba(48, 209, 88, ${0.15 + 0.45 * (held?.part ?? 0)})` : "rgba(255, 150, 0, 0.15)";
    context.lineWidth = Math.max(2, context.canvas.width / 300);
    for (const polygon of outlines_px) {
      context.beginPath();
      for (const [x, y] of polygon) context.lineTo(x + 0.5, y + 0.5);
      context.closePath();
      context.fill();
      context.stroke();
    }
    if (up_px) {
      const [[x, y], [tipX, tipY]] = up_px;
      const [backX, backY] = [(x - tipX) / 4, (y - tipY) / 4];
      context.lineWidth *= 2;
      context.beginPath();
      context.moveTo(x + 0.5, y + 0.5);
      context.lineTo(tipX + 0.5, tipY + 0.5);
      for (const side of [0.6, -0.6]) {
        context.moveTo(tipX + backX - side * backY + 0.5, tipY + backY + side * backX + 0.5);
        context.lineTo(tipX + 0.5, tipY + 0.5);
      }
      context.stroke();
    }
    context.restore();
  }

  /** Tints the covered part of the image. */
  function tint(context: CanvasRenderingContext2D, survey: Survey): void {
    const { width, height } = context.canvas;
    if (survey.size_px[0] !== width || survey.size_px[1] !== height) return;
    const [columns, rows] = survey.cells;
    tints(survey).forEach((tint, i) => {
      context.fillStyle = `rgba(10, 132, 255, ${0.5 * tint})`;
      context.fillRect(((i % columns) * width) / columns, (Math.floor(i / columns) * height) / rows, width / columns, height / rows);
    });
  }

  /** Marks and counts the labelled corners of a frame. */
  function mark(context: CanvasRenderingContext2D, json: string): number {
    const { grids } = JSON.parse(json) as { grids: { panel: number | null; corners: { x: number; y: number }[] }[] };
    const corners = grids.filter((grid) => grid.panel !== null).flatMap((grid) => grid.corners);
    context.fillStyle = "#30d158";
    for (const { x, y } of corners) context.fillRect(x - 2, y - 2, 5, 5);
    return corners.length;
  }

  const ways: [string, string][] = [
    ["guided", words.calibrate.ways.guided],
    ["free", words.calibrate.ways.free],
  ];
  const way = select(ways, "guided", (value) => (guided = value === "guided"));
  const whole = el(
    "section",
    { class: "calibrate", "aria-label": words.tabs.calibrate },
    el("h2", { class: "title" }, words.calibrate.title),
    el("p", { class: "lead" }, words.calibrate.lead),
    el(
      "div",
      { class: "columns" },
      el(
        "div",
        { class: "settings" },
        field(words.calibrate.model, select(Object.entries(words.calibrate.models), model, (value) => ((model = value), tally()))),
        field(words.calibrate.printScale, scale, words.calibrate.printScaleHint),
        field(words.calibrate.way, way),
        count,
        el("div", { class: "buttons" }, el("button", { type: "button", class: "first", click: () => void solve() }, words.calibrate.start), webcam, forget),
        // Below the buttons, which must not move when they are clicked.
        farScale,
        aim,
      ),
      el("div", { class: "stage" }, problem, empty, wish, video, over, state, el("div", { class: "buttons" }, now, elsewhere), live, covered, drawings, outdated, result),
    ),
  );
  for (const event of ["hashchange", "seen"]) window.addEventListener(event, tally);
  tally();
  return whole;
}
