// What stands on the table beside the pieces: board, trays, and the gantry with its hand.
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

function solid(geometry: BufferGeometry, at: Vec3, material: Material): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.position.set(...at);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

function upright(radius: number, height: number, at: Vec3, material: Material, top = radius): Mesh {
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

/** The gantry: rails on the table, a portal along x, a carriage along y, a pole along z, and the hand. */
export class Gantry {
  readonly root = new Group();
  readonly hand = new Group();
  readonly #portal = new Group();
  readonly #carriage = new Group();
  readonly #pole = new Group();
  readonly #fingers: readonly [Group, Group];
  readonly #padOpen: number;
  /** The portal's two columns: at the near side of White, and at that of Black. */
  readonly #columns: Mesh[] = [];
  readonly #clear: Material;

  constructor(
    private readonly geometry: Geometry,
    private readonly materials: Materials,
  ) {
    const { gripper } = geometry;
    this.#clear = materials.aluminium.clone();
    Object.assign(this.#clear, { transparent: true, opacity: 0.2, depthWrite: false });
    this.#padOpen = gripper.opening / 2;
    this.#fingers = [this.#finger(-1, materials), this.#finger(1, materials)];
    this.#frame(materials);
    this.#palm(materials);
    this.hand.rotation.z = gripper.closing_axis;
    this.hand.add(...this.#fingers);
    this.#pole.add(this.hand);
    this.#carriage.add(this.#pole);
    this.#portal.add(this.#carriage);
    this.root.add(this.#portal);
  }

  /** `gap` is from the tool point to each pad, mm. */
  pose([x, y, z]: Vec3, gap: number): void {
    this.#portal.position.x = x;
    this.#carriage.position.y = y;
    this.#pole.position.z = z;
    const shift = this.#padOpen - gap;
    this.#fingers[0].position.x = shift;
    this.#fingers[1].position.x = -shift;
  }

  /** Lets an eye at `y`, robot frame, see through the column that stands before it. */
  seenFrom(y: number): void {
    const { lower, upper } = this.geometry.space;
    const hides = [y < lower[1] - 60, y > upper[1] + 60];
    this.#columns.forEach((column, i) => (column.material = hides[i] ? this.#clear : this.materials.aluminium));
  }

  dispose(): void {
    this.#clear.dispose();
  }

  #frame(m: Materials): void {
    const { lower, upper } = this.geometry.space;
    const floor = -this.geometry.board.thickness + this.geometry.board.origin[2];
    const [x0, y0] = lower;
    const [x1, y1, z1] = upper;
    const [beam, middle] = [24, (x0 + x1) / 2];
    const level = z1 + this.#palmTop + 40;
    for (const y of [y0 - 60, y1 + 60]) {
      this.root.add(box([x1 - x0 + 150, beam, 14], [middle, y, floor + 7], m.aluminium, 2));
      this.root.add(box([x1 - x0 + 120, 6, 4], [middle, y, floor + 15.5], m.steel, 1));
      for (const x of [x0 - 82, x1 + 82]) this.root.add(box([16, beam + 8, 22], [x, y, floor + 11], m.dark, 3));
      const column = box([beam, beam, level - floor - 40], [0, y, (level + floor + 16) / 2], m.aluminium, 2.5);
      this.#columns.push(column);
      this.#portal.add(column);
      this.#portal.add(box([96, beam + 10, 26], [0, y, floor + 31], m.dark, 5));
      this.#portal.add(box([40, beam + 12, 40], [0, y, level - 4], m.dark, 5));
      for (const wheel of [-32, 32]) {
        const roll = solid(new CylinderGeometry(9, 9, 8, 24), [wheel, y, floor + 24], m.steel);
        this.#portal.add(roll);
      }
    }
    const long = y1 - y0 + 120 + beam;
    this.#portal.add(box([beam, long, beam], [0, (y0 + y1) / 2, level], m.aluminium, 2.5));
    this.#portal.add(box([3, long - 40, 5], [beam / 2 + 1, (y0 + y1) / 2, level], m.dark, 1));
    this.#carriage.add(box([30, 74, 58], [20, 0, level], m.dark, 6));
    this.#carriage.add(box([3, 50, 8], [36, 0, level + 14], m.accent, 1));
    this.#carriage.add(upright(15, 34, [20, 0, level + 46], m.steel));
    this.#carriage.add(upright(5, 8, [20, 0, level + 66], m.dark));
    const pole = z1 - lower[2] + 110;
    this.#pole.add(box([14, 14, pole], [27, 0, this.#palmTop + pole / 2], m.aluminium, 2));
    this.#pole.add(box([46, 20, 10], [13, 0, this.#palmTop + 5], m.dark, 3));
  }

  get #palmTop(): number {
    return this.geometry.gripper.finger_length + 30;
  }

  #palm(m: Materials): void {
    const { finger_length: length, palm_radius: radius, opening } = this.geometry.gripper;
    this.hand.add(upright(0.86 * radius, 22, [0, 0, length + 17], m.dark));
    this.hand.add(upright(0.86 * radius, 3, [0, 0, length + 29.5], m.aluminium, 0.8 * radius));
    this.hand.add(upright(0.88 * radius, 2.4, [0, 0, length + 9], m.accent));
    this.hand.add(box([opening + 34, 15, 10], [0, 0, length + 2], m.steel, 2));
  }

  /** A shank from the palm down, and a pad with a notch that takes a stem between its two faces. */
  #finger(side: number, m: Materials): Group {
    const { opening, finger_thickness: thick, finger_width: wide, finger_length: length, below_tool: below } = this.geometry.gripper;
    const finger = new Group();
    const out = opening / 2 + thick;
    const shank = softBox(thick * 0.5, 11, length + below, 1.4);
    finger.add(solid(shank, [side * (out - thick * 0.25), 0, (length - below) / 2], m.aluminium));
    const path = new Path();
    const [face, half, deep] = [opening / 2, wide / 2, Math.min(0.3 * wide, thick * 0.7)];
    path.moveTo(face, -half).lineTo(face + deep, 0).lineTo(face, half).lineTo(out, half * 0.72).lineTo(out, -half * 0.72).closePath();
    const pad = new ExtrudeGeometry(path, { depth: below + 3, bevelSize: 0.5, bevelThickness: 0.5, bevelSegments: 1 });
    pad.translate(0, 0, -below);
    if (side < 0) pad.rotateZ(Math.PI);
    finger.add(solid(pad, [0, 0, 0], m.pad));
    return finger;
  }
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
