// Drawings of empty parts of the page: what belongs there.
import { shape } from "./dom";

/** Triangular tiles of a board of `rows` rows, in its plane. */
function tiles(rows: number, cols: number): string {
  const parts: string[] = [];
  for (let row = 0; row < rows; row++) {
    for (let col = 0; col < cols; col++) {
      const x = col + (row % 2) / 2;
      parts.push(`M${x} ${row + 1}h1L${x + 0.5} ${row}z`);
    }
  }
  return parts.join("");
}

/** A board, moved and tilted by an affine map. */
const board = (matrix: string, className: string) =>
  shape(
    "g",
    { transform: `matrix(${matrix})`, class: className },
    shape("path", { d: "M-.6-.5H6.1V4.5H-.6z", class: "leaf" }),
    shape("path", { d: tiles(4, 5), class: "tiles" }),
  );

const picture = (...parts: SVGElement[]) => shape("svg", { viewBox: "0 0 240 130", class: "picture", "aria-hidden": "true" }, ...parts);

/** A photograph of a board with its corners marked. */
export function photographPicture(): SVGElement {
  const matrix = [15, 2.4, -3.4, 15.5, 80, 24];
  const corners = [0, 1, 2, 3].flatMap((row) => Array.from({ length: 5 }, (_, col): [number, number] => [col + 0.5 + (row % 2) / 2, row]));
  const [a = 0, b = 0, c = 0, d = 0, e = 0, f = 0] = matrix;
  const marks = corners.map(([x, y]) => shape("circle", { cx: a * x + c * y + e, cy: b * x + d * y + f, r: 2.6, class: "mark" }));
  return picture(shape("rect", { x: 40, y: 6, width: 160, height: 118, rx: 4, class: "frame-line" }), board(matrix.join(" "), ""), ...marks, shape("path", { d: "M40 24V6h18M182 6h18v18M200 106v18h-18M58 124H40v-18", class: "brackets" }));
}

/** A board in several poses before a camera. */
export function posesPicture(): SVGElement {
  const camera = shape("path", { d: "M108 116h24v12h-24zM114 116v-4h12v4M120 119a3 3 0 1 0 .01 0z", class: "brackets" });
  return picture(shape("path", { d: "M120 112 12 38M120 112 228 38", class: "rays" }), board("9 3 -1 9 14 26", "far"), board("9 -3 1 9 174 44", "far"), board("11 0 0 11 90 18", ""), camera);
}
