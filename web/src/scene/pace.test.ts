import { describe, expect, it } from "vitest";
import { Pace } from "./pace";

function shown(pace: Pace, frames: number, each: number, from = 0): number {
  for (let i = 1; i <= frames; i++) pace.note(from + i * each);
  return from + frames * each;
}

describe("pace", () => {
  it("draws fewer pixels where pictures take long, never too few, and more again when they do not", () => {
    const pace = new Pace();
    const then = shown(pace, 200, 100);
    expect(pace.share).toBeCloseTo(0.4);
    shown(pace, 400, 12, then);
    expect(pace.share).toBe(1);
  });

  it("does not take a pause for slowness", () => {
    const pace = new Pace();
    shown(pace, 20, 5000);
    expect(pace.share).toBe(1);
  });

  it("asks for one better picture at rest", () => {
    const pace = new Pace();
    shown(pace, 200, 100);
    expect(pace.rest()).toBe(true);
    expect(pace.share).toBe(1);
    expect(pace.rest()).toBe(false);
  });
});
