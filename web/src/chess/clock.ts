// A chess clock as the server read it, told on by our own clock in between.
import type { ClockView, Colour } from "../api/types";
import { formatNumber } from "../i18n/i18n.svelte";

/** Seconds left, never below none. `now`: the server's time, s since the epoch. */
export function secondsLeft(clock: ClockView, colour: Colour, now: number): number {
  const read = clock[colour];
  return Math.max(0, clock.running === colour ? read - Math.max(0, now - clock.at) : read);
}

/** "1:02:03", "9:59", and tenths in the last twenty seconds. */
export function clockText(seconds: number): string {
  if (seconds < 20) return `0:${pad(Math.floor(seconds))}${formatNumber(Math.floor((seconds % 1) * 10) / 10, 1).slice(1)}`;
  const whole = Math.ceil(seconds);
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor((whole % 3600) / 60)];
  return hours > 0 ? `${formatNumber(hours)}:${pad(minutes)}:${pad(whole % 60)}` : `${formatNumber(minutes)}:${pad(whole % 60)}`;
}

function pad(value: number): string {
  return formatNumber(value).padStart(2, formatNumber(0));
}
