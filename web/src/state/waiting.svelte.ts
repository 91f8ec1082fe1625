// Commands of this page that are done only when the robot's move in hand is: in a pause they wait for "Go on".
import type { Order } from "../api/types";

const AFTER_THE_MOVE: ReadonlySet<Order["name"]> = new Set<Order["name"]>(["swap_mode", "takeback"]);

export const waiting = $state({ orders: 0 });

/** The answer of a command, counted as long as it waits. */
export async function counted<T>(name: Order["name"], answer: Promise<T>): Promise<T> {
  const counts = AFTER_THE_MOVE.has(name) ? 1 : 0;
  waiting.orders += counts;
  try {
    return await answer;
  } finally {
    waiting.orders -= counts;
  }
}
