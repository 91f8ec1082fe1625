// The robot's hand: a palm and two fingers with notched pads. Origin at the tool point, z towards the palm.
import { ExtrudeGeometry, Group, Shape as Path } from "three";
import { box, softBox, solid, upright, type Materials } from "./furniture";
import type { Geometry } from "./types";

export class Gripper {
  readonly root = new Group();
  readonly #fingers: readonly [Group, Group];
  readonly pads: Group[] = [];

  constructor(
    private readonly sizes: Geometry["gripper"],
    materials: Materials,
  ) {
    this.#fingers = [this.#finger(-1, materials), this.#finger(1, materials)];
    this.#palm(materials);
    this.root.add(...this.#fingers);
  }

  /** `gap` is from the tool point to each pad, mm. */
  close(gap: number): void {
    const shift = this.sizes.opening / 2 - gap;
    this.#fingers[0].position.x = shift;
    this.#fingers[1].position.x = -shift;
  }

  /** Turns the pads about the closing axis, rad: those on pivots hang plumb when the hand tilts. */
  hang(angle: number): void {
    for (const pad of this.pads) pad.rotation.x = angle;
  }

  #palm(m: Materials): void {
    const { finger_length: length, palm_radius: radius, opening } = this.sizes;
    this.root.add(upright(0.86 * radius, 22, [0, 0, length + 17], m.dark));
    this.root.add(upright(0.86 * radius, 3, [0, 0, length + 29.5], m.aluminium, 0.8 * radius));
    this.root.add(upright(0.88 * radius, 2.4, [0, 0, length + 9], m.accent));
    this.root.add(box([opening + 34, 15, 10], [0, 0, length + 2], m.steel, 2));
  }

  /** A shank from the palm down, and a pad with a notch that takes a stem between its two faces. */
  #finger(side: number, m: Materials): Group {
    const { opening, finger_thickness: thick, finger_width: wide, finger_length: length, below_tool: below } = this.sizes;
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
    const hung = new Group().add(solid(pad, [0, 0, 0], m.pad));
    this.pads.push(hung);
    return finger.add(hung);
  }
}
