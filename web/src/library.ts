// The library, in workers, so that the page never blocks. Modules are loaded on first use.
import type { Calls, Name } from "./worker";

type Waiting = { resolve: (value: unknown) => void; reject: (error: Error) => void };

/** An error of the library, whose message is one sentence for the user. */
export class LibraryError extends Error {}

class Client {
  private worker: Worker | null = null;
  private waiting = new Map<number, Waiting>();
  private next = 0;

  call<N extends Name>(name: N, ...given: Parameters<Calls[N]>): Promise<Awaited<ReturnType<Calls[N]>>> {
    return this.handing([], name, ...given);
  }

  /** Like `call`, but transfers buffers instead of copying them. */
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

  /** Ends running calls, which fail without a message. */
  cancel(): void {
    if (this.waiting.size > 0 && this.worker) this.end(this.worker);
  }

  /** Ends a worker after a crash, which leaves the module unusable, or to cancel calls; the next call starts a new one. */
  private end(worker: Worker): void {
    worker.terminate();
    if (this.worker === worker) this.worker = null;
    for (const waiting of this.waiting.values()) waiting.reject(new LibraryError(""));
    this.waiting.clear();
  }
}

/** Draws targets, immediately. */
export const drawing = new Client();
/** Builds 3D solids, which takes seconds. */
export const folding = new Client();
/** Verifies files and counts their pages on A4, which takes seconds that nobody waits for. */
export const proving = new Client();
/** Detects targets in images, and calibrates. */
export const looking = new Client();
