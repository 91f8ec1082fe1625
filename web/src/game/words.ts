// What goes on, in the page's words.
import type { ActivityView, GameView, PromptView, SideView, StationView } from "../api/types";
import { isSquare } from "../chess/fen";
import { thePiece } from "../chess/san";
import { type Key, maybe, t } from "../i18n/i18n.svelte";
import { spoken } from "../i18n/said";

/** "carrying the knight to f3"; empty where there is nothing to say. */
export function activityText(activity: ActivityView): string {
  const { kind, piece, source, target } = activity;
  const moving = kind === "approaching" || kind === "carrying" || kind === "leaving";
  if (!moving) return t(`game.act_${kind}`);
  if (!piece) return "";
  return t(movingKey(kind, source, target), { piece: thePiece(piece), source: source ?? "", target: target ?? "" });
}

function movingKey(kind: "approaching" | "carrying" | "leaving", source: string | null, target: string | null): Key {
  if (kind === "approaching") return isSquare(source) ? "game.act_approaching" : "game.act_fetching_tray";
  if (kind === "carrying") return isSquare(target) ? "game.act_carrying" : "game.act_carrying_off";
  return "game.act_leaving";
}

/** What is the matter now, in a few words, to somebody who plays, or only looks on. */
export function statusText(
  game: GameView | null,
  station: StationView | null,
  activity: ActivityView | null,
  plays = true,
): string {
  if (station?.phase === "connecting" || station?.phase === "starting" || station?.phase === "leaving") {
    return t(`game.status_${station.phase}`);
  }
  if (!game) return "";
  if (game.result) return t("game.status_over");
  if (station && station.phase !== "playing") return t("game.status_cut_off");
  if (game.paused) return t(game.in_transfer ? "game.status_paused_transfer" : "game.status_paused");
  if (game.person_to_move && plays) {
    const atTheBoard = game.by_hand && !station?.on_twin; // the twin's hand makes what is chosen in the page
    return t(atTheBoard ? "game.status_your_move_hand" : "game.status_your_move");
  }
  const side = game[game.turn];
  if (activity?.piece) return t("game.status_moving", { name: sideName(side) });
  return side.kind === "engine" ? t("game.status_thinking", { name: sideName(side) }) : t("game.status_to_move", { colour: t(`game.${game.turn}`) });
}

/** A person without a name of their own is one in every language. */
export function sideName(side: SideView): string {
  return side.kind === "person" ? personName(side.name) : side.name;
}

/** The journal has names alone. */
export function personName(name: string): string {
  return name === "Person" ? t("game.person") : name;
}

export function resultTitle(result: string): string {
  if (result === "1-0") return t("game.over_won", { colour: t("game.white") });
  if (result === "0-1") return t("game.over_won", { colour: t("game.black") });
  return t(result === "1/2-1/2" ? "game.over_drawn" : "game.over_ended");
}

/** Reasons that we know in the page's language; others as they came. */
export function reasonText(reason: string): string {
  const slug = reason.toLowerCase().replaceAll(/[^a-z0-9]+/g, "_").replaceAll(/^_|_$/g, "");
  return maybe(`game.reason_${slug}`) ?? reason;
}

export function promptText(prompt: PromptView, game: GameView | null): string {
  if (prompt.kind === "draw" && game?.draw_offer) return t("game.draw_offered", { colour: t(`game.${game.draw_offer}`) });
  return spoken(prompt.text_said, prompt.text);
}

/** Halves as the score sheet counts them: the moves by number, from the position that the game began in. */
export function firstNumber(startFen: string): { number: number; black: boolean } {
  const fields = startFen.split(" ");
  return { number: Number(fields[5] ?? "1") || 1, black: fields[1] === "b" };
}
