// Poses come some twenty times a second; the picture shows what was `delay` ago, in between two of them. It
// never runs ahead of what is known, so that nothing overshoots.
import type { Quat, Vec3 } from "./types";

export interface Pose {
  readonly at: Vec3;
  readonly quat: Quat;
}

export const UPRIGHT: Quat = [1, 0, 0, 0];

interface Key<T> {
  readonly value: T;
  readonly time: number;
}

type Mix<T> = (a: T, b: T, share: number) => T;

/** Behind the newest pose, ms: two samples of the server and a little. */
export const DELAY_MS = 120;
/** How long before a pose the one before it held, when nothing was heard in between, ms. */
export const LEAD_MS = 60;
const KEPT = 16;

/** Something that changes steadily, known at a few moments. */
export class Timeline<T> {
  #keys: Key<T>[] = [];

  constructor(
    value: T,
    time: number,
    private readonly mix: Mix<T>,
  ) {
    this.#keys.push({ value, time });
  }

  /** A new value, known at `time`; `heard` is when anything at all was heard last: until then it stood still. */
  add(value: T, time: number, heard: number): void {
    const last = this.#last();
    const stood = Math.max(Math.min(heard, time), time - LEAD_MS);
    if (time <= last.time) {
      this.#keys[this.#keys.length - 1] = { value, time: last.time };
      return;
    }
    if (stood > last.time) this.#keys.push({ value: last.value, time: stood });
    this.#keys.push({ value, time });
    if (this.#keys.length > KEPT) this.#keys.splice(0, this.#keys.length - KEPT);
  }

  /** There at once, without a way. */
  jump(value: T, time: number): void {
    this.#keys = [{ value, time }];
  }

  at(time: number): T {
    const keys = this.#keys;
    const next = keys.findIndex((key) => key.time > time);
    if (next === 0) return (keys[0] ?? this.#last()).value;
    if (next < 0) return this.#last().value;
    const [a, b] = [keys[next - 1], keys[next]];
    if (!a || !b) return this.#last().value;
    return this.mix(a.value, b.value, (time - a.time) / (b.time - a.time));
  }

  /** Whether it will look different after `time`. */
  movesAfter(time: number): boolean {
    return this.#last().time > time;
  }

  get newest(): T {
    return this.#last().value;
  }

  #last(): Key<T> {
    const last = this.#keys.at(-1);
    if (!last) throw new Error("a timeline has at least one value");
    return last;
  }
}

export class Track extends Timeline<Pose> {
  constructor(pose: Pose, time: number) {
    super(pose, time, (a, b, share) => ({ at: mixed(a.at, b.at, share), quat: slerped(a.quat, b.quat, share) }));
  }
}

/** The angles of joints, rad. */
export class JointTrack extends Timeline<readonly number[]> {
  constructor(joints: readonly number[], time: number) {
    super(joints, time, (a, b, share) => a.map((angle, i) => angle + ((b[i] ?? angle) - angle) * share));
  }
}

/** Goes on with a track when its point has moved; a new one where there was none. */
export function tracked(before: Track | null, at: Vec3 | null, now: number, heard: number): Track | null {
  if (!at) return null;
  const pose: Pose = { at, quat: UPRIGHT };
  if (!before) return new Track(pose, now);
  const last = before.newest.at;
  if (last[0] !== at[0] || last[1] !== at[1] || last[2] !== at[2]) before.add(pose, now, heard);
  return before;
}

/** The same of joints. */
export function turned(before: JointTrack | null, joints: readonly number[] | null, now: number, heard: number): JointTrack | null {
  if (!joints) return null;
  if (!before) return new JointTrack(joints, now);
  if (before.newest.some((angle, i) => angle !== joints[i])) before.add(joints, now, heard);
  return before;
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
