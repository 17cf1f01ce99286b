// What a target is made from, and the address that carries it.
export type Settings = {
  kind: string;
  rows: number;
  cols: number;
  edge_mm: number | null;
  family: string | null;
  first_id: number;
  board_id: number;
  inverted: boolean;
  tiles: number | null;
  per_face: boolean;
  paper: string | null;
  name: string;
};

export const usual: Settings = {
  kind: "deltille",
  rows: 10,
  cols: 11,
  edge_mm: null,
  family: null,
  first_id: 0,
  board_id: 0,
  inverted: false,
  tiles: null,
  per_face: false,
  paper: null,
  name: "board",
};

export const isSolid = (settings: Settings): boolean => settings.kind !== "deltille" && settings.kind !== "checker";

/** Settings with other values than usual, as a query. */
export function query(settings: Settings): string {
  const pairs = Object.entries(settings).filter(([key, value]) => value !== usual[key as keyof Settings]);
  return new URLSearchParams(pairs.map(([key, value]) => [key, String(value)])).toString();
}

/** The settings of a query; what it does not say, or says wrongly, is as usual. */
export function read(text: string): Settings {
  const found: Record<string, unknown> = { ...usual };
  for (const [key, value] of new URLSearchParams(text)) {
    if (!(key in usual)) continue;
    const before = usual[key as keyof Settings];
    const isNumber = typeof before === "number" || key.endsWith("_mm") || key === "tiles";
    if (typeof before === "boolean") found[key] = value === "true";
    else if (isNumber) found[key] = Number.isFinite(Number(value)) ? Number(value) : before;
    else found[key] = value;
  }
  return found as Settings;
}

/** What the library takes: nothing that says nothing of this kind of target. */
export function asked(settings: Settings): string {
  const { rows, cols, board_id, inverted, tiles, per_face, ...both } = settings;
  const own = isSolid(settings) ? { tiles, board_id, per_face } : { rows, cols, board_id, inverted };
  return JSON.stringify({ ...both, ...own });
}
