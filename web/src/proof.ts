// Verification: begins some time after a change, and ends with the next change.
import { el, settled } from "./dom";
import { LibraryError, proving } from "./library";
import { words } from "./words";

/** Time without a change after which verification begins, ms. */
const IDLE_MS = 1200;

/** Formats to verify, with their labels. */
export type Format = [string, string];

export type Proof = {
  /** What is known about the PDF, or about all formats. */
  state: HTMLElement;
  /** The line that `deltille verify` prints for each format. */
  lines: HTMLElement;
  /** Ends a running verification, and begins another one when the user is idle; without settings, none, and shows why there are no files. */
  restart: (settings: string | null, reason?: string) => void;
};

/** Verifies the formats that `wanted` returns. */
export function proof(wanted: () => Format[]): Proof {
  const state = el("p", { class: "state", "aria-live": "polite", title: words.make.provedBy });
  const lines = el("ul", { class: "lines" });
  /** Lines by format, and the settings that they belong to. */
  let known = new Map<string, { line: HTMLElement; files: number; hasFailed: boolean }>();
  let of: string | null = null;
  let isRunning = false;

  async function line(settings: string, [format, name]: Format): Promise<{ line: HTMLElement; files: number; hasFailed: boolean }> {
    try {
      const { passed, line, sentences, files } = await proving.call("prove", settings, format);
      const findings = sentences.map((sentence) => el("li", {}, sentence));
      return { line: el("li", { class: passed ? "passed" : "refused" }, line, findings.length > 0 ? el("ul", {}, ...findings) : ""), files, hasFailed: !passed };
    } catch (error) {
      // A message of the library says why this file does not exist. Without a message, the library crashed, and nothing is verified.
      const reason = error instanceof LibraryError ? error.message : "";
      return { line: el("li", { class: reason ? "plain" : "refused" }, `${name}: ${reason || words.failed}`), files: 0, hasFailed: !reason };
    }
  }

  const begin = settled(async () => {
    if (isRunning) return;
    isRunning = true;
    for (let next; of !== null && (next = wanted().find(([format]) => !known.has(format))); ) {
      const settings: string = of;
      state.className = "state busy";
      state.textContent = words.make.proving(known.size > 0);
      const found = await line(settings, next);
      if (settings !== of) continue;
      known.set(next[0], found);
      lines.replaceChildren(...wanted().flatMap(([format]) => known.get(format)?.line ?? []));
    }
    isRunning = false;
    if (of !== null) conclude();
  }, IDLE_MS);

  function conclude(): void {
    const all = [...known.values()];
    const files = all.reduce((sum, { files }) => sum + files, 0);
    const isProved = files > 0 && !all.some(({ hasFailed }) => hasFailed);
    state.className = `state ${isProved ? "good" : "bad"}`;
    state.textContent = isProved ? words.make.proved(files, wanted().length > 1) : words.make.notProved;
  }

  function restart(settings: string | null, reason = ""): void {
    if (settings === null || settings !== of) {
      if (isRunning) proving.cancel();
      known = new Map();
      lines.replaceChildren();
      state.className = `state ${reason ? "bad" : ""}`;
      state.textContent = reason;
      of = settings;
    }
    if (of !== null) begin();
  }

  return { state, lines, restart };
}
