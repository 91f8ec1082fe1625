// Time that passes in what is shown: read `ticking(100)` in a component, and it is drawn anew while it is seen.
import { createSubscriber } from "svelte/reactivity";

const subscribers = new Map<number, () => void>();

/** Ours, ms since the epoch; the reader is run again every so many milliseconds. */
export function ticking(everyMs: number): number {
  let subscribe = subscribers.get(everyMs);
  if (!subscribe) {
    subscribe = createSubscriber((update) => {
      const timer = setInterval(update, everyMs);
      return () => clearInterval(timer);
    });
    subscribers.set(everyMs, subscribe);
  }
  subscribe();
  return Date.now();
}
