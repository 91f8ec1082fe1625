import { Mesh, type BufferGeometry, type Material, type Object3D } from "three";
import { distance } from "./frames";
import { matrixOf } from "./pieces";
import type { PieceView, Quat, Vec3 } from "./types";

/** A ghost fades once the piece is so near to where it was meant to go, mm, or after so long, ms. */
const ARRIVED = 12;
const GHOST_MS = 15_000;

/** A pale piece where the real one is meant to go. */
export class Ghost {
  readonly #mesh: Mesh;

  constructor(
    parent: Object3D,
    shape: BufferGeometry,
    material: Material,
    readonly id: number,
    private readonly at: Vec3,
    quat: Quat,
    private readonly since: number,
  ) {
    this.#mesh = new Mesh(shape, material);
    this.#mesh.applyMatrix4(matrixOf({ at, quat }));
    parent.add(this.#mesh);
  }

  /** Whether it has done: its piece is there, or gone. */
  arrived(piece: PieceView | undefined): boolean {
    return !piece || distance(piece.at, this.at) < ARRIVED;
  }

  faded(now: number): boolean {
    return now - this.since > GHOST_MS;
  }

  remove(): void {
    this.#mesh.removeFromParent();
  }
}
