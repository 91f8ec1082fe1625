import { expect, it } from "vitest";
import { readings } from "./squares";

const empty: [number, number, number] = [0.999, 0.0005, 0.0005];

it("names squares from a1 to h8, and what stands there", () => {
  const occupancy = Array.from({ length: 64 }, () => empty);
  occupancy[0] = [0, 0.99, 0.01];
  occupancy[63] = [0.4, 0.1, 0.5];
  const read = readings({ occupancy, heights: [52, ...Array.from({ length: 63 }, () => null)] });
  expect(read[0]).toEqual({ square: "a1", state: "white", sure: 0.99, doubt: "certain", height: 52 });
  expect(read[1]).toMatchObject({ square: "b1", state: "empty", height: null });
  expect(read[63]).toMatchObject({ square: "h8", state: "black", doubt: "unsure" });
});

it("claims nothing when the eyes see nothing", () => {
  for (const nothing of [null, { occupancy: [], heights: null }]) {
    const read = readings(nothing);
    expect(read).toHaveLength(64);
    expect(new Set(read.map((one) => one.state))).toEqual(new Set(["unknown"]));
  }
});
