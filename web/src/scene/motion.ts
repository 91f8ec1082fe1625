// Poses come some twenty times a second; the picture shows what was `delay` ago, in between two of them. It
// never runs ahead of what is known, so that nothing overshoots.
import type { Quat, Vec3 } from "./types";

export interface Pose {
  readonly at: Vec3;
  readonly quat: Quat;
}

interface Key extends Pose {
  readonly time: number;
}

/** Behind the newest pose, ms: two samples of the server and a little. */
export const DELAY_MS = 120;
/** How long before a pose the one before it held, when nothing was heard in between, ms. */
export const LEAD_MS = 60;
const KEPT = 16;

export class Track {
  #keys: Key[] = [];

  constructor(pose: Pose, time: number) {
    this.#keys.push({ ...pose, time });
  }

  /** A new pose, known at `time`; `heard` is when anything at all was heard last: until then it stood still. */
  add(pose: Pose, time: number, heard: number): void {
    const last = this.#last();
    const stood = Math.max(Math.min(heard, time), time - LEAD_MS);
    if (time <= last.time) {
      this.#keys[this.#keys.length - 1] = { ...pose, time: last.time };
      return;
    }
    if (stood > last.time) this.#keys.push({ ...last, time: stood });
    this.#keys.push({ ...pose, time });
    if (this.#keys.length > KEPT) this.#keys.splice(0, this.#keys.length - KEPT);
  }

  /** There at once, without a way. */
  jump(pose: Pose, time: number): void {
    this.#keys = [{ ...pose, time }];
  }

  at(time: number): Pose {
    const keys = this.#keys;
    const next = keys.findIndex((key) => key.time > time);
    if (next === 0) return keys[0] ?? this.#last();
    if (next < 0) return this.#last();
    const [a, b] = [keys[next - 1], keys[next]];
    if (!a || !b) return this.#last();
    const share = (time - a.time) / (b.time - a.time);
    return { at: mixed(a.at, b.at, share), quat: slerped(a.quat, b.quat, share) };
  }

  /** Whether it will look different after `time`. */
  movesAfter(time: number): boolean {
    return this.#last().time > time;
  }

  get newest(): Pose {
    return this.#last();
  }

  #last(): Key {
    const last = this.#keys.at(-1);
    if (!last) throw new Error("a track has at least one pose");
    return last;
  }
}

export function mixed(a: Vec3, b: Vec3, share: number): Vec3 {
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share];
}

/** The short way round. Samples are close together: a straight line, made a unit again, is as good as an arc. */
export function slerped(a: Quat, b: Quat, share: number): Quat {
  const same = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const q = a.map((part, i) => part * (1 - share) + same * (b[i] ?? 0) * share);
  const length = Math.hypot(...q) || 1;
  return [(q[0] ?? 1) / length, (q[1] ?? 0) / length, (q[2] ?? 0) / length, (q[3] ?? 0) / length];
}

/** From 0 to 1, slow at both ends. */
export function eased(share: number): number {
  const s = Math.min(Math.max(share, 0), 1);
  return s * s * s * (10 - 15 * s + 6 * s * s);
}

/** Goes to where it is told within a fixed time, and says when it is there. */
export class Glide {
  #from: number;
  #to: number;
  #start = 0;

  constructor(
    value: number,
    private readonly duration: number,
  ) {
    this.#from = this.#to = value;
  }

  aim(value: number, time: number): void {
    if (value === this.#to) return;
    this.#from = this.at(time);
    this.#to = value;
    this.#start = time;
  }

  at(time: number): number {
    return this.#from + (this.#to - this.#from) * eased((time - this.#start) / this.duration);
  }

  movesAfter(time: number): boolean {
    return this.#from !== this.#to && time < this.#start + this.duration;
  }
}
