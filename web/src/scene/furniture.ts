// What stands on the table beside the pieces: board, trays, the person's hand.
import {
  BoxGeometry,
  type BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  Group,
  type Material,
  Mesh,
  MeshStandardMaterial,
  Quaternion,
  Shape as Path,
  ExtrudeGeometry,
  SphereGeometry,
  Vector3,
} from "three";
import type { Geometry, Vec3 } from "./types";

/** A box whose edges catch the light. Its middle is at the origin. */
export function softBox(x: number, y: number, z: number, bevel = 2): BufferGeometry {
  const b = Math.min(bevel, x / 3, y / 3, z / 3);
  const path = new Path();
  const [w, h] = [x / 2 - b, y / 2 - b];
  path.moveTo(-w, -h).lineTo(w, -h).lineTo(w, h).lineTo(-w, h).closePath();
  const geometry = new ExtrudeGeometry(path, { depth: z - 2 * b, bevelSize: b, bevelThickness: b, bevelSegments: 2, steps: 1 });
  return geometry.translate(0, 0, -(z - 2 * b) / 2);
}

export interface Materials {
  readonly boardTop: Material;
  readonly frame: Material;
  readonly tray: Material;
  readonly slot: Material;
  readonly aluminium: Material;
  readonly enamel: Material;
  readonly steel: Material;
  readonly dark: Material;
  readonly accent: Material;
  readonly pad: Material;
  readonly skin: Material;
  readonly sleeve: Material;
}

export function box(size: Vec3, at: Vec3, material: Material, bevel = 2): Mesh {
  return solid(softBox(...size, bevel), at, material);
}

export function solid(geometry: BufferGeometry, at: Vec3, material: Material): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.position.set(...at);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

export function upright(radius: number, height: number, at: Vec3, material: Material, top = radius): Mesh {
  return solid(new CylinderGeometry(top, radius, height, 32).rotateX(Math.PI / 2), at, material);
}

/** In the board's frame. */
export function makeBoard(geometry: Geometry, materials: Materials): Group {
  const { square, border, thickness } = geometry.board;
  const [side, middle] = [8 * square + 2 * border, 4 * square];
  const group = new Group();
  const slab = softBox(side, side, thickness, 2.5).translate(middle, middle, -thickness / 2 - 0.05);
  const body = solid(slab, [0, 0, 0], materials.frame);
  const top = new Mesh(new BoxGeometry(side - 3, side - 3, 0.1).translate(middle, middle, 0), [
    materials.frame,
    materials.frame,
    materials.frame,
    materials.frame,
    materials.boardTop,
    materials.frame,
  ]);
  top.receiveShadow = true;
  group.add(body, top);
  return group;
}

const TRAY_MM = 8;

/** In the robot's frame: slots are known there. */
export function makeTray(tray: Geometry["trays"][number], turn: number, materials: Materials): Group {
  const group = new Group();
  const first = tray.slots[0]?.at ?? [0, 0, 0];
  group.position.set(...first);
  group.rotation.z = turn;
  const [wide, long] = [tray.columns * tray.pitch, tray.rows * tray.pitch];
  const middle: Vec3 = [((tray.columns - 1) * tray.pitch) / 2, ((tray.rows - 1) * tray.pitch) / 2, -TRAY_MM / 2];
  group.add(box([wide, long, TRAY_MM], middle, materials.tray, 2.5));
  const ring = new CylinderGeometry(0.4 * tray.pitch, 0.4 * tray.pitch, 0.2, 40).rotateX(Math.PI / 2);
  for (let column = 0; column < tray.columns; column++) {
    for (let row = 0; row < tray.rows; row++) {
      const dish = new Mesh(ring, materials.slot);
      dish.position.set(column * tray.pitch, row * tray.pitch, 0.02);
      dish.receiveShadow = true;
      group.add(dish);
    }
  }
  return group;
}

// The virtual person's right hand, thumb and forefinger together; origin between the finger tips, x to the elbow.
type Limb = readonly [from: Vec3, to: Vec3, radius: number];
const FINGERS: readonly Limb[] = [
  [[1, 8, 3], [20, 15, 24], 6.6],
  [[20, 15, 24], [46, 19, 46], 7.6],
  [[46, 19, 46], [84, 18, 55], 9],
  [[1, -8, 3], [22, -22, 26], 7.8],
  [[22, -22, 26], [58, -25, 44], 9.4],
  [[58, -25, 44], [98, -16, 56], 12],
  [[19, 24, 12], [30, 30, 32], 6.6],
  [[30, 30, 32], [54, 31, 50], 7.6],
  [[54, 31, 50], [88, 27, 56], 9],
  [[31, 37, 18], [40, 42, 36], 6],
  [[40, 42, 36], [62, 40, 50], 7],
  [[62, 40, 50], [92, 34, 56], 8.5],
  [[42, 47, 25], [50, 50, 39], 5.4],
  [[50, 50, 39], [70, 47, 50], 6.2],
  [[70, 47, 50], [96, 38, 55], 7.5],
];
const WRIST: Limb = [[112, 6, 59], [176, 3, 82], 24];
const SLEEVE: readonly Limb[] = [
  [[176, 3, 82], [400, 0, 176], 31],
  [[400, 0, 176], [640, 0, 262], 37],
];

export function makeHand(materials: Materials): Group {
  const group = new Group();
  for (const limb of [...FINGERS, WRIST]) group.add(capsule(limb, materials.skin));
  for (const limb of SLEEVE) group.add(capsule(limb, materials.sleeve));
  const palm = solid(new SphereGeometry(1, 28, 20).scale(38, 36, 16), [100, 7, 57], materials.skin);
  palm.rotation.y = -0.16;
  group.add(palm);
  const cuff = solid(new CylinderGeometry(33, 34, 20, 36), [181, 3, 84], materials.sleeve);
  cuff.quaternion.copy(along([176, 3, 82], [400, 0, 176]));
  group.add(cuff);
  return group;
}

function along(from: Vec3, to: Vec3): Quaternion {
  const way = new Vector3(...to).sub(new Vector3(...from)).normalize();
  return new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), way);
}

function capsule([from, to, radius]: Limb, material: Material): Mesh {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  const mesh = solid(
    new CapsuleGeometry(radius, length, 8, 20),
    [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2],
    material,
  );
  mesh.quaternion.copy(along(from, to));
  return mesh;
}

export function standard(color: string, roughness: number, metalness = 0): MeshStandardMaterial {
  return new MeshStandardMaterial({ color, roughness, metalness });
}
