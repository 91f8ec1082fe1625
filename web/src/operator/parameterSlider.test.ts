import { fireEvent, render, screen } from "@testing-library/svelte";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { ParameterView } from "./api";
import ParameterSlider from "./ParameterSlider.svelte";

const parameter: ParameterView = {
  name: "depth.noise", value: 2, estimate: 2, unit: "mm", low: 0.1, high: 30,
  about: "scatter of the board's cells", source: "prior", overridden: false,
}; // prettier-ignore

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

it("names, bounds and sends a value once while it is dragged", async () => {
  const onset = vi.fn();
  render(ParameterSlider, { parameter, onset });
  const slider = screen.getByRole<HTMLInputElement>("slider", { name: "Scatter of heights on the bare board" });
  expect(slider.max).toBe("30");
  for (const value of [3, 4, 5]) await fireEvent.input(slider, { target: { value } });
  expect(onset).not.toHaveBeenCalled();
  await vi.advanceTimersByTimeAsync(200);
  expect(onset.mock.calls).toEqual([[5]]);
});

it("keeps a number within its range", async () => {
  const onset = vi.fn();
  render(ParameterSlider, { parameter, onset });
  await fireEvent.change(screen.getByRole("spinbutton"), { target: { value: "99" } });
  await vi.advanceTimersByTimeAsync(200);
  expect(onset.mock.calls).toEqual([[30]]);
});

it("is given back to the reader", async () => {
  const onset = vi.fn();
  render(ParameterSlider, { parameter: { ...parameter, value: 7, overridden: true }, onset });
  await fireEvent.click(screen.getByRole("button"));
  expect(onset.mock.calls).toEqual([[null]]);
});
