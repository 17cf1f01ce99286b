// The library, in workers, so that the page never waits. Modules are loaded when they are first asked for.
import type { Calls, Name } from "./worker";

type Waiting = { resolve: (value: unknown) => void; reject: (error: Error) => void };

/** A message of the library, which is one sentence to show. */
export class LibraryError extends Error {}

class Door {
  private worker: Worker | null = null;
  private waiting = new Map<number, Waiting>();
  private next = 0;

  call<N extends Name>(name: N, ...given: Parameters<Calls[N]>): Promise<Awaited<ReturnType<Calls[N]>>> {
    return this.handing([], name, ...given);
  }

  /** The same, with buffers that are handed over instead of copied. */
  handing<N extends Name>(buffers: Transferable[], name: N, ...given: Parameters<Calls[N]>): Promise<Awaited<ReturnType<Calls[N]>>> {
    const id = ++this.next;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve: resolve as (value: unknown) => void, reject });
      this.start().postMessage({ id, name, given }, buffers);
    });
  }

  private start(): Worker {
    if (this.worker) return this.worker;
    const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    worker.onmessage = ({ data }) => {
      const waiting = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if (data.broken) this.end(worker);
      if (data.error === undefined) waiting?.resolve(data.result);
      else waiting?.reject(new LibraryError(data.error));
    };
    worker.onerror = () => this.end(worker);
    this.worker = worker;
    return worker;
  }

  /** After a failure within, the module is in no state to go on: the next call starts it anew. */
  private end(worker: Worker): void {
    worker.terminate();
    if (this.worker === worker) this.worker = null;
    for (const waiting of this.waiting.values()) waiting.reject(new LibraryError(""));
    this.waiting.clear();
  }
}

/** Draws targets, at once. */
export const drawing = new Door();
/** Makes solids in space, which takes seconds. */
export const folding = new Door();
/** Proves files, which takes seconds. */
export const proving = new Door();
/** Looks at pictures, and calibrates. */
export const looking = new Door();
