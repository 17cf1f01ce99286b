// What the parts of the page know of each other.
import type { Sought } from "./worker";

/** The target of “Make”, and whether it is what photographs are to be looked at for. */
export const made = { json: "", name: "", isWanted: false };

/** A photograph that was looked at. */
export type Shot = { name: string; json: string; corners: number; labelled: boolean };

/** What was seen, and in what. */
export const seen: { sought: Sought | null; shots: Shot[] } = { sought: null, shots: [] };

/** The name of a file without its ending: what it shows is called so. */
export const stem = (name: string) => name.replace(/\.[^.]*$/, "");
