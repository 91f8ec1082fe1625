import { expect, it } from "vitest";
import type { TableFormView } from "./api";
import { changed, toForm, withKind, withSize } from "./form";

const nothing = { height: null, base_diameter: null, head_diameter: null, grip_height: null, grip_diameter: null, mass: null };
const KEPT = {
  square: 50,
  trays: [{ name: "left", origin: [-90, 25], rows: 8, columns: 2, pitch: 50, height: 0 }],
  pieces: { preset: "club", king: { ...nothing, height: 97 }, queen: nothing, rook: nothing, bishop: nothing, knight: nothing, pawn: nothing },
} as TableFormView;

it("holds only what differs from the set", () => {
  expect(toForm(KEPT).pieces).toEqual({ preset: "club", king: { height: 97 } });
});

it("knows whether anything was changed, and when it was changed back", () => {
  const draft = toForm(KEPT);
  expect(changed(draft, KEPT)).toBe(false);
  const edited = withSize(draft, "pawn", "grip_height", 22, 24);
  expect(edited.pieces.pawn).toEqual({ grip_height: 22 });
  expect(changed(edited, KEPT)).toBe(true);
  const back = withSize(edited, "pawn", "grip_height", 24, 24);
  expect(changed(back, KEPT)).toBe(false);
  expect(back.pieces).not.toHaveProperty("pawn");
});

it("keeps a kind's other sizes", () => {
  const draft = withSize(toForm(KEPT), "king", "grip_height", 50, 48);
  expect(draft.pieces.king).toEqual({ height: 97, grip_height: 50 });
  expect(withKind(draft, "king", undefined).pieces).toEqual({ preset: "club" });
});
