// Elements created in one expression.
import { words } from "./words";

type Attributes = Record<string, string | number | boolean | ((event: Event) => void) | undefined>;
type Child = Node | string | null | undefined;

export function el<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    if (typeof value === "function") made.addEventListener(name, value);
    else if (name === "value" && "value" in made) (made as HTMLInputElement).value = String(value);
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.filter((child): child is Node | string => child !== null && child !== undefined));
  return made;
}

const SVG = "http://www.w3.org/2000/svg";

/** Creates an SVG element. */
export function shape(tag: string, attributes: Record<string, string | number>, ...children: (Node | string)[]): SVGElement {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

let count = 0;

/** A labelled control. */
export function field(label: string, control: HTMLElement, hint?: string): HTMLElement {
  control.id ||= `field-${++count}`;
  const below = hint ? el("small", { id: `${control.id}-hint` }, hint) : null;
  if (below) control.setAttribute("aria-describedby", below.id);
  return el("div", { class: "field" }, el("label", { for: control.id }, label), control, below);
}

/** The message about an invalid value: the title of a text, or the range of a number. The library's own message would not name the form field. */
export function mistaken(controls: Iterable<HTMLInputElement>): string | undefined {
  const wrong = [...controls].find((control) => !control.validity.valid);
  // The labels of a control are not known before it is part of the page.
  return wrong && words.mistaken(wrong.closest(".field")?.querySelector("label")?.textContent ?? "", wrong.title || words.range(Number(wrong.min), Number(wrong.max), wrong.step !== "any"));
}

export function select(options: [string, string][], value: string, changed: (value: string) => void): HTMLSelectElement {
  const made = el("select", { change: () => changed(made.value) }, ...options.map(([key, text]) => el("option", { value: key }, text)));
  made.value = value;
  return made;
}

/** A drop area for files. A drop anywhere on the page counts, as nothing else takes files. */
export function dropZone(take: (files: File[]) => void, ...children: Child[]): HTMLElement {
  const zone = el("div", { class: "drop" }, ...children);
  const over = (isOver: boolean) => () => zone.classList.toggle("over", isOver);
  window.addEventListener("dragover", over(true));
  window.addEventListener("dragleave", over(false));
  window.addEventListener("drop", ({ dataTransfer }) => {
    over(false)();
    if (zone.isConnected && dataTransfer) void filesOf(dataTransfer).then(take);
  });
  return zone;
}

/** The dropped files, with folders replaced by the files in them. */
async function filesOf({ items }: DataTransfer): Promise<File[]> {
  // Read synchronously: the browser clears the items after the event.
  const all = [...items].map((item) => ({ file: item.getAsFile(), entry: item.webkitGetAsEntry() }));
  const files = await Promise.all(all.map(({ file, entry }) => (entry?.isDirectory ? within(entry).catch(() => (file ? [file] : [])) : file ? [file] : [])));
  return files.flat();
}

async function within(entry: FileSystemEntry): Promise<File[]> {
  // Skip hidden files of the operating system.
  if (entry.name.startsWith(".")) return [];
  if (entry.isFile) return [await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject))];
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const all: FileSystemEntry[] = [];
  // `readEntries` returns a batch at a time, and an empty one at the end.
  for (let part; (part = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject))).length > 0; ) all.push(...part);
  all.sort((one, other) => (one.name < other.name ? -1 : 1));
  return (await Promise.all(all.map(within))).flat();
}

/** Offers a file for download. */
export function save(name: string, content: BlobPart, type = "application/octet-stream"): void {
  const url = URL.createObjectURL(new Blob([content], { type }));
  const link = el("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Runs slow work one call at a time. Calls made meanwhile are merged into one run at the end. */
export function latest(work: (isStale: () => boolean) => Promise<void>): () => Promise<void> {
  let isBusy = false;
  let isAsked = false;
  return async () => {
    isAsked = true;
    if (isBusy) return;
    isBusy = true;
    while (isAsked) {
      isAsked = false;
      await work(() => isAsked);
    }
    isBusy = false;
  };
}

/** Debounces: runs the last call after `ms` without another one. */
export function settled<A extends unknown[]>(work: (...given: A) => void, ms: number): (...given: A) => void {
  let timer = 0;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => work(...given), ms) as unknown as number;
  };
}
