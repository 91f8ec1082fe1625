// An arm: base, turret, links of two plates each, motors and wrist, and the hand. Made from the table of its
// links by Denavit and Hartenberg, so that any arm is drawn; the Lab-Volt 5150 has the proportions.
import { CylinderGeometry, Group, Matrix4, Quaternion, Vector3 } from "three";
import { box, solid, type Materials } from "./furniture";
import { Gripper } from "./gripper";
import type { Robot, Stance } from "./robot";
import type { Geometry, Vec3 } from "./types";

export type ArmGeometry = NonNullable<Geometry["arm"]>;
type Link = ArmGeometry["links"][number];

/** A link longer than this is a pair of plates, mm. */
const LONG = 40;
const PLATE = 6;
const FOOT = 150;
/** Half the distance of the plates of the first, second, third long link, mm: one folds into the other. */
const GAPS = [36, 28, 22];

/** The frame after a joint in that before it. */
export function linkMatrix(link: Link, angle: number): Matrix4 {
  const turned = new Matrix4().makeRotationZ(angle + link.offset);
  return turned.multiply(afterLink(link));
}

/** The link's own frame in that of the body that turns with its joint. */
function afterLink(link: Link): Matrix4 {
  return new Matrix4().makeTranslation(link.a, 0, link.d).multiply(new Matrix4().makeRotationX(link.alpha));
}

export class Arm implements Robot {
  readonly root = new Group();
  readonly #links: readonly Link[];
  readonly #home: readonly number[];
  /** One for each joint, turning about its z axis. */
  readonly #bodies: Group[] = [];
  readonly gripper: Gripper;
  readonly #hangs: boolean;

  constructor(arm: ArmGeometry, gripper: Geometry["gripper"], materials: Materials) {
    this.#links = arm.links;
    this.#home = arm.home;
    let parent: Group = this.root;
    for (const link of arm.links) {
      const body = new Group();
      const after = new Group();
      afterLink(link).decompose(after.position, after.quaternion, after.scale);
      body.add(after);
      parent.add(body);
      this.#bodies.push(body);
      parent = after;
    }
    this.#hangs = gripper.plumb;
    this.gripper = new Gripper(gripper, materials);
    // The hand's z runs back to the palm, against the way the arm points; it closes along the tool's y axis.
    const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI);
    const close = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), Math.PI / 2 + gripper.closing_axis);
    this.gripper.root.quaternion.copy(turn.multiply(close));
    parent.add(this.gripper.root);
    this.#paint(materials);
    this.pose({ tool: [0, 0, 0], joints: null }, gripper.opening / 2);
  }

  pose({ joints }: Stance, gap: number): void {
    this.#bodies.forEach((body, i) => {
      body.rotation.z = (joints?.[i] ?? this.#home[i] ?? 0) + (this.#links[i]?.offset ?? 0);
    });
    this.gripper.close(gap);
    if (this.#hangs) this.gripper.hang(this.#plumb());
  }

  /** By how much the pads hang from the fingers' line, rad. */
  #plumb(): number {
    this.root.updateWorldMatrix(true, true);
    const up = new Vector3(0, 0, 1).transformDirection(this.root.matrixWorld);
    const local = up.transformDirection(this.gripper.root.matrixWorld.clone().invert());
    return Math.atan2(-local.y, local.z);
  }

  seenFrom(): void {
    // Nothing of it stands between the board and where one looks from.
  }

  dispose(): void {
    // Geometries go with the stage, materials with the view.
  }

  #paint(m: Materials): void {
    const [turret] = this.#bodies;
    if (turret) this.#base(turret, this.#links[0]?.d ?? 0, m);
    let long = 0;
    this.#links.forEach((link, i) => {
      const body = this.#bodies[i];
      if (body && Math.abs(link.a) > LONG) plates(body, link.a, GAPS[Math.min(long++, GAPS.length - 1)] ?? 20, m);
    });
    this.#bodies.at(-2)?.add(tube([0, 0, -24], [0, 0, 24], 19, m.dark));
    const end = this.#links.at(-1)?.d ?? 0;
    this.#bodies.at(-1)?.add(tube([0, 0, 0], [0, 0, 0.35 * end], 15, m.steel));
  }

  /** A box on the table, a turntable on it, and two cheeks that hold the shoulder. */
  #base(turret: Group, height: number, m: Materials): void {
    const [foot, neck] = [0.42 * height, 0.5 * height];
    const top = height - neck;
    this.root.add(box([FOOT, FOOT, foot], [0, 0, foot / 2], m.enamel, 6));
    this.root.add(box([FOOT + 36, FOOT + 36, 8], [0, 0, 4], m.dark, 3));
    this.root.add(tube([0, 0, foot], [0, 0, neck], 62, m.dark));
    turret.add(tube([0, 0, neck], [0, 0, neck + 0.16 * top], 58, m.enamel));
    turret.add(box([52, 2 * (GAPS[0] ?? 36), 0.4 * top], [0, 0, neck + 0.3 * top], m.dark, 4));
    for (const side of [-1, 1]) {
      const y = side * ((GAPS[0] ?? 36) + 2 * PLATE);
      turret.add(box([68, PLATE, 0.92 * top], [0, y, neck + 0.58 * top], m.enamel, 2));
      turret.add(tube([0, y - side * 2, height], [0, y + side * 14, height], 30, m.dark));
      turret.add(tube([0, y + side * 14, height], [0, y + side * 16, height], 12, m.accent));
    }
  }
}

/** Two plates from joint to joint with a drum on each axis and a rod between. */
function plates(body: Group, length: number, gap: number, m: Materials): void {
  const across = 0.62 * gap + 6;
  for (const side of [-1, 1]) {
    body.add(box([Math.abs(length), 2 * across, PLATE], [length / 2, 0, side * gap], m.enamel, 2));
    for (const x of [0, length]) {
      body.add(tube([x, 0, side * (gap - PLATE / 2)], [x, 0, side * (gap + PLATE / 2 + 1)], across, m.enamel));
    }
  }
  body.add(tube([0, 0, -gap], [0, 0, gap], 0.7 * across, m.dark));
  body.add(tube([length, 0, -gap], [length, 0, gap], 0.55 * across, m.steel));
  body.add(tube([length / 2, 0, -gap], [length / 2, 0, gap], 5, m.steel));
}

function tube(from: Vec3, to: Vec3, radius: number, material: Materials["steel"]): ReturnType<typeof solid> {
  const way = new Vector3(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  const mesh = solid(
    new CylinderGeometry(radius, radius, way.length(), 36),
    [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2],
    material,
  );
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), way.normalize());
  return mesh;
}
