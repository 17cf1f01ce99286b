// Image coverage so far: corners in each cell of the image, and tilts of the board.
import { el, shape } from "./dom";
import { words } from "./words";
import type { Survey } from "./worker";

/** Tilts of the rings and at the edge of the plot, degrees. */
const RINGS = [20, 40, 60];
const EDGE = 70;

const degrees = (rad: number) => (180 / Math.PI) * rad;

/** Tint of each cell, from 0 to 1: 0 without corners, and visible from the first corner on. */
export function tints({ counts }: Survey): number[] {
  const most = Math.max(...counts, 1);
  return counts.map((count) => (count === 0 ? 0 : 0.25 + 0.75 * Math.sqrt(count / most)));
}

/** Returns a summary in words, and the two figures. */
export function surveyed(survey: Survey): { said: string; figures: HTMLElement[] } {
  const text = words.calibrate.survey;
  const tilts = survey.tilts.filter((tilt) => tilt !== null);
  const leant = tilts.map(([tilt]) => Math.round(degrees(tilt)));
  const covered = text.covered(Math.round(100 * survey.covered));
  const range = leant.length > 0 ? text.tilts(Math.min(...leant), Math.max(...leant)) : "";
  const figure = (drawing: SVGElement, caption: string) => el("figure", {}, drawing, el("figcaption", {}, caption));
  const figures = [figure(coverage(survey, covered), text.coverage)];
  if (leant.length > 0) figures.push(figure(leanings(tilts, range), text.leanings));
  return { said: `${[text.pictures(survey.tilts.length), covered, range].filter(Boolean).join("; ")}.`, figures };
}

/** The image area, its cells tinted by the number of corners in them. */
function coverage(survey: Survey, label: string): SVGElement {
  const [width, height] = survey.size_px;
  const [columns, rows] = survey.cells;
  const [wide, high] = [width / columns, height / rows];
  const cells = tints(survey).flatMap((tint, i) => (tint === 0 ? [] : shape("rect", { x: (i % columns) * wide, y: Math.floor(i / columns) * high, width: wide, height: high, "fill-opacity": tint })));
  return shape("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label, class: "coverage" }, ...cells);
}

/** One dot per image: distance from the centre is the tilt, direction is where the board is farther away. */
function leanings(tilts: [number, number][], label: string): SVGElement {
  const rings = RINGS.flatMap((tilt) => [shape("circle", { r: tilt }), shape("text", { x: tilt * Math.SQRT1_2 + 1.5, y: tilt * Math.SQRT1_2 + 1.5 }, `${tilt}°`)]);
  const dots = tilts.map(([tilt, away]) => {
    const far = Math.min(degrees(tilt), EDGE);
    return shape("circle", { cx: far * Math.cos(away), cy: far * Math.sin(away), r: 3, class: "dot" });
  });
  const cross = shape("path", { d: `M${-EDGE} 0H${EDGE}M0 ${-EDGE}V${EDGE}` });
  return shape("svg", { viewBox: `${-EDGE - 3} ${-EDGE - 3} ${2 * EDGE + 6} ${2 * EDGE + 6}`, role: "img", "aria-label": label, class: "leanings" }, cross, ...rings, ...dots);
}
