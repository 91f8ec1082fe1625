// A table for tests, as GET /api/scene tells the default one, turned a little.
import { toRobot } from "./frames";
import type { Geometry, PieceView } from "./types";

const TURN = 0.1;
const SHAPE = { height: 45, base_diameter: 29, head_diameter: 18, grip_height: 24, grip_diameter: 13 };
const TALL = { height: 95, base_diameter: 38, head_diameter: 24, grip_height: 48, grip_diameter: 18 };

export const TABLE: Geometry = {
  robot_kind: "gantry",
  live: true,
  board: { origin: [150, 25, 1], quaternion: [Math.cos(TURN / 2), 0, 0, Math.sin(TURN / 2)], square: 50, border: 12, thickness: 20 },
  trays: [{ name: "left", pitch: 50, rows: 2, columns: 1, slots: [{ name: "left1", at: [60, 50, 1] }, { name: "left2", at: [60, 100, 1] }] }],
  gripper: { closing_axis: 0, plumb: false, opening: 31, finger_thickness: 8.4, finger_width: 20, below_tool: 7, finger_length: 95, palm_radius: 35 },
  space: { lower: [0, 0, 0], upper: [700, 450, 200] },
  shapes: { K: TALL, Q: TALL, R: TALL, B: TALL, N: TALL, P: SHAPE },
  arm: null,
};

/** A piece in the middle of a square, off by (x, y) mm in the board's frame. */
export function onSquare(id: number, letter: string, square: string, x = 0, y = 0): PieceView {
  const [file, rank] = [square.charCodeAt(0) - 97, square.charCodeAt(1) - 49];
  const at = toRobot(TABLE, [(file + 0.5) * 50 + x, (rank + 0.5) * 50 + y, 0]);
  return { id, letter, at: [...at], quaternion: [...TABLE.board.quaternion] };
}
