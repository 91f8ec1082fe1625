// Which piece a ray meets, or which is at a hand: pieces as cones about their axes, by numbers alone.
import { turned } from "./frames";
import { kindOf, type Geometry, type PieceView, type Vec3 } from "./types";

export interface Ray {
  readonly from: Vec3;
  /** Of length 1. */
  readonly way: Vec3;
}

/** How much more than its own thickness a piece may be missed by, mm. */
const SLACK = 2;

export function pick(ray: Ray, pieces: readonly PieceView[], geometry: Geometry): PieceView | null {
  let best: PieceView | null = null;
  let nearest = Infinity;
  for (const piece of pieces) {
    const along = meets(ray, piece, geometry);
    if (along !== null && along < nearest) [best, nearest] = [piece, along];
  }
  return best;
}

function meets(ray: Ray, piece: PieceView, geometry: Geometry): number | null {
  const shape = geometry.shapes[kindOf(piece.letter)];
  if (!shape) return null;
  const axis = turned(piece.quaternion, [0, 0, 1]);
  const { along, up, apart } = closest(ray, piece.at, axis, shape.height);
  const share = up / shape.height;
  const low = shape.base_diameter / 2;
  const radius = share < 0.15 ? low : Math.max(low + (shape.head_diameter / 2 - low) * share, shape.head_diameter / 2);
  return along > 0 && apart < radius + SLACK ? along : null;
}

/** Of a ray and a segment: where on each they come closest, and how close. */
function closest(ray: Ray, foot: Vec3, axis: Vec3, length: number): { along: number; up: number; apart: number } {
  const between = minus(foot, ray.from);
  const cosine = dot(ray.way, axis);
  const [alongRay, alongAxis] = [dot(between, ray.way), dot(between, axis)];
  const bend = 1 - cosine * cosine;
  const free = bend < 1e-6 ? 0 : (cosine * alongRay - alongAxis) / bend;
  const up = Math.min(Math.max(free, 0), length);
  const point: Vec3 = [foot[0] + axis[0] * up, foot[1] + axis[1] * up, foot[2] + axis[2] * up];
  const along = dot(minus(point, ray.from), ray.way);
  const apart = minus(point, [ray.from[0] + ray.way[0] * along, ray.from[1] + ray.way[1] * along, ray.from[2] + ray.way[2] * along]);
  return { along, up, apart: Math.hypot(...apart) };
}

/** Where a ray meets the level `z`; null when it never does. */
export function onLevel(ray: Ray, z: number): Vec3 | null {
  const along = (z - ray.from[2]) / ray.way[2];
  if (!Number.isFinite(along) || along <= 0) return null;
  return [ray.from[0] + ray.way[0] * along, ray.from[1] + ray.way[1] * along, z];
}

/** The piece nearest to a hand, mm, if it is in reach: measured to its axis. */
export function atHand(hand: Vec3, pieces: readonly PieceView[], geometry: Geometry, reach: number): PieceView | null {
  let best: PieceView | null = null;
  let nearest = reach;
  for (const piece of pieces) {
    const shape = geometry.shapes[kindOf(piece.letter)];
    if (!shape) continue;
    const axis = turned(piece.quaternion, [0, 0, 1]);
    const up = Math.min(Math.max(dot(minus(hand, piece.at), axis), 0), shape.height);
    const point: Vec3 = [piece.at[0] + axis[0] * up, piece.at[1] + axis[1] * up, piece.at[2] + axis[2] * up];
    const apart = Math.hypot(...minus(hand, point));
    if (apart < nearest) [best, nearest] = [piece, apart];
  }
  return best;
}

function minus(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
