import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Jogging, keyDirection, nextSpeed, padDirection, REPEAT_MS } from "./jogging";

const robot = { jog: vi.fn(), stop: vi.fn() };

beforeEach(() => {
  vi.useFakeTimers();
  robot.jog.mockReset();
  robot.stop.mockReset();
});
afterEach(() => vi.useRealTimers());

describe("Jogging", () => {
  it("moves at once, goes on while it is held, and stops once when it is let go of", () => {
    const jogging = new Jogging(robot, 20);
    jogging.hold("button", [1, 0, 0]);
    expect(robot.jog.mock.calls).toEqual([[[1, 0, 0], 20]]);
    vi.advanceTimersByTime(3 * REPEAT_MS);
    expect(robot.jog).toHaveBeenCalledTimes(4);
    jogging.release("button");
    expect(robot.stop).toHaveBeenCalledTimes(1);
    vi.advanceTimersByTime(10 * REPEAT_MS);
    expect(robot.jog).toHaveBeenCalledTimes(4);
    jogging.release("button");
    expect(robot.stop).toHaveBeenCalledTimes(1);
  });

  it("adds up what is held together, and rests between opposites", () => {
    const jogging = new Jogging(robot);
    jogging.hold("ArrowRight", [1, 0, 0]);
    jogging.hold("PageUp", [0, 0, 1]);
    expect(robot.jog.mock.lastCall?.[0]).toEqual([1, 0, 1]);
    jogging.release("PageUp");
    jogging.hold("ArrowLeft", [-1, 0, 0]);
    expect(robot.stop).toHaveBeenCalledTimes(1);
    expect(jogging.moving).toBe(false);
    jogging.release("ArrowRight");
    expect(robot.jog.mock.lastCall?.[0]).toEqual([-1, 0, 0]);
  });

  it("takes the repeats of a held key for one", () => {
    const jogging = new Jogging(robot);
    jogging.hold("ArrowUp", [0, 1, 0]);
    jogging.hold("ArrowUp", [0, 1, 0]);
    expect(robot.jog).toHaveBeenCalledTimes(1);
  });

  it("lets go of everything when focus or connection are lost", () => {
    const told: unknown[] = [];
    const jogging = new Jogging(robot, 5, (direction) => told.push(direction));
    jogging.hold("ArrowUp", [0, 1, 0]);
    jogging.hold("pointer", [1, 0, 0]);
    jogging.releaseAll();
    expect(robot.stop).toHaveBeenCalledTimes(1);
    vi.advanceTimersByTime(5 * REPEAT_MS);
    expect(robot.jog).toHaveBeenCalledTimes(2);
    expect(told).toEqual([[0, 1, 0], [1, 1, 0], null]);
  });

  it("says nothing to a robot that rests already", () => {
    new Jogging(robot).releaseAll();
    expect(robot.stop).not.toHaveBeenCalled();
  });

  it("changes its speed in mid-motion", () => {
    const jogging = new Jogging(robot, 5);
    jogging.hold("pointer", [0, 0, -1]);
    jogging.speed = 60;
    expect(robot.jog.mock.lastCall).toEqual([[0, 0, -1], 60]);
  });
});

describe("what is held", () => {
  it("leaves shortcuts of the browser alone", () => {
    const plain = { key: "PageDown", ctrlKey: false, altKey: false, metaKey: false };
    expect(keyDirection(plain)).toEqual([0, 0, -1]);
    expect(keyDirection({ ...plain, ctrlKey: true })).toBeUndefined();
    expect(keyDirection({ ...plain, key: "a" })).toBeUndefined();
  });

  it("ignores a stick that does not quite come back to its middle", () => {
    const buttons = Array.from({ length: 16 }, () => ({ pressed: false, touched: false, value: 0 }));
    expect(padDirection({ axes: [0.1, -0.1, 0, 0.15], buttons })).toBeNull();
    expect(padDirection({ axes: [0.5, -1, 0, 0], buttons })).toEqual([0.5, 1, 0]);
    buttons[5] = { pressed: true, touched: true, value: 1 };
    expect(padDirection({ axes: [], buttons })).toEqual([0, 0, 1]);
  });

  it("steps through the speeds and stays at the ends", () => {
    expect(nextSpeed(20, true)).toBe(60);
    expect(nextSpeed(20, false)).toBe(5);
    expect(nextSpeed(1, false)).toBe(1);
    expect(nextSpeed(300, true)).toBe(300);
  });
});
