import { fireEvent, render, screen, within } from "@testing-library/svelte";
import { beforeEach, expect, it, vi } from "vitest";
import { START_FEN } from "../chess/fen";
import Board from "./Board.svelte";
import type { InputEvent } from "./pieces";

// jsdom draws no SVG: what the pieces are told is looked at instead.
const told = vi.hoisted(() => ({ shown: [] as string[], input: null as ((event: InputEvent) => boolean) | null }));
vi.mock("./pieces", () => ({
  putPieces: (_: HTMLElement, fen: string) => {
    told.shown.push(fen);
    return {
      show: (next: string) => told.shown.push(next),
      turn: () => undefined,
      input: (handler: typeof told.input) => (told.input = handler),
      destroy: () => undefined,
    };
  },
}));

const LEGAL = ["e2e4", "e2e3", "g1f3"];
const square = (name: string) => screen.getByRole("gridcell", { name: new RegExp(`^${name}`) });
const press = (key: string) => fireEvent.keyDown(document.activeElement!, { key });

function show(part: Partial<Parameters<typeof render<typeof Board>>[1]> = {}) {
  const onmove = vi.fn<(uci: string) => Promise<boolean>>().mockResolvedValue(true);
  render(Board, { fen: START_FEN, label: "Board", legal: LEGAL, onmove, ...part });
  return onmove;
}

beforeEach(() => {
  told.shown = [];
  told.input = null;
});

it("moves a piece by keys", async () => {
  const onmove = show();
  square("e2").focus();
  await press("Enter");
  expect(square("e2")).toHaveAttribute("aria-selected", "true");
  expect(square("e4")).toHaveAccessibleName("e4, empty, can go here");
  await press("ArrowUp");
  await press("ArrowUp");
  expect(square("e4")).toHaveFocus();
  await press("Enter");
  expect(onmove).toHaveBeenCalledExactlyOnceWith("e2e4");
  expect(told.shown.at(-1)).toContain("4P3/8/PPPP1PPP");
});

it("stays on the board at its edges, and lets go with Escape", async () => {
  const onmove = show();
  square("e2").focus();
  await press("Home");
  await press("ArrowLeft");
  expect(square("a2")).toHaveFocus();
  await press("ArrowDown");
  await press("ArrowDown");
  expect(square("a1")).toHaveFocus();
  square("g1").focus();
  await press("Enter");
  await press("Escape");
  expect(square("g1")).toHaveAttribute("aria-selected", "false");
  expect(onmove).not.toHaveBeenCalled();
});

it("names squares from the other side, too", async () => {
  show({ orientation: "black" });
  const rows = screen.getAllByRole("row");
  expect(within(rows[0]!).getAllByRole("gridcell")[0]).toHaveAccessibleName("h1, white rook");
});

it("makes a dragged move, and refuses one that is not legal", () => {
  const onmove = show();
  expect(told.input!({ type: "moveInputStarted", squareFrom: "a2" })).toBe(false);
  expect(told.input!({ type: "moveInputStarted", squareFrom: "g1" })).toBe(true);
  expect(told.input!({ type: "validateMoveInput", squareFrom: "g1", squareTo: "g3" })).toBe(false);
  expect(told.input!({ type: "validateMoveInput", squareFrom: "g1", squareTo: "f3" })).toBe(true);
  expect(onmove).toHaveBeenCalledExactlyOnceWith("g1f3");
});

it("puts the piece back when the move is refused", async () => {
  const onmove = show();
  onmove.mockResolvedValue(false);
  told.input!({ type: "validateMoveInput", squareFrom: "g1", squareTo: "f3" });
  await vi.waitFor(() => expect(told.shown.at(-1)).toBe(START_FEN));
  expect(told.shown.some((fen) => fen.includes("5N2"))).toBe(true);
});

it("lets nobody move where there is nothing to move", () => {
  show({ legal: [] });
  expect(told.input).toBeNull();
});

const PROMOTION = { fen: "4k3/P7/8/8/8/8/8/4K3 w - - 0 1", legal: ["a7a8q", "a7a8r", "a7a8b", "a7a8n"] };

it("asks what a pawn becomes", async () => {
  const onmove = show(PROMOTION);
  told.input!({ type: "validateMoveInput", squareFrom: "a7", squareTo: "a8" });
  await fireEvent.click(await screen.findByRole("button", { name: "knight" }));
  expect(onmove).toHaveBeenCalledExactlyOnceWith("a7a8n");
});

it("takes the pawn back when the question is closed", async () => {
  const onmove = show(PROMOTION);
  told.input!({ type: "validateMoveInput", squareFrom: "a7", squareTo: "a8" });
  await fireEvent.click(await screen.findByRole("button", { name: "Close" }));
  expect(onmove).not.toHaveBeenCalled();
  expect(screen.queryByRole("button", { name: "knight" })).toBeNull();
  expect(told.shown.at(-1)).toBe(PROMOTION.fen);
});

it("lights the square that a person is asked about", () => {
  show({ lit: ["f3"] });
  expect(square("f3")).toHaveClass("lit");
  expect(square("f3")).toHaveAccessibleName("f3, empty, look here");
});
