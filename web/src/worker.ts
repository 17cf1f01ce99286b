// The worker's side: calls of the page to the WebAssembly modules.
import type * as Make from "../pkg/make/deltille.js";
import type * as See from "../pkg/see/deltille.js";
import type * as Solve from "../pkg/solve/deltille.js";

type Module<T> = T & { default: (options?: unknown) => Promise<unknown> };

let make: Promise<typeof Make> | null = null;
let see: Promise<typeof See> | null = null;
let solve: Promise<typeof Solve> | null = null;

async function started<T>(loading: Promise<Module<T>>): Promise<T> {
  const module = await loading;
  await module.default();
  return module;
}

const maker = () => (make ??= started(import("../pkg/make/deltille.js") as Promise<Module<typeof Make>>));
const solver = () => (solve ??= started(import("../pkg/solve/deltille.js") as Promise<Module<typeof Solve>>));
const seer = () => (see ??= started(import("../pkg/see/deltille.js") as Promise<Module<typeof See>>));

export type Pages = { pages: string[]; json: string; corners: number; tags: number; codes: number; sizes: number[] };
export type File = { name: string; bytes: Uint8Array };
export type Proof = { passed: boolean; summary: string; sentences: string[] };
export type Seen = { json: string; reasons: string; ms: number; width: number; height: number; grey: Uint8ClampedArray };
export type Figures = {
  rms_px: number;
  views: number;
  corners: number;
  names: string[];
  values: number[];
  sd: (number | null)[];
  projection_sd_px: number | null;
};
export type Result = { figures: Figures; said: string[]; files: { name: string; text: string }[] };

let finder: { key: string; made: See.Finder } | null = null;

/** What is looked for: the description of a target, or an untagged board. */
export type Sought = { target: string } | { grid: string };

async function finderOf(sought: Sought): Promise<See.Finder> {
  const { Finder } = await seer();
  const key = JSON.stringify(sought);
  if (finder?.key !== key) {
    finder?.made.free();
    finder = null;
    finder = { key, made: "target" in sought ? Finder.of_target(sought.target) : Finder.of_grid(sought.grid, 0, 0) };
  }
  return finder.made;
}

function seen(found: See.Found, ms: number, withPixels: boolean): Seen {
  const [width = 0, height = 0] = found.size();
  const grey = withPixels ? new Uint8ClampedArray(found.part(0, 0, width, height)) : new Uint8ClampedArray();
  const result = { json: found.json(), reasons: found.reasons(), ms, width, height, grey };
  found.free();
  return result;
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
  async draw(settings: string): Promise<Pages> {
    const { Made } = await maker();
    const made = new Made(settings);
    try {
      const text = new TextDecoder();
      const pages = inFiles(made.files("svg", 300)).map(({ bytes }) => text.decode(bytes));
      const [tags = 0, codes = 0] = made.tag_counts();
      return { pages, json: made.json(), corners: made.corner_count(), tags, codes, sizes: [...made.sizes_mm()] };
    } finally {
      made.free();
    }
  },
  async files(settings: string, format: string): Promise<File[]> {
    const { Made } = await maker();
    const made = new Made(settings);
    try {
      return inFiles(made.files(format, 300));
    } finally {
      made.free();
    }
  },
  async prove(settings: string, format: string): Promise<Proof> {
    const { Made } = await maker();
    const made = new Made(settings);
    try {
      const files = inFiles(made.files(format, 300));
      return JSON.parse(made.prove(files.map(({ name }) => name), files.map(({ bytes }) => bytes))) as Proof;
    } finally {
      made.free();
    }
  },
  async photograph(sought: Sought, name: string, bytes: Uint8Array): Promise<Seen> {
    const finder = await finderOf(sought);
    const begin = performance.now();
    const found = finder.photograph(name, bytes);
    return seen(found, performance.now() - begin, true);
  },
  async frame(sought: Sought, name: string, width: number, height: number, rgba: Uint8ClampedArray): Promise<Seen> {
    const finder = await finderOf(sought);
    const begin = performance.now();
    const found = finder.pixels(name, width, height, new Uint8Array(rgba.buffer, rgba.byteOffset, rgba.byteLength));
    return seen(found, performance.now() - begin, false);
  },
  async export(sought: Sought, name: string, bytes: Uint8Array, format: "json" | "csv" | "orpc"): Promise<string> {
    const found = (await finderOf(sought)).photograph(name, bytes);
    try {
      return found[format]();
    } finally {
      found.free();
    }
  },
  async calibrate(target: string, detections: string[], names: string[], model: string): Promise<Result> {
    const { Solved } = await solver();
    const solved = new Solved(target, detections, names, model);
    try {
      const files = [
        { name: "camera.json", text: solved.json() },
        { name: "camera.yaml", text: solved.yaml() },
        { name: "camera.html", text: solved.page() },
      ];
      const opencv = solved.opencv();
      if (opencv !== undefined) files.push({ name: "camera.opencv.yaml", text: opencv });
      const ros = solved.ros();
      if (ros !== undefined) files.push({ name: "camera.ros.yaml", text: ros });
      return { figures: JSON.parse(solved.figures()) as Figures, said: solved.said(), files };
    } finally {
      solved.free();
    }
  },
  async families(): Promise<string[]> {
    return (await seer()).families();
  },
  async family(name: string): Promise<{ figures: string; cells: string; codes: bigint[] }> {
    const { Codes } = await seer();
    const codes = new Codes(name);
    const figures = codes.figures();
    const count = (JSON.parse(figures) as { codes: number }).codes;
    const all = Array.from({ length: count }, (_, id) => codes.code(id) ?? 0n);
    const result = { figures, cells: codes.cells(1.5), codes: all };
    codes.free();
    return result;
  },
  async decode(name: string, word: bigint, errors: number): Promise<number[] | null> {
    const { Codes } = await seer();
    const codes = new Codes(name);
    const found = codes.decode(word, errors);
    codes.free();
    return found ? [...found] : null;
  },
};

export type Calls = typeof calls;
export type Name = keyof Calls;

self.onmessage = async ({ data }: MessageEvent<{ id: number; name: Name; given: unknown[] }>) => {
  const { id, name, given } = data;
  try {
    const work = calls[name] as (...given: unknown[]) => Promise<unknown>;
    self.postMessage({ id, result: await work(...given) });
  } catch (error) {
    const broken = error instanceof WebAssembly.RuntimeError;
    self.postMessage({ id, error: broken ? "" : error instanceof Error ? error.message : String(error), broken });
  }
};
