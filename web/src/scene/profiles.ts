// Outlines of turned chessmen after Staunton, made from the sizes that the robot knows: radius and height, mm.
// The foot is as wide as the base, the stem as thick as the grip at the grip's height, nothing above it is
// wider than the head, and the top is at the height.
import type { Kind, Shape } from "./types";

export type Outline = readonly (readonly [radius: number, height: number])[];

class Turner {
  readonly points: [number, number][] = [];

  to(radius: number, height: number): this {
    this.points.push([Math.max(radius, 0), height]);
    return this;
  }

  /** A quarter of an ellipse; it leaves along the radius first, or along the height first. */
  quarter(radius: number, height: number, first: "out" | "up", steps = 6): this {
    const [r0, h0] = this.last();
    for (let i = 1; i <= steps; i++) {
      const angle = (Math.PI / 2) * (i / steps);
      const [quick, slow] = [Math.sin(angle), 1 - Math.cos(angle)];
      const [a, b] = first === "out" ? [quick, slow] : [slow, quick];
      this.to(r0 + (radius - r0) * a, h0 + (height - h0) * b);
    }
    return this;
  }

  /** A half-round moulding that stands out by `out` and comes back to `radius`. */
  bead(radius: number, height: number, out: number, steps = 8): this {
    const [r0, h0] = this.last();
    for (let i = 1; i <= steps; i++) {
      const share = i / steps;
      const bulge = Math.sin(Math.PI * share) * out;
      this.to(r0 + (radius - r0) * share + bulge, h0 + (height - h0) * (1 - Math.cos(Math.PI * share)) * 0.5);
    }
    return this;
  }

  /** A smooth way through further points (Catmull-Rom). */
  through(points: readonly (readonly [number, number])[], steps = 6): this {
    const way = [this.last(), ...points];
    for (let i = 0; i + 1 < way.length; i++) {
      const [a, b, c, d] = [way[Math.max(i - 1, 0)], way[i], way[i + 1], way[Math.min(i + 2, way.length - 1)]];
      if (!a || !b || !c || !d) continue;
      for (let j = 1; j <= steps; j++) {
        const s = j / steps;
        this.to(spline(a[0], b[0], c[0], d[0], s), spline(a[1], b[1], c[1], d[1], s));
      }
    }
    return this;
  }

  last(): readonly [number, number] {
    return this.points.at(-1) ?? [0, 0];
  }
}

function spline(a: number, b: number, c: number, d: number, s: number): number {
  const curve = 2 * a - 5 * b + 4 * c - d;
  return b + 0.5 * s * (c - a + s * (curve + s * (3 * (b - c) + d - a)));
}

/** Where the stem ends and the head's collar begins. */
function neckHeight(kind: Kind, shape: Shape): number {
  const above = shape.height - shape.grip_height;
  const share: Record<Kind, number> = { K: 0.36, Q: 0.4, B: 0.3, N: 0.3, R: 0.32, P: 0.3 };
  return shape.grip_height + share[kind] * above;
}

/** From the middle of the bottom to the middle of the top. */
export function outline(kind: Kind, shape: Shape): Outline {
  const turner = foot(new Turner(), shape);
  if (kind === "N") return plinth(turner, shape).points;
  stem(turner, kind, shape);
  HEADS[kind](turner, shape, neckHeight(kind, shape));
  return turner.points;
}

function footHeight(shape: Shape): number {
  return Math.min(9, 0.16 * shape.height);
}

function foot(turner: Turner, shape: Shape): Turner {
  const [wide, tall] = [shape.base_diameter / 2, footHeight(shape)];
  return turner
    .to(0, 0)
    .to(0.95 * wide, 0)
    .quarter(wide, 0.12 * tall, "out", 3)
    .to(wide, 0.42 * tall)
    .quarter(0.88 * wide, 0.72 * tall, "up", 6)
    .to(0.83 * wide, 0.72 * tall)
    .to(0.83 * wide, 0.8 * tall)
    .bead(0.77 * wide, 1.12 * tall, 0.05 * wide, 8);
}

/** Hollow sweep from the foot to the thickness that the gripper closes on, and on to the collar. */
function stem(turner: Turner, kind: Kind, shape: Shape): Turner {
  const [wide, grip, tall] = [shape.base_diameter / 2, shape.grip_diameter / 2, footHeight(shape)];
  const low = 1.12 * tall;
  const rise = shape.grip_height - low;
  const neck = neckHeight(kind, shape);
  turner.to(0.72 * wide, low);
  turner.through([
    [grip + 0.42 * (0.72 * wide - grip), low + 0.22 * rise],
    [grip + 0.13 * (0.72 * wide - grip), low + 0.58 * rise],
    [grip, shape.grip_height],
  ]);
  return turner.to(0.97 * grip, neck);
}

/** What the horse stands on. */
function plinth(turner: Turner, shape: Shape): Turner {
  const [wide, tall] = [shape.base_diameter / 2, footHeight(shape)];
  return turner
    .quarter(0.62 * wide, 1.7 * tall, "up", 5)
    .bead(0.6 * wide, 2.0 * tall, 0.06 * wide, 6)
    .to(0, 2.0 * tall);
}

/** Height at which the horse's neck leaves the plinth. */
export function horseFoot(shape: Shape): number {
  return 1.9 * footHeight(shape);
}

function collar(turner: Turner, head: number, neck: number, tall: number): Turner {
  return turner
    .to(0.86 * head, neck + 0.02 * tall)
    .bead(0.84 * head, neck + 0.24 * tall, 0.12 * head, 6)
    .to(0.66 * head, neck + 0.28 * tall)
    .bead(0.62 * head, neck + 0.42 * tall, 0.08 * head, 5);
}

type Head = (turner: Turner, shape: Shape, neck: number) => void;

const HEADS: Record<Exclude<Kind, "N">, Head> & { N: Head } = {
  P(turner, shape, neck) {
    const [head, top] = [shape.head_diameter / 2, shape.height];
    const radius = Math.min(head, 0.46 * (top - neck));
    turner.to(0.98 * head, neck).bead(0.9 * head, neck + 0.14 * (top - neck), 0.02 * head, 5);
    turner.to(0.55 * head, neck + 0.2 * (top - neck));
    ball(turner, head, Math.max(top - 2 * radius, neck + 0.2 * (top - neck)), top, 0.55 * head);
  },
  R(turner, shape, neck) {
    const [head, top] = [shape.head_diameter / 2, shape.height];
    const above = top - neck;
    collar(turner, 0.86 * head, neck, 0.5 * above);
    turner.to(0.62 * head, neck + 0.22 * above);
    turner.quarter(0.97 * head, neck + 0.45 * above, "up", 5).to(head, neck + 0.46 * above).to(head, top);
    turner.to(0.7 * head, top).to(0.68 * head, top - 0.24 * above).to(0, top - 0.26 * above);
  },
  N(turner, shape) {
    turner.to(0, shape.height);
  },
  B(turner, shape, neck) {
    const [head, top] = [shape.head_diameter / 2, shape.height];
    const above = top - neck;
    collar(turner, 0.98 * head, neck, 0.5 * above);
    const low = neck + 0.21 * above;
    turner.to(0.5 * head, low);
    turner.through(
      [
        [0.86 * head, low + 0.14 * above],
        [head, low + 0.27 * above],
        [0.86 * head, low + 0.42 * above],
        [0.52 * head, low + 0.57 * above],
        [0.14 * head, low + 0.66 * above],
      ],
      5,
    );
    ball(turner, 0.2 * head, low + 0.66 * above, top, 0.14 * head);
  },
  Q(turner, shape, neck) {
    const [head, top] = [shape.head_diameter / 2, shape.height];
    const above = top - neck;
    collar(turner, 0.95 * head, neck, 0.5 * above);
    const low = neck + 0.21 * above;
    turner.to(0.56 * head, low);
    turner.through(
      [
        [0.64 * head, low + 0.22 * above],
        [0.84 * head, low + 0.42 * above],
        [head, low + 0.53 * above],
      ],
      6,
    );
    turner.to(0.95 * head, low + 0.56 * above).to(0.78 * head, low + 0.53 * above);
    turner.quarter(0.2 * head, low + 0.68 * above, "up", 6);
    ball(turner, 0.2 * head, low + 0.68 * above, top, 0.15 * head);
  },
  K(turner, shape, neck) {
    const [head, top] = [shape.head_diameter / 2, shape.height];
    const above = top - neck - crossHeight(shape);
    collar(turner, 0.98 * head, neck, 0.55 * above);
    const low = neck + 0.23 * above;
    turner.to(0.58 * head, low);
    turner.through(
      [
        [0.66 * head, low + 0.25 * above],
        [0.84 * head, low + 0.5 * above],
        [head, low + 0.62 * above],
      ],
      6,
    );
    turner.to(0.96 * head, low + 0.65 * above);
    turner.quarter(0.24 * head, low + 0.77 * above, "up", 6);
    turner.to(0.16 * head, low + 0.77 * above).to(0.14 * head, low + 0.8 * above).to(0, low + 0.8 * above);
  },
};

/** Height of the king's cross, which ends at the king's. */
export function crossHeight(shape: Shape): number {
  return 0.27 * (shape.height - shape.grip_height);
}

function ball(turner: Turner, radius: number, low: number, top: number, neck: number): void {
  const from = Math.asin(Math.min(neck / radius, 1));
  const [middle, half] = ballMiddle(low, top, from);
  const steps = 10;
  for (let i = 0; i <= steps; i++) {
    const angle = from + (Math.PI - from) * (i / steps);
    turner.to(i === steps ? 0 : radius * Math.sin(angle), middle - half * Math.cos(angle));
  }
}

/** So that a ball whose bottom is cut off at an angle begins at `low` and ends at `top`. */
function ballMiddle(low: number, top: number, from: number): [number, number] {
  const half = (top - low) / (1 + Math.cos(from));
  return [top - half, half];
}

/** Thickness of an outline at a height, as a radius; the widest where it has several. */
export function radiusAt(points: Outline, height: number): number {
  let widest = 0;
  for (let i = 0; i + 1 < points.length; i++) {
    const [a, b] = [points[i], points[i + 1]];
    if (!a || !b || Math.min(a[1], b[1]) > height || Math.max(a[1], b[1]) < height) continue;
    const share = a[1] === b[1] ? 1 : (height - a[1]) / (b[1] - a[1]);
    widest = Math.max(widest, a[0] + (b[0] - a[0]) * share, a[1] === b[1] ? Math.max(a[0], b[0]) : 0);
  }
  return widest;
}

/** The horse along its spine: x forwards as a share of the head's radius, z as one of its height. */
export interface Section {
  readonly x: number;
  readonly z: number;
  /** Half size in the plane of the picture, and half thickness, shares of the head's radius. */
  readonly deep: number;
  readonly thick: number;
}

export const HORSE: readonly Section[] = [
  { x: -0.06, z: 0.0, deep: 0.8, thick: 0.7 },
  { x: -0.16, z: 0.12, deep: 0.74, thick: 0.62 },
  { x: -0.27, z: 0.3, deep: 0.66, thick: 0.52 },
  { x: -0.33, z: 0.48, deep: 0.58, thick: 0.44 },
  { x: -0.26, z: 0.65, deep: 0.52, thick: 0.4 },
  { x: -0.06, z: 0.775, deep: 0.46, thick: 0.38 },
  { x: 0.2, z: 0.79, deep: 0.41, thick: 0.37 },
  { x: 0.42, z: 0.71, deep: 0.34, thick: 0.33 },
  { x: 0.6, z: 0.61, deep: 0.26, thick: 0.26 },
  { x: 0.74, z: 0.53, deep: 0.22, thick: 0.23 },
  { x: 0.83, z: 0.475, deep: 0.2, thick: 0.22 },
];
