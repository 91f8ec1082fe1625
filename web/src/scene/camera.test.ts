import { describe, expect, it } from "vitest";
import { between, clamped, eyeOf, keyed, LIMITS, Orbit, presetView } from "./camera";

const VIEW = presetView("player", 0.6, 1.5, "white");

describe("presets", () => {
  it("put White's player behind White's pieces and Black's behind Black's", () => {
    expect(eyeOf(VIEW)[2]).toBeGreaterThan(0.3);
    expect(eyeOf(presetView("player", 0.6, 1.5, "black"))[2]).toBeLessThan(-0.3);
  });

  it("look straight down from above, from farther away when the picture is narrow", () => {
    const [x, y, z] = eyeOf(presetView("top", 0.6, 1.5, "white"));
    expect(Math.hypot(x, z)).toBeLessThan(0.01 * y);
    expect(eyeOf(presetView("top", 0.6, 0.6, "white"))[1]).toBeGreaterThan(y);
  });
});

describe("keys", () => {
  it("turn, rise and come nearer, within bounds", () => {
    expect(keyed(VIEW, "ArrowRight")?.azimuth).toBeGreaterThan(VIEW.azimuth);
    expect(keyed(VIEW, "ArrowUp")?.elevation).toBeGreaterThan(VIEW.elevation);
    expect(keyed(VIEW, "+")?.distance).toBeLessThan(VIEW.distance);
    expect(keyed(VIEW, "x")).toBeNull();
    let view = VIEW;
    for (let i = 0; i < 100; i++) view = keyed(keyed(view, "ArrowDown") ?? view, "-") ?? view;
    expect(view.distance).toBe(LIMITS.farthest);
    expect(view.elevation).toBeGreaterThan(0);
  });
});

describe("a flight", () => {
  it("begins and ends where it should, the short way round", () => {
    const from = { ...VIEW, azimuth: 3 };
    const to = { ...VIEW, azimuth: -3 };
    expect(between(from, to, 0)).toEqual(from);
    expect(between(from, to, 0.5).azimuth).toBeCloseTo(Math.PI, 1);
    const orbit = new Orbit(VIEW);
    orbit.fly(clamped({ ...VIEW, distance: 0.5 }), 1000, 400);
    orbit.advance(1200);
    expect(orbit.view.distance).toBeLessThan(VIEW.distance);
    expect(orbit.movesAfter(1200)).toBe(true);
    orbit.advance(1400);
    expect(orbit.view.distance).toBeCloseTo(0.5);
    expect(orbit.movesAfter(1400)).toBe(false);
  });

  it("ends when somebody turns the picture", () => {
    const orbit = new Orbit(VIEW);
    orbit.fly({ ...VIEW, azimuth: 1 }, 0, 500);
    orbit.turn(0.2, 0);
    orbit.advance(250);
    expect(orbit.view.azimuth).toBeCloseTo(VIEW.azimuth - 0.2);
  });
});
