// The gantry with its hand.
import { CylinderGeometry, Group, type Material, type Mesh } from "three";
import { box, solid, upright, type Materials } from "./furniture";
import { Gripper } from "./gripper";
import type { Robot, Stance } from "./robot";
import type { Geometry, Vec3 } from "./types";

/** The gantry: rails on the table, a portal along x, a carriage along y, a pole along z, and the hand. */
export class Gantry implements Robot {
  readonly root = new Group();
  readonly #hand: Gripper;
  readonly #portal = new Group();
  readonly #carriage = new Group();
  readonly #pole = new Group();
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
    this.#hand = new Gripper(gripper, materials);
    this.#frame(materials);
    this.#hand.root.rotation.z = gripper.closing_axis;
    this.#pole.add(this.#hand.root);
    this.#carriage.add(this.#pole);
    this.#portal.add(this.#carriage);
    this.root.add(this.#portal);
  }

  /** `gap` is from the tool point to each pad, mm. */
  pose({ tool: [x, y, z] }: Stance, gap: number): void {
    this.#portal.position.x = x;
    this.#carriage.position.y = y;
    this.#pole.position.z = z;
    this.#hand.close(gap);
  }

  /** Lets an eye, robot frame, see through the column that stands before it. */
  seenFrom([, y]: Vec3): void {
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
}
