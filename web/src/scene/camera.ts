// Where one looks from: presets, keys, and a smooth way from one to the other. Angles are rad, lengths m.
import { eased } from "./motion";

export type Preset = "player" | "top" | "follow";

/** About a point that is looked at: azimuth from the player's side to the right, elevation above the table. */
export interface View {
  readonly azimuth: number;
  readonly elevation: number;
  readonly distance: number;
  readonly target: readonly [number, number, number];
}

export interface Limits {
  readonly nearest: number;
  readonly farthest: number;
}

export const LIMITS: Limits = { nearest: 0.16, farthest: 2.4 };
const LOWEST = 0.06;
const HIGHEST = Math.PI / 2 - 0.001;

/** @param reach How wide board and trays are, m. @param aspect Of the picture. @param side White's or Black's. */
export function presetView(preset: Preset, reach: number, aspect: number, side: "white" | "black"): View {
  const azimuth = side === "white" ? 0 : Math.PI;
  const back = 1.5 * reach * Math.max(1, 1.16 / aspect);
  if (preset === "top") return { azimuth, elevation: HIGHEST, distance: 1.1 * back, target: [0, 0, 0] };
  if (preset === "follow") return { azimuth: azimuth + 0.62, elevation: 0.5, distance: 0.62, target: [0, 0.05, 0] };
  return { azimuth: azimuth + 0.22, elevation: 0.66, distance: back, target: [0, 0.03, 0.01] };
}

/** What a key does to a view; null when it is none of ours. */
export function keyed(view: View, key: string): View | null {
  const turn = 0.13;
  switch (key) {
    case "ArrowLeft":
      return clamped({ ...view, azimuth: view.azimuth - turn });
    case "ArrowRight":
      return clamped({ ...view, azimuth: view.azimuth + turn });
    case "ArrowUp":
      return clamped({ ...view, elevation: view.elevation + turn });
    case "ArrowDown":
      return clamped({ ...view, elevation: view.elevation - turn });
    case "+":
    case "=":
    case "PageUp":
      return clamped({ ...view, distance: view.distance / 1.15 });
    case "-":
    case "PageDown":
      return clamped({ ...view, distance: view.distance * 1.15 });
    default:
      return null;
  }
}

export function clamped(view: View): View {
  return {
    ...view,
    elevation: Math.min(Math.max(view.elevation, LOWEST), HIGHEST),
    distance: Math.min(Math.max(view.distance, LIMITS.nearest), LIMITS.farthest),
  };
}

/** The eye's place. */
export function eyeOf({ azimuth, elevation, distance, target }: View): [number, number, number] {
  const flat = distance * Math.cos(elevation);
  return [
    target[0] + flat * Math.sin(azimuth),
    target[1] + distance * Math.sin(elevation),
    target[2] + flat * Math.cos(azimuth),
  ];
}

export function between(a: View, b: View, share: number): View {
  const s = eased(share);
  const mix = (x: number, y: number): number => x + (y - x) * s;
  const around = Math.atan2(Math.sin(b.azimuth - a.azimuth), Math.cos(b.azimuth - a.azimuth));
  return {
    azimuth: a.azimuth + around * s,
    elevation: mix(a.elevation, b.elevation),
    distance: a.distance * (b.distance / a.distance) ** s,
    target: [mix(a.target[0], b.target[0]), mix(a.target[1], b.target[1]), mix(a.target[2], b.target[2])],
  };
}

/** The view of one who drags the picture, pinches or turns the wheel. */
export class Orbit {
  view: View;
  #from: View;
  #to: View;
  #start = 0;
  #duration = 0;

  constructor(view: View) {
    this.view = this.#from = this.#to = view;
  }

  /** Go there within `duration` ms; 0 for at once. */
  fly(to: View, time: number, duration: number): void {
    [this.#from, this.#to, this.#start, this.#duration] = [this.view, to, time, duration];
    if (duration <= 0) this.view = to;
  }

  turn(azimuth: number, elevation: number): void {
    this.#hold({ ...this.view, azimuth: this.view.azimuth - azimuth, elevation: this.view.elevation + elevation });
  }

  zoom(factor: number): void {
    this.#hold({ ...this.view, distance: this.view.distance * factor });
  }

  /** Shift what is looked at, along the picture's axes, m. */
  pan(right: number, up: number): void {
    const { azimuth, target } = this.view;
    const [c, s] = [Math.cos(azimuth), Math.sin(azimuth)];
    const bound = (value: number): number => Math.min(Math.max(value, -0.6), 0.6);
    this.#hold({ ...this.view, target: [bound(target[0] + c * right - s * up), target[1], bound(target[2] - s * right - c * up)] });
  }

  /** Keep looking at a point that moves. */
  look(target: readonly [number, number, number]): void {
    this.view = { ...this.view, target };
    this.#to = { ...this.#to, target };
    this.#from = { ...this.#from, target };
  }

  movesAfter(time: number): boolean {
    return this.#duration > 0 && time < this.#start + this.#duration;
  }

  advance(time: number): void {
    if (this.#duration <= 0) return;
    const share = (time - this.#start) / this.#duration;
    this.view = between(this.#from, this.#to, share);
    if (share >= 1) this.#duration = 0;
  }

  #hold(view: View): void {
    this.view = clamped(view);
    this.#duration = 0;
  }
}
