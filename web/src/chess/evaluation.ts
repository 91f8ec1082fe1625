// The engine's score, from White's side, as a bar and a number.
import type { ThinkingView } from "../api/types";
import { formatNumber } from "../i18n/i18n.svelte";

type Score = Pick<ThinkingView, "centipawns" | "mate">;

/** White's part of the bar, 0 … 1: what a score is worth in points, by the usual logistic curve. */
export function whiteShare(score: Score | null): number {
  if (score === null) return 0.5;
  if (score.mate !== null) return score.mate > 0 ? 1 : 0;
  return 1 / (1 + 10 ** (-(score.centipawns ?? 0) / 400));
}

/** "+0.8", "−1.2", "M5". */
export function scoreText(score: Score | null): string {
  if (score === null) return "";
  if (score.mate !== null) return `${score.mate < 0 ? "−" : ""}M${formatNumber(Math.abs(score.mate))}`;
  if (score.centipawns === null) return "";
  const pawns = score.centipawns / 100;
  const sign = pawns > 0.049 ? "+" : pawns < -0.049 ? "−" : "";
  return sign + formatNumber(Math.abs(pawns), 1);
}
