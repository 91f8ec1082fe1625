// What it means that a person takes a piece in the 3D view and sets it down: no pixels here, only decisions.
import { distance, squareAt, squareCentre } from "./frames";
import type { Geometry, PieceView, Vec2, Vec3 } from "./types";

export interface Rules {
  /** UCI moves that the person may make now. */
  readonly legal: readonly string[];
  readonly personToMove: boolean;
  /** Whether a virtual hand is there that may carry anything anywhere, and a camera sees it. */
  readonly hand: boolean;
}

export type Decision =
  | { readonly kind: "nothing" }
  | { readonly kind: "refused"; readonly why: "not_your_turn" | "illegal" }
  | { readonly kind: "move"; readonly uci: string; readonly to: string }
  | { readonly kind: "promotion"; readonly from: string; readonly to: string; readonly choices: readonly string[] }
  | { readonly kind: "hand_carry"; readonly source: Vec2; readonly target: Vec2 };

/** Set down closer to where it stood than this share of a square, it was never taken. */
const SAME_PLACE = 0.35;

export function mayTake(piece: PieceView, geometry: Geometry, rules: Rules): boolean {
  if (rules.hand) return true;
  const from = squareOf(piece, geometry);
  return rules.personToMove && from !== null && rules.legal.some((uci) => uci.startsWith(from));
}

/** The square a piece stands on; null beside the board, or in the air. */
export function squareOf(piece: PieceView, geometry: Geometry): string | null {
  return squareAt(geometry, piece.at);
}

/** Squares that the piece may go to. */
export function targets(piece: PieceView, geometry: Geometry, rules: Rules): readonly string[] {
  const from = squareOf(piece, geometry);
  if (from === null || !rules.personToMove) return [];
  const moves = rules.legal.filter((uci) => uci.startsWith(from)).map((uci) => uci.slice(2, 4));
  return [...new Set(moves)];
}

export function decide(piece: PieceView, drop: Vec3, geometry: Geometry, rules: Rules): Decision {
  if (distance(piece.at, drop) < SAME_PLACE * geometry.board.square) return { kind: "nothing" };
  const [from, to] = [squareOf(piece, geometry), squareAt(geometry, drop)];
  if (from !== null && from === to && !rules.hand) return { kind: "nothing" };
  const moves = from && to && rules.personToMove ? rules.legal.filter((uci) => uci.slice(0, 4) === from + to) : [];
  const [first] = moves;
  if (first !== undefined && from && to) {
    if (first.length > 4) return { kind: "promotion", from, to, choices: moves };
    return { kind: "move", uci: first, to };
  }
  if (rules.hand) {
    return { kind: "hand_carry", source: [piece.at[0], piece.at[1]], target: [drop[0], drop[1]] };
  }
  return { kind: "refused", why: rules.personToMove ? "illegal" : "not_your_turn" };
}

/** Where the piece is shown to go while it is over a square: that square's centre if it may go there. */
export function snapped(piece: PieceView, over: Vec3, geometry: Geometry, rules: Rules): Vec3 {
  const square = squareAt(geometry, over);
  if (square === null || !targets(piece, geometry, rules).includes(square)) return over;
  return squareCentre(geometry, square);
}
