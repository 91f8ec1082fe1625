// The robot's frame and the board's: where squares and slots are, and which one a point is over.
import type { Geometry, Quat, Vec2, Vec3 } from "./types";

export function turned([w, x, y, z]: Quat, [a, b, c]: Vec3): Vec3 {
  const [p, q, r] = [y * c - z * b, z * a - x * c, x * b - y * a];
  return [
    a + 2 * (w * p + y * r - z * q),
    b + 2 * (w * q + z * p - x * r),
    c + 2 * (w * r + x * q - y * p),
  ];
}

export function inverse([w, x, y, z]: Quat): Quat {
  return [w, -x, -y, -z];
}

/** Angle about z, rad. */
export function yaw([w, x, y, z]: Quat): number {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

export function toRobot(geometry: Geometry, onBoard: Vec3): Vec3 {
  const [x, y, z] = turned(geometry.board.quaternion, onBoard);
  const [a, b, c] = geometry.board.origin;
  return [x + a, y + b, z + c];
}

export function toBoard(geometry: Geometry, inRobot: Vec3): Vec3 {
  const [a, b, c] = geometry.board.origin;
  return turned(inverse(geometry.board.quaternion), [inRobot[0] - a, inRobot[1] - b, inRobot[2] - c]);
}

export function squareCentre(geometry: Geometry, square: string): Vec3 {
  const side = geometry.board.square;
  const file = square.charCodeAt(0) - 97;
  const rank = square.charCodeAt(1) - 49;
  return toRobot(geometry, [(file + 0.5) * side, (rank + 0.5) * side, 0]);
}

/** Square that a point is over; null beside the board. */
export function squareAt(geometry: Geometry, point: Vec3): string | null {
  const [x, y] = toBoard(geometry, point);
  const file = Math.floor(x / geometry.board.square);
  const rank = Math.floor(y / geometry.board.square);
  if (file < 0 || file > 7 || rank < 0 || rank > 7) return null;
  return String.fromCharCode(97 + file, 49 + rank);
}

/** Name of the tray's slot that a point is over; null where there is none. */
export function slotAt(geometry: Geometry, point: Vec3): string | null {
  for (const tray of geometry.trays) {
    const slot = tray.slots.find((one) => Math.hypot(one.at[0] - point[0], one.at[1] - point[1]) < tray.pitch / 2);
    if (slot) return slot.name;
  }
  return null;
}

export function boardCentre(geometry: Geometry): Vec3 {
  const half = 4 * geometry.board.square;
  return toRobot(geometry, [half, half, 0]);
}

export function distance(a: Vec2 | Vec3, b: Vec2 | Vec3): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1]);
}
