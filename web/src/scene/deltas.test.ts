import { describe, expect, it } from "vitest";
import { applyDelta, NO_TOPICS, NOTHING, type Known } from "../api/reducer";
import type { Delta, SceneView } from "../api/types";
import { onSquare } from "./fixture";

const E2 = onSquare(1, "P", "e2");
const D2 = onSquare(2, "P", "d2");
const E4 = onSquare(1, "P", "e4");

function scene(pieces: SceneView["pieces"], whole: boolean): SceneView {
  return { tool: [1, 2, 3], closed: false, hand: null, pieces, whole, table: "one", joints: null };
}

function after(known: Known, changed: SceneView | null): Known {
  const delta: Delta = {
    type: "delta",
    sequence: known.sequence + 1,
    moved_at: 0,
    changed: ["scene"],
    topics: { ...NO_TOPICS, scene: changed },
    said: [],
    wire: [],
  };
  return applyDelta(known, delta);
}

const START = after(NOTHING, scene([E2, D2], true));

describe("a scene's delta", () => {
  it("moves the pieces that it names, and leaves the others", () => {
    const moved = after(START, scene([E4], false)).topics.scene;
    expect(moved?.pieces).toEqual([E4, D2]);
    expect(moved?.pieces[1]).toBe(D2);
  });

  it("that is whole takes away what it does not name", () => {
    expect(after(START, scene([E4], true)).topics.scene?.pieces).toEqual([E4]);
  });

  it("adds a piece that was brought, and may be none at all", () => {
    const queen = onSquare(3, "Q", "a8");
    expect(after(START, scene([queen], false)).topics.scene?.pieces).toEqual([E2, D2, queen]);
    expect(after(START, null).topics.scene).toBeNull();
  });
});
