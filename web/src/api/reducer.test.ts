import { expect, it } from "vitest";
import { delta, gameView, snapshot, stationView } from "../testing/views";
import { applyDelta, applySnapshot, NOTHING } from "./reducer";
import type { PieceView } from "./types";

const piece = (id: number, x: number): PieceView => ({ id, letter: "P", at: [x, 0, 0], quaternion: [1, 0, 0, 0] });
const scene = (whole: boolean, ...pieces: PieceView[]) => ({ tool: null, closed: false, hand: null, whole, table: "one", joints: null, pieces });
const begun = applySnapshot(NOTHING, snapshot({ game: gameView(), station: stationView() }), 0);

it("replaces whole topics, and only those that changed", () => {
  const after = applyDelta(begun, delta(2, { game: gameView({ paused: true }) }));
  expect(after.topics.game?.paused).toBe(true);
  expect(after.topics.station).toBe(begun.topics.station);
});

it("forgets a topic that is gone", () => {
  expect(applyDelta(begun, delta(2, { game: null })).topics.game).toBeNull();
});

it("takes no topic of a delta that is older than the snapshot", () => {
  expect(applyDelta(begun, delta(1, { game: null }))).toBe(begun);
});

it("keeps pieces that a delta of the scene does not name, unless it is whole", () => {
  const seen = applySnapshot(NOTHING, snapshot({ scene: scene(true, piece(1, 0), piece(2, 5)) }), 0);
  const moved = applyDelta(seen, delta(2, { scene: scene(false, piece(2, 9)) }));
  expect(moved.topics.scene?.pieces).toEqual([piece(1, 0), piece(2, 9)]);
  expect(applyDelta(moved, delta(3, { scene: scene(true, piece(2, 9)) })).topics.scene?.pieces).toEqual([piece(2, 9)]);
});

it("knows the server's clock from the snapshot", () => {
  expect(applySnapshot(NOTHING, snapshot({}, { at: 1000 }), 940).clockOffset).toBe(60);
});

it("keeps only the newest of what was said, and lines of the wire of this run alone", () => {
  const say = { kind: "note", text: "x", data: {}, at: 0 };
  const line = { number: 1, at: 0, way: "out", text: "G1" } as const;
  let known = begun;
  for (let i = 0; i < 300; i++) known = applyDelta(known, delta(2, {}, { said: [say], wire: [line] }));
  expect(known.said).toHaveLength(200);
  expect(applySnapshot(known, snapshot({}, { epoch: "two" }), 0).wire).toHaveLength(0);
  expect(applySnapshot(known, snapshot({}), 0).wire).toHaveLength(300);
});
