import { describe, expect, it } from "vitest";
import { Glide, LEAD_MS, Track, eased, slerped, tracked, turned } from "./motion";
import type { Quat, Vec3 } from "./types";

const LEVEL: Quat = [1, 0, 0, 0];
const at = (x: number): { at: Vec3; quat: Quat } => ({ at: [x, 0, 0], quat: LEVEL });

describe("a track", () => {
  it("is in between its poses, and never beyond the newest", () => {
    const track = new Track(at(0), 0);
    let heard = 0;
    for (let i = 1; i <= 20; i++) {
      const time = i * 50;
      track.add(at(i * 3), time, heard);
      heard = time;
    }
    let before = -Infinity;
    for (let time = 0; time < 1500; time += 7) {
      const x = track.at(time).at[0];
      expect(x).toBeGreaterThanOrEqual(before);
      expect(x).toBeLessThanOrEqual(60);
      before = x;
    }
    expect(track.at(975).at[0]).toBeCloseTo(58.5, 5);
    expect(track.at(9999).at[0]).toBe(60);
    expect(track.movesAfter(1000)).toBe(false);
    expect(track.movesAfter(999)).toBe(true);
  });

  it("stood still until shortly before it was seen elsewhere after a rest", () => {
    const track = new Track(at(0), 0);
    track.add(at(10), 5000, 200);
    expect(track.at(4000).at[0]).toBe(0);
    expect(track.at(5000 - LEAD_MS).at[0]).toBe(0);
    expect(track.at(5000 - LEAD_MS / 2).at[0]).toBeCloseTo(5);
  });

  it("that others moved without it stood still meanwhile", () => {
    const track = new Track(at(0), 0);
    track.add(at(6), 1000, 970);
    expect(track.at(970).at[0]).toBe(0);
    expect(track.at(985).at[0]).toBeCloseTo(3);
  });

  it("takes two poses of the same instant as one", () => {
    const track = new Track(at(0), 100);
    track.add(at(4), 100, 90);
    expect(track.at(100).at[0]).toBe(4);
  });

  it("forgets its way when it jumps, and keeps no more than it needs", () => {
    const track = new Track(at(0), 0);
    for (let i = 1; i < 100; i++) track.add(at(i), i * 50, (i - 1) * 50);
    expect(track.at(4925).at[0]).toBeCloseTo(98.5);
    track.jump(at(500), 5000);
    expect(track.at(4990).at[0]).toBe(500);
  });
});

describe("turning", () => {
  it("goes the short way and stays of length one", () => {
    const half = Math.SQRT1_2;
    const turned = slerped([1, 0, 0, 0], [-half, 0, 0, -half], 0.5);
    expect(Math.hypot(...turned)).toBeCloseTo(1);
    expect(turned[0]).toBeCloseTo(Math.cos(Math.PI / 8));
    expect(turned[3]).toBeCloseTo(Math.sin(Math.PI / 8));
  });
});

describe("a glide", () => {
  it("starts and ends gently, on time, from wherever it is", () => {
    const glide = new Glide(0, 100);
    glide.aim(10, 1000);
    expect(glide.at(1000)).toBe(0);
    expect(glide.at(1050)).toBeCloseTo(5);
    expect(glide.at(1100)).toBe(10);
    expect(glide.movesAfter(1099)).toBe(true);
    expect(glide.movesAfter(1100)).toBe(false);
    glide.aim(0, 1050);
    expect(glide.at(1050)).toBeCloseTo(5);
  });

  it("eases monotonically", () => {
    const shares = Array.from({ length: 50 }, (_, i) => eased(i / 49));
    expect(shares.every((share, i) => i === 0 || share >= (shares[i - 1] ?? 0))).toBe(true);
    expect(eased(-1)).toBe(0);
    expect(eased(2)).toBe(1);
  });
});

describe("tracks that are gone on with", () => {
  it("end with the thing and begin with it", () => {
    expect(tracked(null, null, 0, 0)).toBeNull();
    const begun = tracked(null, [1, 2, 3], 10, 0);
    expect(begun?.newest.at).toEqual([1, 2, 3]);
    expect(tracked(begun, null, 20, 10)).toBeNull();
  });

  it("take what has moved and nothing else", () => {
    const begun = tracked(null, [1, 2, 3], 10, 0);
    expect(tracked(begun, [1, 2, 3], 60, 10)).toBe(begun);
    expect(begun?.movesAfter(10)).toBe(false);
    expect(tracked(begun, [1, 2, 4], 110, 60)).toBe(begun);
    expect(begun?.newest.at).toEqual([1, 2, 4]);
    expect(begun?.movesAfter(10)).toBe(true);
  });

  it("are kept of joints, too", () => {
    const begun = turned(null, [0, 1], 10, 0);
    expect(turned(begun, [0, 1.5], 60, 10)?.newest).toEqual([0, 1.5]);
    expect(turned(begun, null, 70, 60)).toBeNull();
  });
});
