// The worker: runs calls of the page in the WebAssembly modules.
import type * as Make from "../pkg/make/deltille.js";
import makeCode from "../pkg/make/deltille_bg.wasm?url";
import type * as Photo from "../pkg/photo/deltille.js";
import photoCode from "../pkg/photo/deltille_bg.wasm?url";
import type * as Prove from "../pkg/prove/deltille.js";
import proveCode from "../pkg/prove/deltille_bg.wasm?url";
import type * as See from "../pkg/see/deltille.js";
import seeCode from "../pkg/see/deltille_bg.wasm?url";
import type * as Solve from "../pkg/solve/deltille.js";
import solveCode from "../pkg/solve/deltille_bg.wasm?url";
import { dictionaryTable, familyFile, familyNames } from "./families-files";

type Module<T> = T & { default: (options: { module_or_path: URL }) => Promise<unknown> };

/** A module loaded on first use. */
function once<T>(code: string, load: () => Promise<unknown>): () => Promise<T> {
  let loading: Promise<T> | null = null;
  const begin = async () => {
    const module = (await load()) as Module<T>;
    await module.default({ module_or_path: new URL(code, import.meta.url) });
    return module as T;
  };
  return () => {
    loading ??= begin();
    // Retry after a failed load.
    loading.catch(() => (loading = null));
    return loading;
  };
}

const maker = once<typeof Make>(makeCode, () => import("../pkg/make/deltille.js"));
const prover = once<typeof Prove>(proveCode, () => import("../pkg/prove/deltille.js"));
const photographer = once<typeof Photo>(photoCode, () => import("../pkg/photo/deltille.js"));
const seer = once<typeof See>(seeCode, () => import("../pkg/see/deltille.js"));
const solver = once<typeof Solve>(solveCode, () => import("../pkg/solve/deltille.js"));

export type Reach = { corners: number; tags: number; ids_left: number; detail_mm: number; needed_px: number; size_mm: number };
export type Hinge = { face: number; on: number | null; ends_mm: [number, number, number][]; angle_rad: number };
/** The paper of a target; without a name if it has another size. */
export type Sheets = { paper: string | null; size_mm: [number, number]; pages: number; edge_mm: number | null };
export type Pages = { pages: string[]; json: string; reach: Reach; sheets: Sheets | null; family: string | null };
export type File = { name: string; bytes: Uint8Array };
export type Solid = { glb: Uint8Array; hinges: Hinge[] };
export type Proof = { passed: boolean; line: string; sentences: string[]; files: number };
export type Seen = { json: string; csv: string; orpc: string; reasons: string[]; ms: number };
export type Shown = Seen & { width: number; height: number; grey: Uint8Array };
/** How the board is held, compared with the proposed pose. */
export type HoldStatus = { held: "unseen" | "elsewhere" | "turned" | "moving" | "blurred" | "steady" | "taken"; part: number };
/** The next proposed image, and the projection uncertainty. */
export type Next = { description: string; sufficient: boolean; uncertainty_px: number | null; expected_px: number | null; outlines_px: [number, number][][]; up_px: [[number, number], [number, number]] | null };
/** Image coverage: corners per cell, and for each image the tilt of the board and its direction, rad. */
export type Survey = { size_px: [number, number]; cells: [number, number]; counts: number[]; covered: number; tilts: ([number, number] | null)[] };
export type Watched = Seen & { keep: boolean; held: HoldStatus | null; pixels: Uint8ClampedArray };
export type Recognised = { target: string; spec: Record<string, unknown>; tags: number; corners: number; shown: number };
export type FamilyFacts = { name: string; kind: string; bits: number; distance: number; codes: number };
export type FamilyFigures = {
  name: string;
  bits: number;
  codes: number;
  distance: number;
  correctable: number;
  kind: string;
  histogram: Record<string, number>;
  /** Upper bounds on the number of codes. */
  linear_programming: number;
  sphere_packing: number;
  /** Rotation steps per full turn, and for each cell the cell whose content it receives in one step. */
  turns: number;
  rotation: number[];
};
/** False-positive rates with 0, 1, … cells corrected; null in natural images if unknown. */
export type FalsePositives = { coins: number[]; natural: number[] | null; accepted: number; recommended: number | null };
export type Figures = {
  rms_px: number;
  views: number;
  corners: number;
  names: string[];
  values: number[];
  sd: (number | null)[];
  projection_sd_px: number | null;
  /** Whether it comes from the scatter between views, not only from the noise of the corners. */
  is_observed: boolean;
};
/** `others` are the camera in formats of other programs. */
export type Result = { figures: Figures; said: string[]; files: TextFile[]; others: TextFile[] };
export type TextFile = { name: string; text: string };

/** Ink spread of a print, estimated from several images: for the library, and in words. */
export type Ink = { estimate: string; words: string };

/** The target to find: the description of one, with its family file if that is not bundled, or an untagged board. */
export type Sought = { target: string; family?: string | null } | { grid: string };

/** An object in the memory of a module, to be freed after use. */
type Held = { free(): void };

async function using<T extends Held, R>(made: T, work: (made: T) => R | Promise<R>): Promise<R> {
  try {
    return await work(made);
  } finally {
    made.free();
  }
}

let finder: { key: string; made: See.Finder } | null = null;
const codes = new Map<string, Promise<Make.Codes>>();
let recogniser: See.Recogniser | null = null;
let watcher: See.Watcher | null = null;
let guide: Solve.Guide | null = null;

async function finderOf(sought: Sought, ink: Ink | null = null): Promise<See.Finder> {
  const { Finder, family_of } = await seer();
  const key = JSON.stringify([sought, ink]);
  if (finder?.key === key) return finder.made;
  let made: See.Finder;
  if ("grid" in sought) made = Finder.of_grid(sought.grid, 0, 0);
  else {
    const name = family_of(sought.target);
    const file = sought.family ?? (name === undefined ? undefined : await fileOf(name));
    if (name !== undefined && file === undefined) throw new Error(`the target uses tag family ${name}, which is not bundled with this page`);
    made = Finder.of_target(sought.target, file);
  }
  if (ink) made = made.with_ink(ink.estimate);
  finder?.made.free();
  finder = { key, made };
  return made;
}

/** The codes of a family, cached as they are small. */
function codesOf(name: string): Promise<Make.Codes> {
  const known = codes.get(name);
  if (known) return known;
  const made = maker().then(async ({ Codes }) => new Codes((await fileOf(name)) ?? ""));
  codes.set(name, made);
  made.catch(() => codes.delete(name));
  return made;
}

async function pictureOf(photograph: Photo.Photograph): Promise<See.Picture> {
  const { Picture } = await seer();
  const [width = 0, height = 0] = photograph.size();
  return Picture.of_grey(width, height, photograph.is_deep(), photograph.grey(), photograph.orientation());
}

/** Detects in an image by `find`; returns the results and the time taken. */
function detect(find: () => See.Found, also: (found: See.Found) => void = () => undefined): Seen {
  const begin = performance.now();
  const found = find();
  const ms = performance.now() - begin;
  try {
    also(found);
    return { json: found.json(), csv: found.csv(), orpc: found.orpc(), reasons: found.reasons(), ms };
  } finally {
    found.free();
  }
}

/** The text of a family file; undefined if no family of that name is bundled. */
async function fileOf(name: string): Promise<string | undefined> {
  const table = await dictionaryTable(name);
  return table === undefined ? familyFile(name) : (await maker()).dictionary_file(name, table);
}

/** A target, the name of its family unless the settings contain the file, and that file. */
async function madeOf(settings: string): Promise<{ made: Make.Made; family: string | undefined; file: string | undefined }> {
  const { Made, family_of_settings } = await maker();
  const family = family_of_settings(settings);
  const file = family === undefined ? ((JSON.parse(settings) as { family_file?: string | null }).family_file ?? undefined) : await fileOf(family);
  if (family !== undefined && file === undefined) throw new Error(`“${family}” is not a tag family of this page: choose another, or drop its family file (.json)`);
  return { made: new Made(settings, file), family, file };
}

/** Formats that the large module `prove` writes. */
const LARGE = ["png", "gltf", "obj", "3mf", "stl", "skeleton"];

/** The files of a target in a format. */
async function filesOf(made: Make.Made, family: string | undefined, format: string): Promise<File[]> {
  return inFiles(LARGE.includes(format) ? (await prover()).files(made.json(), family, format, 300) : made.files(format));
}

function inFiles(made: unknown[]): File[] {
  const files: File[] = [];
  for (let i = 0; i + 1 < made.length; i += 2) files.push({ name: made[i] as string, bytes: made[i + 1] as Uint8Array });
  return files;
}

const calls = {
  async version(): Promise<string> {
    return (await maker()).version();
  },
  async families(): Promise<FamilyFacts[]> {
    return JSON.parse((await maker()).families()) as FamilyFacts[];
  },
  async dictionaries(): Promise<string[]> {
    return (await maker()).dictionaries();
  },
  /** The outline of a logo. */
  async logo(svg: string): Promise<string> {
    return (await prover()).logo_of_svg(svg);
  },
  async draw(settings: string): Promise<Pages> {
    const { made, family } = await madeOf(settings);
    return using(made, (made) => {
      const text = new TextDecoder();
      const pages = inFiles(made.files("svg")).map(({ bytes }) => text.decode(bytes));
      const sheets = JSON.parse(made.sheets() ?? "null") as Sheets | null;
      return { pages, json: made.json(), reach: JSON.parse(made.reach()) as Reach, sheets, family: family ?? null };
    });
  },
  /** The number of A4 pages on which the target fits; null if it does not. */
  async pagesOnA4(settings: string): Promise<number | null> {
    return using((await madeOf(settings)).made, (made) => made.pages_on_a4() ?? null);
  },
  async distances(settings: string, fieldOfView: number, width: number): Promise<[number, number] | null> {
    return using((await madeOf(settings)).made, (made) => {
      const found = made.distances_mm(fieldOfView, width);
      return found ? [found[0] ?? 0, found[1] ?? 0] : null;
    });
  },
  async files(settings: string, format: string): Promise<File[]> {
    const { made, file } = await madeOf(settings);
    return using(made, (made) => filesOf(made, file, format));
  },
  async solid(settings: string): Promise<Solid> {
    const { made, file } = await madeOf(settings);
    return using(made, async (made) => ({
      glb: (await filesOf(made, file, "gltf"))[0]?.bytes ?? new Uint8Array(),
      hinges: JSON.parse(made.hinges()) as Hinge[],
    }));
  },
  async prove(settings: string, format: string): Promise<Proof> {
    const { made, file } = await madeOf(settings);
    const { prove } = await prover();
    return using(made, async (made) => {
      const files = await filesOf(made, file, format);
      const proof = JSON.parse(prove(made.json(), file, files.map(({ name }) => name), files.map(({ bytes }) => bytes))) as Omit<Proof, "files">;
      return { ...proof, files: files.length };
    });
  },
  async photograph(sought: Sought, ink: Ink | null, name: string, bytes: Uint8Array): Promise<Shown> {
    const [{ Photograph }, finder] = await Promise.all([photographer(), finderOf(sought, ink)]);
    return using(new Photograph(name, bytes), async (photograph) => {
      const [width = 0, height = 0] = photograph.size();
      const seen = await using(await pictureOf(photograph), (picture) => detect(() => finder.find(picture, name)));
      // One byte per pixel, as all photographs are kept in memory.
      const colours = photograph.shown();
      const grey = new Uint8Array(width * height);
      for (let i = 0; i < grey.length; i++) grey[i] = colours[4 * i] ?? 0;
      return { ...seen, width, height, grey };
    });
  },
  /** Estimates the ink spread from all photographs of a print; null if detecting again would change nothing. */
  async ink(sought: Sought, found: unknown[]): Promise<Ink | null> {
    const [estimate, words] = (await finderOf(sought)).ink_of_all(JSON.stringify(found)) ?? [];
    return estimate !== undefined && words !== undefined ? { estimate, words } : null;
  },
  async recognise(name: string, bytes: Uint8Array): Promise<Recognised | null> {
    const [{ Photograph }, { Recogniser }] = await Promise.all([photographer(), seer()]);
    if (!recogniser) {
      const files = await Promise.all(familyNames().map((family) => familyFile(family)));
      recogniser = new Recogniser(files.filter((file) => file !== undefined));
    }
    const known = recogniser;
    return using(new Photograph(name, bytes), async (photograph) =>
      using(await pictureOf(photograph), (picture) => {
        const found = known.recognise(picture);
        return found === undefined ? null : (JSON.parse(found) as Recognised);
      }),
    );
  },
  /** Throws if the description is invalid. */
  async know(sought: Sought): Promise<void> {
    await finderOf(sought);
  },
  async overlay(name: string, bytes: Uint8Array, found: string): Promise<Uint8Array> {
    const { Photograph } = await photographer();
    return using(new Photograph(name, bytes), (photograph) => photograph.overlay(found));
  },
  /** Starts a webcam session. */
  async watch(): Promise<void> {
    const { Watcher } = await seer();
    watcher?.free();
    watcher = new Watcher();
    guide?.free();
    guide = null;
  },
  /** Starts proposing images, taking those already captured into account. */
  async guide(target: string, width: number, height: number, model: string, taken: { name: string; json: string }[]): Promise<Next> {
    const { Guide } = await solver();
    guide?.free();
    guide = new Guide(target, width, height, model);
    for (const { name, json } of taken) guide.take(name, json);
    return JSON.parse(guide.next()) as Next;
  },
  /** Skips the proposed pose. */
  async refuse(): Promise<Next | null> {
    guide?.refuse();
    return guide ? (JSON.parse(guide.next()) as Next) : null;
  },
  /** Adds a captured frame and returns the next proposal. */
  async take(name: string, json: string): Promise<Next | null> {
    guide?.take(name, json);
    return guide ? (JSON.parse(guide.next()) as Next) : null;
  },
  async frame(sought: Sought, name: string, width: number, height: number, pixels: Uint8ClampedArray, time: number): Promise<Watched> {
    const [{ Picture }, finder] = await Promise.all([seer(), finderOf(sought)]);
    const rgba = new Uint8Array(pixels.buffer, pixels.byteOffset, pixels.byteLength);
    return using(Picture.of_colours(width, height, rgba), (picture) => {
      let keep = false;
      const follow = () => finder.follow(picture, name);
      const seen = detect(follow, (found) => (keep = watcher?.observe(found) ?? false));
      const held = guide ? (JSON.parse(guide.observe(time, seen.json)) as HoldStatus) : null;
      return { ...seen, keep, held, pixels };
    });
  },
  async survey(target: string, detections: string[], names: string[], model: string): Promise<Survey | null> {
    const { survey } = await solver();
    const found = survey(target, detections, names, model);
    return found === undefined ? null : (JSON.parse(found) as Survey);
  },
  async calibrate(target: string, detections: string[], names: string[], model: string, printScale: [number, number] | null): Promise<Result> {
    const { Solved } = await solver();
    return using(new Solved(target, detections, names, model, printScale && Float64Array.from(printScale)), (solved) => {
      const formats = solved.formats();
      const [camera, ...others] = formats.flatMap((end, i) => (i % 2 === 0 ? [{ name: `camera${end}`, text: formats[i + 1] ?? "" }] : []));
      const files = [{ name: "camera.json", text: solved.json() }, ...(camera ? [camera] : []), { name: "camera-report.html", text: solved.page() }];
      return { figures: JSON.parse(solved.figures()) as Figures, said: solved.said(), files, others };
    });
  },
  async family(name: string): Promise<{ figures: FamilyFigures; cells: string; codes: bigint[] }> {
    const codes = await codesOf(name);
    return { figures: JSON.parse(codes.figures()) as FamilyFigures, cells: codes.cells(1.5), codes: [...codes.codes()] };
  },
  async decode(name: string, word: bigint, errors: number): Promise<number[] | null> {
    const found = (await codesOf(name)).decode(word, errors);
    return found ? [...found] : null;
  },
  /** The word of a tag after one rotation step. */
  async turned(name: string, word: bigint): Promise<bigint> {
    return (await codesOf(name)).turned(word);
  },
  /** The fractions of tags read and misread at each of these rates of wrong cells. */
  async reading(name: string, rates: number[]): Promise<[number, number][]> {
    const shares = (await codesOf(name)).reading(Float64Array.from(rates));
    return rates.map((_, i) => [shares[2 * i] ?? 0, shares[2 * i + 1] ?? 0]);
  },
  async falsePositives(name: string): Promise<FalsePositives> {
    return JSON.parse((await codesOf(name)).false_positives()) as FalsePositives;
  },
};

export type Calls = typeof calls;
export type Name = keyof Calls;

/** Buffers that are transferred to the page instead of copied. */
function handedOver(result: unknown): Transferable[] {
  if (typeof result !== "object" || result === null) return [];
  return Object.values(result).flatMap((value) => (ArrayBuffer.isView(value) && value.buffer instanceof ArrayBuffer ? [value.buffer] : []));
}

self.onmessage = async ({ data }: MessageEvent<{ id: number; name: Name; given: unknown[] }>) => {
  const { id, name, given } = data;
  try {
    const work = calls[name] as (...given: unknown[]) => Promise<unknown>;
    const result = await work(...given);
    self.postMessage({ id, result }, { transfer: handedOver(result) });
  } catch (error) {
    const broken = error instanceof WebAssembly.RuntimeError;
    self.postMessage({ id, error: broken ? "" : error instanceof Error ? error.message : String(error), broken });
  }
};
