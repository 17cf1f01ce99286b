// State shared by the parts of the page.
import type { Sought } from "./worker";

/** The target of “Make”, and whether “Detect” should search for it. */
export const made: { json: string; name: string; family: string | null; isWanted: boolean } = { json: "", name: "", family: null, isWanted: false };

/** A processed photograph. */
export type Shot = { name: string; json: string; corners: number; labelled: boolean };

/**
 * The target searched for, the default edge that it has until one is entered, the message about an invalid edge, the processed
 * photographs, and the end of all detection requested so far.
 */
export const seen: { sought: Sought | null; assumedEdge: number | null; measuredEdge: boolean; wrongEdge: string; shots: Shot[]; done: Promise<unknown> } = { sought: null, assumedEdge: null, measuredEdge: false, wrongEdge: "", shots: [], done: Promise.resolve() };

/** The name of a file without its extension, used as the name of its view. */
export const stem = (name: string) => name.replace(/\.[^.]*$/, "");
