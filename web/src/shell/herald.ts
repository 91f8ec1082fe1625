// What of a game's changes is worth saying aloud. Remembers what was said, and is silent about what it finds.
import type { GameView, PromptView } from "../api/types";
import { saidMove } from "../chess/san";
import { promptText, reasonText, resultTitle } from "../game/words";
import { t } from "../i18n/i18n.svelte";

export class Herald {
  #game: GameView | null = null;
  #prompts = new Set<string>();

  game(now: GameView | null): string[] {
    const before = this.#game;
    this.#game = now;
    if (!now || before?.number !== now.number) return [];
    const news = now.moves.slice(before.moves.length).map((move) => saidMove(move.san, mover(move.fen)));
    if (now.result && !before.result) news.push(`${resultTitle(now.result)}. ${reasonText(now.reason)}.`);
    else if (now.person_to_move && !before.person_to_move) news.push(t("game.say_your_move"));
    if (now.paused && !before.paused) news.push(t("game.status_paused"));
    return news.length > 0 ? [news.join(" ")] : [];
  }

  prompts(now: readonly PromptView[], game: GameView | null): string[] {
    const fresh = now.filter((prompt) => !this.#prompts.has(prompt.id));
    this.#prompts = new Set(now.map((prompt) => prompt.id));
    return fresh.map((prompt) => promptText(prompt, game));
  }
}

/** Who made the move that led to a position. */
function mover(fen: string): "white" | "black" {
  return fen.split(" ")[1] === "b" ? "white" : "black";
}
