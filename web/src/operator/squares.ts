// What the eyes say of each square, in words: what stands there, and how sure that is.
import type { SquaresView } from "../api/types";

export type SquareState = "empty" | "white" | "black" | "unknown";
export type Doubt = "certain" | "fair" | "unsure";

export interface Reading {
  readonly square: string;
  readonly state: SquareState;
  /** Probability of `state`, 0 to 1. */
  readonly sure: number;
  readonly doubt: Doubt;
  /** mm over the board. */
  readonly height: number | null;
}

const CERTAIN = 0.98;
const FAIR = 0.8;
const STATES = ["empty", "white", "black"] as const;

/** 64, a1, b1 … h8; all unknown while nothing may be believed. */
export function readings(squares: Pick<SquaresView, "occupancy" | "heights"> | null): readonly Reading[] {
  return Array.from({ length: 64 }, (_, index) => {
    const square = `${"abcdefgh"[index % 8] ?? ""}${(index >> 3) + 1}`;
    const odds = squares?.occupancy[index];
    if (!odds) return { square, state: "unknown", sure: 0, doubt: "certain", height: null };
    const sure = Math.max(...odds);
    const state = STATES[odds.indexOf(sure)] ?? "empty";
    const doubt = sure >= CERTAIN ? "certain" : sure >= FAIR ? "fair" : "unsure";
    return { square, state, sure, doubt, height: squares?.heights?.[index] ?? null };
  });
}
