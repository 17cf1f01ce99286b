// Settings of a target, as an address and as templates of the command-line programs.
export type Settings = {
  kind: string;
  rows: number;
  cols: number;
  edge_mm: number | null;
  family: string | null;
  tags_in: string;
  tag_spacing: number | null;
  tag_border: number | null;
  first_id: number;
  board_id: number;
  boards: number;
  inverted: boolean;
  tiles: number | null;
  face_margin_mm: number | null;
  skeleton: boolean;
  per_face: boolean;
  allow_seams: boolean;
  poster: boolean;
  packed: boolean;
  paper: string | null;
  orientation: string;
  margin_mm: number | null;
  name: string;
  /** The text of an OBJ file. */
  mesh: string | null;
};

export const usual: Settings = {
  kind: "deltille",
  rows: 10,
  cols: 11,
  edge_mm: null,
  family: null,
  tags_in: "black",
  tag_spacing: null,
  tag_border: null,
  first_id: 0,
  board_id: 0,
  boards: 1,
  inverted: false,
  tiles: null,
  face_margin_mm: null,
  skeleton: false,
  per_face: false,
  allow_seams: false,
  poster: false,
  packed: false,
  paper: null,
  orientation: "auto",
  margin_mm: null,
  name: "board",
  mesh: null,
};

const OF_BOARDS = ["rows", "cols", "tags_in", "boards", "poster", "packed"] as const;
const OF_SOLIDS = ["tiles", "face_margin_mm", "skeleton", "per_face", "allow_seams"] as const;
/** Allowed values of some settings. */
const CHOICES: Record<string, string[]> = {
  kind: ["deltille", "checker", "icosahedron", "octahedron", "tetrahedron", "mesh"],
  tags_in: ["black", "white"],
  orientation: ["auto", "portrait", "landscape"],
};
const NUMBERS = ["rows", "cols", "edge_mm", "tag_spacing", "tag_border", "first_id", "board_id", "boards", "tiles", "face_margin_mm", "margin_mm"];

/** The default tag family. */
export const DEFAULT_FAMILY = "delTag25h7";

/** The family of position codes, one in every upright tile. */
export const PLACES = "dense9";

export const isSolid = (settings: Settings): boolean => settings.kind !== "deltille" && settings.kind !== "checker";

/** The default name of a kind of target. */
export const nameOf = (kind: string): string => ({ deltille: "board", checker: "checkerboard", mesh: "solid" })[kind] ?? kind;

/** Settings that differ from the defaults, as a query; empty for a mesh, which is too long for an address. */
export function query(settings: Settings): string {
  if (settings.kind === "mesh") return "";
  const without: Settings = { ...usual, name: nameOf(settings.kind), mesh: settings.mesh };
  const pairs = Object.entries(settings).filter(([key, value]) => value !== without[key as keyof Settings]);
  return new URLSearchParams(pairs.map(([key, value]) => [key, String(value)])).toString();
}

/** Settings from named values; missing and invalid ones keep their defaults. */
export function settled(values: Iterable<[string, string]>): Settings {
  const found: Record<string, unknown> = { ...usual };
  const all = new Map(values);
  for (const [key, value] of all) {
    if (!(key in usual)) continue;
    const before = usual[key as keyof Settings];
    if (typeof before === "boolean") found[key] = value === "true";
    else if (NUMBERS.includes(key)) found[key] = value !== "" && Number.isFinite(Number(value)) ? Number(value) : before;
    else if (!CHOICES[key] || CHOICES[key].includes(value)) found[key] = value;
  }
  const settings = found as Settings;
  return all.has("name") ? settings : { ...settings, name: nameOf(settings.kind) };
}

/** The settings of an address, which cannot contain a mesh. */
export function read(text: string): Settings {
  const found = settled(new URLSearchParams(text));
  return found.kind === "mesh" ? usual : found;
}

export const isKind = (kind: unknown): boolean => CHOICES.kind?.includes(String(kind)) ?? false;

/** The settings for the library, without those that do not apply to this kind of target. */
export function asked(settings: Settings): string {
  const own: Partial<Settings> = { ...settings };
  for (const key of isSolid(settings) ? OF_BOARDS : OF_SOLIDS) delete own[key];
  if (settings.kind !== "mesh") delete own.mesh;
  return JSON.stringify(own);
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
  ["first-id", "first_id"],
  ["board-id", "board_id"],
  ["boards", "boards"],
  ["invert", "inverted"],
  ["poster", "poster"],
  ["pack", "packed"],
  ["paper", "paper"],
  ["orientation", "orientation"],
  ["margin", "margin_mm"],
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
    if (table !== "") throw new Error(`[${table}]: the page does not support this table; use the template with the command-line program`);
    const [, key = "", string, plain] = /^([\w-]+)\s*=\s*(?:"([^"]*)"|([\w.+-]+))\s*(?:#.*)?$/.exec(bare) ?? [];
    const known = KEYS.find(([name]) => name === key)?.[1];
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
  return settled(values);
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
