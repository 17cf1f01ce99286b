// Settings of a target, as an address and as templates of the command-line programs.
import { isPaper } from "./target-form";

export type Settings = {
  kind: string;
  rows: number;
  cols: number;
  edge_mm: number | null;
  marker_mm: number | null;
  legacy: boolean;
  gap: number | null;
  diameter_mm: number | null;
  asymmetric: boolean;
  size: string | null;
  family: string | null;
  /** The text of a family file that is not bundled. */
  family_file: string | null;
  tags_in: string;
  tag_spacing: number | null;
  tag_border: number | null;
  hole_mm: number | null;
  first_id: number;
  tag_ids: boolean;
  board_id: number;
  boards: number;
  inverted: boolean;
  two_sided_mm: number | null;
  tiles: number | null;
  face_margin_mm: number | null;
  skeleton: boolean;
  per_face: boolean;
  allow_seams: boolean;
  poster: boolean;
  packed: boolean;
  paper: string | null;
  pages: number | null;
  orientation: string;
  margin_mm: number | null;
  guide_page: boolean;
  note: string | null;
  /** The outline of a logo, as the library reads it from an SVG. */
  logo: string | null;
  logo_height_mm: number | null;
  mirrored: boolean;
  kerf_mm: number | null;
  name: string;
  /** The text of an OBJ file. */
  mesh: string | null;
};

export const usual: Settings = {
  kind: "deltille",
  rows: 10,
  cols: 11,
  edge_mm: null,
  marker_mm: null,
  legacy: false,
  gap: null,
  diameter_mm: null,
  asymmetric: false,
  size: null,
  family: null,
  family_file: null,
  tags_in: "black",
  tag_spacing: null,
  tag_border: null,
  hole_mm: null,
  first_id: 0,
  tag_ids: false,
  board_id: 0,
  boards: 1,
  inverted: false,
  two_sided_mm: null,
  tiles: null,
  face_margin_mm: null,
  skeleton: false,
  per_face: false,
  allow_seams: false,
  poster: false,
  packed: false,
  paper: null,
  pages: null,
  orientation: "auto",
  margin_mm: null,
  guide_page: false,
  note: null,
  logo: null,
  logo_height_mm: null,
  mirrored: false,
  kerf_mm: null,
  name: "board",
  mesh: null,
};

/** Rows and columns of kinds other than boards, which fit on A4. */
const SIZES: Record<string, { rows: number; cols: number }> = { charuco: { rows: 6, cols: 9 }, aprilgrid: { rows: 5, cols: 7 }, circles: { rows: 7, cols: 9 } };

const BOARDS = ["deltille", "checker"];
const GRIDS = ["charuco", "aprilgrid", "circles"];
const SOLIDS = ["tetrahedron", "octahedron", "icosahedron", "cube", "cuboid", "mesh"];
export const KINDS = [...BOARDS, ...GRIDS, ...SOLIDS];
const FLAT = [...BOARDS, ...GRIDS];
const TAGGED = KINDS.filter((kind) => kind !== "circles");

/** The kinds to which a setting applies; the others apply to all. */
const APPLIES: Partial<Record<keyof Settings, string[]>> = {
  rows: FLAT,
  cols: FLAT,
  edge_mm: KINDS.filter((kind) => kind !== "cuboid"),
  marker_mm: ["charuco"],
  legacy: ["charuco"],
  gap: ["aprilgrid"],
  diameter_mm: ["circles"],
  asymmetric: ["circles"],
  size: ["cuboid"],
  family: TAGGED,
  family_file: TAGGED,
  tags_in: ["checker"],
  tag_spacing: [...BOARDS, ...SOLIDS],
  tag_border: [...BOARDS, ...SOLIDS, "aprilgrid"],
  hole_mm: ["deltille", "tetrahedron", "octahedron", "icosahedron", "mesh"],
  first_id: TAGGED,
  tag_ids: [...BOARDS, ...SOLIDS],
  boards: BOARDS,
  inverted: [...BOARDS, ...SOLIDS],
  two_sided_mm: BOARDS,
  tiles: SOLIDS,
  face_margin_mm: SOLIDS,
  skeleton: SOLIDS,
  per_face: SOLIDS,
  allow_seams: SOLIDS,
  pages: SOLIDS,
  poster: BOARDS,
  packed: BOARDS,
  mirrored: FLAT,
  mesh: ["mesh"],
};
/** Settings that are too long for an address. */
const LONG = ["mesh", "logo", "family_file"] as const;

/** Allowed values of some settings. */
const CHOICES: Record<string, string[]> = {
  kind: KINDS,
  tags_in: ["black", "white"],
  orientation: ["auto", "portrait", "landscape"],
};
const NUMBERS = ["rows", "cols", "edge_mm", "marker_mm", "gap", "diameter_mm", "tag_spacing", "tag_border", "hole_mm", "first_id", "board_id", "boards", "two_sided_mm", "tiles", "face_margin_mm", "pages", "margin_mm", "logo_height_mm", "kerf_mm"];

/** The default tag family, and those of other kinds. */
export const DEFAULT_FAMILY = "delTag25h7";
const DEFAULT_FAMILIES: Record<string, string> = { checker: "", charuco: "DICT_5X5_100", aprilgrid: "aprilTag36h11", cube: "aprilTag36h11", cuboid: "aprilTag36h11" };

/** The family of position codes, one in every upright tile. */
export const PLACES = "dense9";

export const isBoard = ({ kind }: Settings): boolean => BOARDS.includes(kind);
export const isSolid = ({ kind }: Settings): boolean => SOLIDS.includes(kind);
export const hasSquareTags = ({ kind }: Settings): boolean => ["checker", "aprilgrid", "cube", "cuboid"].includes(kind);
export const applies = (key: keyof Settings, { kind }: Settings): boolean => APPLIES[key]?.includes(kind) ?? true;
export const usualFamily = (kind: string): string => DEFAULT_FAMILIES[kind] ?? DEFAULT_FAMILY;

/** Whether settings contain files, which an address or a template cannot contain. */
export const hasFiles = (settings: Settings): boolean => LONG.some((key) => settings[key] !== null && applies(key, settings));

/** The default name of a kind of target. */
export const nameOf = (kind: string): string => ({ deltille: "board", checker: "checkerboard", mesh: "solid" })[kind] ?? kind;

/** The default settings of a kind of target. */
export const usualOf = (kind: string): Settings => ({ ...usual, ...SIZES[kind], kind, name: nameOf(kind) });

/** Settings after a change of the kind: those that had their defaults get the new ones. */
export function ofKind(kind: string, settings: Settings): Settings {
  const [before, after] = [usualOf(settings.kind), usualOf(kind)];
  const isUsual = settings.rows === before.rows && settings.cols === before.cols;
  const { rows, cols } = isUsual ? after : settings;
  return { ...settings, kind, rows, cols, family: null, family_file: null, edge_mm: null, name: settings.name === before.name ? after.name : settings.name };
}

/** Settings that differ from the defaults, as a query; empty for a mesh, which is too long for an address. */
export function query(settings: Settings): string {
  if (settings.kind === "mesh") return "";
  const without: Settings = { ...usualOf(settings.kind), kind: usual.kind };
  const pairs = Object.entries(settings).filter(([key, value]) => value !== null && value !== without[key as keyof Settings] && !(LONG as readonly string[]).includes(key));
  return new URLSearchParams(pairs.map(([key, value]) => [key, String(value)])).toString();
}

/** Settings from named values; missing and invalid ones keep their defaults, and `ignored` names unknown and invalid ones. */
export function settled(values: Iterable<[string, string]>, ignored: string[] = []): Settings {
  const all = new Map(values);
  const kind = all.get("kind") ?? "";
  const found: Record<string, unknown> = { ...usualOf(isKind(kind) ? kind : usual.kind) };
  for (const [key, value] of all) {
    const isNumber = NUMBERS.includes(key);
    const isBoolean = typeof usual[key as keyof Settings] === "boolean";
    const choices = isBoolean ? ["true", "false"] : CHOICES[key];
    const isValid = Object.hasOwn(usual, key) && (isNumber ? value !== "" && Number.isFinite(Number(value)) : key === "paper" ? isPaper(value) : (choices?.includes(value) ?? true));
    if (!isValid) ignored.push(`${key}=${value}`);
    else found[key] = isNumber ? Number(value) : isBoolean ? value === "true" : value;
  }
  return found as Settings;
}

/** The settings of an address, and those that are ignored; an address cannot contain a mesh. */
export function read(text: string): { settings: Settings; ignored: string[] } {
  const ignored: string[] = [];
  const settings = settled(new URLSearchParams(text), ignored);
  return settings.kind === "mesh" ? { settings: usual, ignored: text.split("&") } : { settings, ignored };
}

export const isKind = (kind: unknown): boolean => KINDS.includes(String(kind));

/** The settings for the library, without those that do not apply to this kind of target. */
export function asked(settings: Settings): string {
  const own = Object.entries(settings).filter(([key]) => applies(key as keyof Settings, settings));
  return JSON.stringify(Object.fromEntries(own));
}

// Templates of the command-line programs: flat TOML, one setting per line.

const KEYS: [string, keyof Settings][] = [
  ["name", "name"],
  ["rows", "rows"],
  ["cols", "cols"],
  ["edge", "edge_mm"],
  ["family", "family"],
  ["tags", "family"],
  ["tags-in", "tags_in"],
  ["tag-spacing", "tag_spacing"],
  ["tag-border", "tag_border"],
  ["hole", "hole_mm"],
  ["first-id", "first_id"],
  ["tag-ids", "tag_ids"],
  ["board-id", "board_id"],
  ["boards", "boards"],
  ["invert", "inverted"],
  ["two-sided", "two_sided_mm"],
  ["poster", "poster"],
  ["pack", "packed"],
  ["paper", "paper"],
  ["pages", "pages"],
  ["orientation", "orientation"],
  ["margin", "margin_mm"],
  ["guide-page", "guide_page"],
  ["note", "note"],
  ["logo-height", "logo_height_mm"],
];
const OTHERS = ["command", "untagged", "dense", "pdf", "svg", "png", "dsc", "dsc-dialect", "dpi"];
const UNITS: Record<string, number> = { "": 1, mm: 1, cm: 10, m: 1000, in: 25.4 };

/** The settings of a template of `deltille board` or `deltille checkerboard`. */
export function ofTemplate(text: string): Settings {
  const values = new Map<string, string>();
  let table = "";
  for (const line of text.split("\n")) {
    const bare = line.replace(/^\s*#.*$/, "").trim();
    if (bare === "") continue;
    table = /^\[(\w+)\]/.exec(bare)?.[1] ?? table;
    // Meshes and laser drawings are additional files of the same target.
    if (table === "meshes" || table === "laser") continue;
    if (table !== "") throw new Error(`[${table}]: the page does not support this table; the deltille program can use this template`);
    const [, key = "", string, plain] = /^([\w-]+)\s*=\s*(?:"([^"]*)"|([\w.+-]+))\s*(?:#.*)?$/.exec(bare) ?? [];
    const known = KEYS.find(([name]) => name === key)?.[1];
    if (key === "logo") throw new Error(`logo: the page cannot read ${string ?? plain}; remove this line, and choose the logo in the form`);
    if (!known && !OTHERS.includes(key)) throw new Error(key === "" ? `${bare}: not a setting` : `${key}: unknown setting`);
    const value = string ?? plain ?? "";
    if (key === "command") values.set("kind", value === "checkerboard" ? "checker" : "deltille");
    else if (key === "untagged" && value === "true") values.set("family", "");
    else if (key === "dense" && value === "true") values.set("family", PLACES);
    else if (known?.endsWith("_mm")) {
      const [, number, unit = ""] = /^([\d.]+)\s*(mm|cm|m|in)?$/.exec(value) ?? [];
      if (number === undefined) throw new Error(`${key}: ${value} is not a valid length (for example 20mm)`);
      values.set(known, String(Number(number) * (UNITS[unit] ?? 1)));
    } else if (known) values.set(known, value);
  }
  const ignored: string[] = [];
  const found = settled(values, ignored);
  if (ignored.length > 0) throw new Error(`${ignored.join(", ")}: not valid for ${ignored.length > 1 ? "these settings" : "this setting"}; correct the file`);
  return found;
}

/** Returns a template of these settings for the command-line program. */
export function template(settings: Settings): string {
  const lines = [`command = "${settings.kind === "checker" ? "checkerboard" : "board"}"`];
  const done = new Set<string>();
  for (const [key, name] of KEYS) {
    const value = settings[name];
    if (done.has(name)) continue;
    done.add(name);
    if (name === "family" && value === "") lines.push("untagged = true");
    else if (value === null || (value === usual[name] && !["rows", "cols", "name"].includes(name))) continue;
    else if (name.endsWith("_mm")) lines.push(`${key} = "${value}mm"`);
    else lines.push(`${key} = ${typeof value === "string" ? JSON.stringify(value) : String(value)}`);
  }
  return `${lines.join("\n")}\n`;
}
