import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { AFTER_ERROR_MS, PAUSE_MS, PictureLoop } from "./pictures";

const blob = new Blob(["x"]);
let answers: ((value: Blob | Error) => void)[];
const asked: string[] = [];
const shown = vi.fn();
const failed = vi.fn();
const source = {
  fetch: (url: string) => {
    asked.push(url);
    return new Promise<Blob>((resolve, reject) =>
      answers.push((value) => (value instanceof Error ? reject(value) : resolve(value))),
    );
  },
  show: shown,
  fail: failed,
};

beforeEach(() => {
  vi.useFakeTimers();
  answers = [];
  asked.length = 0;
  shown.mockReset();
  failed.mockReset();
});
afterEach(() => vi.useRealTimers());

it("asks for the next picture only when the last has come", async () => {
  const loop = new PictureLoop(source, "a");
  loop.start();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toEqual(["a"]);
  answers[0]?.(blob);
  await vi.advanceTimersByTimeAsync(PAUSE_MS);
  expect(shown).toHaveBeenCalledTimes(1);
  expect(asked).toEqual(["a", "a"]);
  loop.stop();
});

it("tells of an error and tries again after a while", async () => {
  const loop = new PictureLoop(source, "a");
  loop.start();
  answers[0]?.(new Error("no camera"));
  await vi.advanceTimersByTimeAsync(AFTER_ERROR_MS - 1);
  expect(failed).toHaveBeenCalledTimes(1);
  expect(asked).toHaveLength(1);
  await vi.advanceTimersByTimeAsync(1);
  expect(asked).toHaveLength(2);
  loop.stop();
});

it("drops what still comes of another kind of picture, and after the end", async () => {
  const loop = new PictureLoop(source, "a");
  loop.start();
  loop.change("b");
  answers[0]?.(blob);
  await vi.advanceTimersByTimeAsync(0);
  expect(shown).not.toHaveBeenCalled();
  answers[1]?.(blob);
  await vi.advanceTimersByTimeAsync(0);
  expect(shown).toHaveBeenCalledTimes(1);
  loop.stop();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toEqual(["a", "b"]);
});
