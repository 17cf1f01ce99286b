// Pictures of the kinds of targets, on a square of 32 units: solid areas, lines, and faces in a lighter tint.
import { shape } from "./dom";

type Icon = { areas?: string; lines?: string; face?: string };

/** A circle as a path. */
const disc = (x: number, y: number, r: number) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0-${2 * r} 0`;
const box = (x: number, y: number, side: number) => `M${x} ${y}h${side}v${side}h-${side}z`;
const all = (places: number[], draw: (x: number, y: number) => string) => places.flatMap((y) => places.map((x) => draw(x, y))).join("");

/** Every second square, and the others. */
const squares = [4, 12, 20].flatMap((y, row) => [4, 12, 20].map((x, col) => ({ x, y, isDark: (row + col) % 2 === 0 })));
const dark = squares.filter(({ isDark }) => isDark).map(({ x, y }) => box(x, y, 8)).join("");
const marked = squares.filter(({ isDark }) => !isDark).map(({ x, y }) => box(x + 2, y + 2, 4)).join("");

/** Upright tiles of a deltille board with an edge of 9.3. */
const tiles = [0, 1, 2].flatMap((row) => Array.from({ length: 3 - row }, (_, i) => `M${2 + 4.65 * row + 9.3 * i} ${28 - 8.06 * row}h9.3l-4.65-8.06z`)).join("");

const ICONS: Record<string, Icon> = {
  deltille: { areas: tiles },
  checker: { areas: dark },
  charuco: { areas: dark + marked },
  aprilgrid: { areas: all([5, 18], (x, y) => `${box(x, y, 9)}M${x + 2.5} ${y + 2.5}v4h4v-4z`) + all([2, 14.5, 27], (x, y) => box(x, y, 3)) },
  circles: { areas: all([7, 16, 25], (x, y) => disc(x, y, 3)) },
  tetrahedron: { face: "M16 3 3 24l12 5z", lines: "M16 3 3 24l12 5 14-7zM16 3l-1 26" },
  octahedron: { face: "M16 2 4 17l9 3z", lines: "M16 2 4 17l12 13 12-13zM4 17l9 3 15-3M16 2l-3 18 3 10" },
  icosahedron: { face: "M16 9.5 24 22H8z", lines: "M16 2l12 7v14l-12 7-12-7V9zM16 9.5 24 22H8zM16 2v7.5M28 9l-12 .5L4 9l4 13-4 1 12 7-8-8M28 9l-4 13 4 1-12 7 8-8" },
  cube: { face: "M4 9l12 6v14L4 23z", lines: "M16 3l12 6v14l-12 6-12-6V9zM4 9l12 6 12-6M16 15v14" },
  cuboid: { face: "M2 13h19v12H2z", lines: "M2 13l8-6h20v12l-9 6H2zM2 13h19v12M21 13l9-6" },
  mesh: { face: "M5 11l11 6 3 12-14-5z", lines: "M5 11l9-8 12 5 3 12-10 9-14-5zM5 11l11 6 10-9M16 17l-11 7M16 17l3 12M16 17l13 3M14 3l2 14" },
};

/** The picture of a kind of target. */
export function icon(kind: string): SVGElement {
  const { areas, lines, face } = ICONS[kind] ?? {};
  const parts = [
    ...(face ? [shape("path", { d: face, class: "face" })] : []),
    ...(areas ? [shape("path", { d: areas, "fill-rule": "evenodd" })] : []),
    ...(lines ? [shape("path", { d: lines, class: "lines" })] : []),
  ];
  return shape("svg", { viewBox: "0 0 32 32", class: "icon", "aria-hidden": "true" }, ...parts);
}
