// Hold to move: whatever is held (a button, a key, a stick) is repeated to the robot until it is let go of.
export type Vector = readonly [x: number, y: number, z: number];

export interface Robot {
  jog(direction: Vector, speed: number): void;
  stop(): void;
}

/** Well within the robot's own patience, after which it stops by itself. */
export const REPEAT_MS = 100;
export const SPEEDS = [1, 5, 20, 60, 150, 300] as const;

export class Jogging {
  #held = new Map<string, Vector>();
  #timer: ReturnType<typeof setInterval> | undefined;
  #speed: number;

  constructor(
    private readonly robot: Robot,
    speed: number = SPEEDS[2],
    private readonly onChange: (direction: Vector | null) => void = () => {},
  ) {
    this.#speed = speed;
  }

  get moving(): boolean {
    return this.#timer !== undefined;
  }

  set speed(speed: number) {
    this.#speed = speed;
    if (this.moving) this.#send();
  }

  /** Something is held, or held otherwise than before: each source counts once. */
  hold(source: string, direction: Vector): void {
    const before = this.#held.get(source);
    if (before !== undefined && same(before, direction)) return;
    this.#held.set(source, direction);
    this.#update();
  }

  release(source: string): void {
    if (this.#held.delete(source)) this.#update();
  }

  /** Focus, page or connection are lost, or the robot refused: nobody holds anything any more. */
  releaseAll(): void {
    this.#held.clear();
    this.#update();
  }

  #update(): void {
    const direction = this.#direction();
    if (direction === null) {
      this.#rest();
      return;
    }
    if (!this.moving) this.#timer = setInterval(() => this.#send(), REPEAT_MS);
    this.#send();
    this.onChange(direction);
  }

  #rest(): void {
    if (!this.moving) return;
    clearInterval(this.#timer);
    this.#timer = undefined;
    this.robot.stop();
    this.onChange(null);
  }

  #send(): void {
    const direction = this.#direction();
    if (direction !== null) this.robot.jog(direction, this.#speed);
  }

  /** Of all that is held together; opposites rest. */
  #direction(): Vector | null {
    const sum = [0, 0, 0];
    for (const vector of this.#held.values()) vector.forEach((part, axis) => (sum[axis] = (sum[axis] ?? 0) + part));
    const [x, y, z] = sum.map((part) => Math.max(-1, Math.min(1, part)));
    return x || y || z ? [x ?? 0, y ?? 0, z ?? 0] : null;
  }
}

const KEYS: Readonly<Record<string, Vector>> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1],
  PageDown: [0, 0, -1],
};

/** What a key moves; undefined for all others, and for shortcuts. */
export function keyDirection(event: Pick<KeyboardEvent, "key" | "ctrlKey" | "altKey" | "metaKey">): Vector | undefined {
  return event.ctrlKey || event.altKey || event.metaKey ? undefined : KEYS[event.key];
}

/** The next of `SPEEDS`, up or down. */
export function nextSpeed(speed: number, up: boolean): number {
  const others = up ? SPEEDS.filter((one) => one > speed) : SPEEDS.filter((one) => one < speed).reverse();
  return others[0] ?? speed;
}

const DEAD_ZONE = 0.2;
const CROSS = { up: 12, down: 13, left: 14, right: 15 } as const;
const RAISE = 5;
const LOWER = 4;

/** Left stick or cross: x and y; right stick or shoulders: z. Sticks may be pushed a little. */
export function padDirection(pad: Pick<Gamepad, "axes" | "buttons">): Vector | null {
  const axis = (index: number) => {
    const value = pad.axes[index] ?? 0;
    return Math.abs(value) < DEAD_ZONE ? 0 : value;
  };
  const pressed = (index: number) => (pad.buttons[index]?.pressed ? 1 : 0);
  const x = axis(0) + pressed(CROSS.right) - pressed(CROSS.left);
  const y = -axis(1) + pressed(CROSS.up) - pressed(CROSS.down);
  const z = -axis(3) + pressed(RAISE) - pressed(LOWER);
  return x || y || z ? [clamp(x), clamp(y), clamp(z)] : null;
}

function clamp(value: number): number {
  return Math.round(100 * Math.max(-1, Math.min(1, value))) / 100;
}

function same(one: Vector, other: Vector): boolean {
  return one.every((part, axis) => part === other[axis]);
}
