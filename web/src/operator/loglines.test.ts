import { describe, expect, it } from "vitest";
import type { WireLine } from "../api/types";
import { asText, isPoll, joined, wanted } from "./loglines";

const line = (number: number, text: string, way: "in" | "out" = "in"): WireLine => ({ number, at: number, way, text });
const LINES = [
  line(1, "?", "out"),
  line(2, "<Idle|WPos:0.000,0.000,0.000|FS:0,0>"),
  line(3, "$J=G21G90X10F600", "out"),
  line(4, "ok"),
  line(5, "error:9"),
];
const numbers = (lines: readonly WireLine[]) => lines.map((one) => one.number);

describe("the filter", () => {
  it("hides status polls unless they are wanted", () => {
    expect(numbers(wanted(LINES, { text: "", polls: false, ways: "both" }))).toEqual([3, 4, 5]);
    expect(numbers(wanted(LINES, { text: "", polls: true, ways: "both" }))).toEqual([1, 2, 3, 4, 5]);
    expect(isPoll({ text: "<Hold:0|MPos:1.000,2.000,3.000>" })).toBe(true);
    expect(isPoll({ text: "<reset 0x18>" })).toBe(false);
  });

  it("wants all words, and none that are struck out, in capitals or not", () => {
    expect(numbers(wanted(LINES, { text: "g21 x10", polls: true, ways: "both" }))).toEqual([3]);
    expect(numbers(wanted(LINES, { text: "-ok -error", polls: false, ways: "in" }))).toEqual([]);
    expect(numbers(wanted(LINES, { text: "  ", polls: false, ways: "out" }))).toEqual([3]);
  });

  it("shows the newest of many", () => {
    const many = Array.from({ length: 5000 }, (_, index) => line(index, "ok"));
    const shown = wanted(many, { text: "", polls: false, ways: "both" });
    expect(shown).toHaveLength(2000);
    expect(shown.at(-1)?.number).toBe(4999);
  });
});

it("joins what was asked for with what came meanwhile, each line once", () => {
  expect(numbers(joined(LINES.slice(0, 4), LINES.slice(2), 100))).toEqual([1, 2, 3, 4, 5]);
  expect(numbers(joined(LINES, [], 2))).toEqual([4, 5]);
  expect(numbers(joined([], LINES, 3))).toEqual([3, 4, 5]);
});

it("writes lines as a file has them", () => {
  expect(asText([line(3, "ok")])).toMatch(/^\d\d:\d\d:03\.000 < ok\n$/);
});
