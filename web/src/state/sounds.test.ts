import { afterEach, expect, it, vi } from "vitest";
import { settings } from "./settings.svelte";
import { sound, soundOf } from "./sounds";

afterEach(() => {
  settings.sounds = false;
  vi.unstubAllGlobals();
});

it("tells moves, captures and ends apart", () => {
  expect([soundOf("e4", false), soundOf("exd5", false), soundOf("Qh4#", true), soundOf(undefined, false)]).toEqual([
    "move",
    "capture",
    "over",
    undefined,
  ]);
});

it("is silent until it is switched on", () => {
  const made = vi.fn();
  vi.stubGlobal("AudioContext", made);
  sound("move");
  expect(made).not.toHaveBeenCalled();
});
