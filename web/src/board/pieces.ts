// The pieces on the board: cm-chessboard draws, animates and drags them. What is under them is ours (Board.svelte).
import { Chessboard, type InputEvent } from "cm-chessboard/src/Chessboard.js";
import spriteUrl from "cm-chessboard/assets/pieces/standard.svg?url";
import { FILES } from "../chess/fen";

export type { InputEvent };

export interface Pieces {
  show(fen: string, animated: boolean): void;
  turn(colour: "white" | "black"): void;
  /** Let pieces be moved; `null` ends it. */
  input(handler: ((event: InputEvent) => boolean) | null): void;
  destroy(): void;
}

export const PIECE_SPRITE = spriteUrl;
const STEP_MS = 250;

export function putPieces(element: HTMLElement, fen: string, orientation: "white" | "black"): Pieces {
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const board = new Chessboard(element, {
    position: fieldOf(fen),
    orientation: orientation === "white" ? "w" : "b",
    assetsUrl: "",
    responsive: false,
    style: { cssClass: "pieces", showCoordinates: false, animationDuration: still ? 0 : STEP_MS, pieces: { file: spriteUrl } },
  });
  // The squares under them are read from our own board; to a screen reader these are decoration.
  element.querySelector("svg")?.setAttribute("aria-hidden", "true");
  // Pieces are drawn anew for another size; not while one glides, which would end up beside the new ones.
  let gliding = Promise.resolve();
  let side = orientation;
  let gone = false;
  const resizes = new ResizeObserver(() => void gliding.then(() => gone || board.view.handleResize()));
  resizes.observe(element);
  return {
    show: (next, animated) => void (gliding = board.setPosition(fieldOf(next), animated && !still)),
    turn: (colour) => {
      if (colour !== side) gliding = board.setOrientation(colour === "white" ? "w" : "b", false);
      side = colour;
    },
    input: (handler) => {
      if (board.isMoveInputEnabled()) board.disableMoveInput();
      if (handler) board.enableMoveInput(handler);
    },
    destroy: () => {
      gone = true;
      resizes.disconnect();
      board.destroy();
    },
  };
}

/** The first field of a FEN; the library wants nothing else. */
function fieldOf(fen: string): string {
  return fen.split(" ")[0] || Array.from(FILES, () => "8").join("/");
}
