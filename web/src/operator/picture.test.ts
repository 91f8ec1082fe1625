import { describe, expect, it } from "vitest";
import type { FindingView, GeometryView } from "./api";
import { cell, cornerMarks, marked, notes, outline, viewBox } from "./picture";

const GEOMETRY: GeometryView = {
  lower: [0, 0, 0],
  upper: [700, 450, 200],
  areas: [
    { name: "board", corners: [[150, 25], [550, 25], [550, 425], [150, 425]] },
    { name: "left", corners: [[35, 25], [135, 25], [135, 425], [35, 425]] },
  ],
  places: [
    { name: "a1", area: "board", at: [175, 50] },
    { name: "left1", area: "left", at: [60, 50] },
  ],
  radius: 22,
};
const finding = (where: string[], by: number, unit = "mm"): FindingView => ({ text: "…", by, unit, mend: "…", where });

describe("the table from above", () => {
  it("shows everything, y upwards", () => {
    expect(viewBox(GEOMETRY, 10)).toEqual({ x: -10, y: -460, width: 720, height: 470 });
    expect(outline([[150, 25], [550.04, 425]])).toBe("150,-25 550,-425");
  });

  it("grows with a tray that stands outside of the reach", () => {
    const far = { ...GEOMETRY, places: [{ name: "left1", area: "left", at: [-100, 50] as [number, number] }] };
    expect(viewBox(far, 10).x).toBe(-132);
  });

  it("leaves out what a far-reaching arm reaches beyond", () => {
    const arm = { ...GEOMETRY, lower: [-900, -900, 0] as [number, number, number], upper: [900, 900, 0] as [number, number, number] };
    expect(viewBox(arm, 10)).toEqual({ x: -135, y: -595, width: 855, height: 740 });
  });

  it("finds the squares of a turned board", () => {
    const turned = [[400, 0], [400, 400], [0, 400], [0, 0]] as const;
    expect(cell(turned, 0, 0)).toEqual([[400, 0], [400, 50], [350, 50], [350, 0]]);
    expect(cell([], 0, 0)).toEqual([]);
  });
});

describe("what does not fit", () => {
  it("is marked, with its number at the place", () => {
    const findings = [finding(["left", "left1"], 12.34), finding(["board"], 3, "pieces")];
    expect([...marked(findings)]).toEqual(["left", "left1", "board"]);
    expect(notes(GEOMETRY, findings)).toEqual([
      { at: [60, 50], text: "12.3 mm" },
      { at: [350, 225], text: "3 pieces" },
    ]);
  });

  it("has no place in the picture when it is about a kind of piece", () => {
    expect(notes(GEOMETRY, [finding(["king"], 2), finding([], 1)])).toEqual([]);
  });
});

describe("residuals", () => {
  const touched = { a1: [150, 25, 1], h1: [550, 25, 1], h8: [550, 425, 1] } as const;

  it("are drawn larger the worse they are, and named by what they mean", () => {
    const marks = cornerMarks({ touched: { ...touched }, residuals: { a1: 0.1, h1: 0.9, h8: 2 } });
    expect(marks.map((mark) => mark.state)).toEqual(["good", "fair", "bad"]);
    expect(marks[0]?.radius).toBeLessThan(marks[1]?.radius ?? 0);
    expect(marks[2]).toMatchObject({ corner: "h8", at: [550, 425], residual: 2, radius: 40 });
  });

  it("are not shown for two corners, which fit any board", () => {
    const { a1, h1 } = touched;
    expect(cornerMarks({ touched: { a1, h1 }, residuals: { a1: 0, h1: 0 } })).toEqual([
      { corner: "a1", at: [150, 25], residual: null, state: "touched", radius: 6 },
      { corner: "h1", at: [550, 25], residual: null, state: "touched", radius: 6 },
    ]);
  });
});
