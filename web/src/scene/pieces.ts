// All pieces in twelve draws: one instanced mesh for each kind and colour, and the dark spots below them.
import {
  Color,
  Group,
  InstancedMesh,
  Matrix4,
  MeshBasicMaterial,
  type MeshStandardMaterial,
  PlaneGeometry,
  Quaternion,
  type BufferGeometry,
  Vector3,
} from "three";
import { boardCentre, slotAt, squareAt } from "./frames";
import { pieceGeometry } from "./meshes";
import { Track, type Pose } from "./motion";
import { isWhite, KINDS, kindOf, type Geometry, type Kind, type PieceView, type Vec3 } from "./types";
import { spotTexture } from "./wood";

const MOST = 40;
const PLAIN = new Color(1, 1, 1);
const HOVERED = new Color(1.22, 1.2, 1.12);
const SPOT_LIFT = 40;

interface Known {
  piece: PieceView;
  readonly track: Track;
  /** Its instance among those of its kind and colour. */
  place: number;
}

export class Pieces {
  readonly root = new Group();
  readonly #meshes = new Map<string, InstancedMesh>();
  readonly #known = new Map<number, Known>();
  readonly #overrides = new Map<number, Pose>();
  readonly #spots: InstancedMesh;
  readonly #shapes = new Map<Kind, BufferGeometry>();
  #heard = -Infinity;
  #hovered: number | null = null;
  /** Something was set that the next `show` has to write, whatever the time. */
  #stale = true;
  #shown = -Infinity;

  constructor(
    private readonly geometry: Geometry,
    white: MeshStandardMaterial,
    black: MeshStandardMaterial,
  ) {
    for (const kind of KINDS) {
      const shape = geometry.shapes[kind];
      if (!shape) continue;
      const turned = pieceGeometry(kind, shape);
      this.#shapes.set(kind, turned);
      for (const [key, material] of [
        [kind, white],
        [kind.toLowerCase(), black],
      ] as const) {
        const mesh = new InstancedMesh(turned, material, MOST);
        mesh.count = 0;
        mesh.castShadow = mesh.receiveShadow = true;
        mesh.frustumCulled = false;
        this.#meshes.set(key, mesh);
        this.root.add(mesh);
      }
    }
    const spot = new MeshBasicMaterial({ map: spotTexture(), color: 0x0a0603, transparent: true, opacity: 0.5, depthWrite: false });
    this.#spots = new InstancedMesh(new PlaneGeometry(1, 1), spot, MOST * 2);
    this.#spots.count = 0;
    this.#spots.frustumCulled = false;
    this.#spots.renderOrder = 1;
    this.root.add(this.#spots);
  }

  get all(): readonly PieceView[] {
    return [...this.#known.values()].map((known) => known.piece);
  }

  get(id: number): PieceView | undefined {
    return this.#known.get(id)?.piece;
  }

  shape(kind: Kind): BufferGeometry | undefined {
    return this.#shapes.get(kind);
  }

  /** All pieces as they are known now, heard at `time`, ms. */
  set(pieces: readonly PieceView[], time: number): void {
    const gone = new Set(this.#known.keys());
    for (const piece of pieces) {
      gone.delete(piece.id);
      const known = this.#known.get(piece.id);
      const pose: Pose = { at: piece.at, quat: piece.quaternion };
      if (!known || known.piece.letter !== piece.letter) {
        this.#known.set(piece.id, { piece, track: new Track(pose, time), place: 0 });
        this.#stale = true;
      } else if (known.piece !== piece) {
        known.track.add(pose, time, this.#heard);
        known.piece = piece;
      }
    }
    for (const id of gone) {
      this.#known.delete(id);
      this.#overrides.delete(id);
      this.#stale = true;
    }
    this.#heard = time;
    if (this.#stale) this.#number();
  }

  /** Where a piece is shown instead of where it is; null for where it is. */
  override(id: number, pose: Pose | null): void {
    if (pose) this.#overrides.set(id, pose);
    else this.#overrides.delete(id);
    this.#stale = true;
  }

  hover(id: number | null): boolean {
    if (id === this.#hovered) return false;
    this.#hovered = id;
    this.#stale = true;
    return true;
  }

  /** Where it was, is or will be seen at `time`. */
  seen(id: number, time: number): Pose | null {
    return this.#overrides.get(id) ?? this.#known.get(id)?.track.at(time) ?? null;
  }

  movesAfter(time: number): boolean {
    for (const known of this.#known.values()) if (known.track.movesAfter(time)) return true;
    return false;
  }

  /** Writes the poses of `time`; returns whether anything is other than at the last time. */
  show(time: number): boolean {
    const all = this.#stale;
    let changed = all;
    let spot = 0;
    for (const [id, known] of this.#known) {
      if (all || known.track.movesAfter(this.#shown)) {
        const pose = this.#overrides.get(id) ?? known.track.at(time);
        this.#write(known, id, pose);
        this.#writeSpot(spot, known, pose);
        changed = true;
      }
      spot++;
    }
    if (changed) this.#written(spot);
    this.#stale = false;
    this.#shown = time;
    return changed;
  }

  #number(): void {
    const counts = new Map<string, number>();
    for (const known of this.#known.values()) {
      const key = known.piece.letter;
      known.place = counts.get(key) ?? 0;
      counts.set(key, Math.min(known.place + 1, MOST));
    }
    for (const [key, mesh] of this.#meshes) mesh.count = counts.get(key) ?? 0;
    this.#spots.count = Math.min(this.#known.size, 2 * MOST);
  }

  #write(known: Known, id: number, pose: Pose): void {
    const mesh = this.#meshes.get(known.piece.letter);
    if (!mesh || known.place >= MOST) return;
    mesh.setMatrixAt(known.place, matrixOf(pose, mirrored(known.piece, this.geometry)));
    mesh.setColorAt(known.place, id === this.#hovered ? HOVERED : PLAIN);
  }

  #writeSpot(index: number, known: Known, { at }: Pose): void {
    const shape = this.geometry.shapes[kindOf(known.piece.letter)];
    const surface = surfaceBelow(this.geometry, at);
    const high = Math.max(at[2] - surface, 0);
    const size = shape ? shape.base_diameter * 1.75 * Math.max(1 - high / SPOT_LIFT, 0) : 0;
    SPOT.compose(SPOT_AT.set(at[0], at[1], surface + 0.35), UPRIGHT, SPOT_SIZE.set(size, size, 1));
    this.#spots.setMatrixAt(index, SPOT);
  }

  #written(count: number): void {
    for (const mesh of this.#meshes.values()) {
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    this.#spots.count = Math.min(count, 2 * MOST);
    this.#spots.instanceMatrix.needsUpdate = true;
  }

  dispose(): void {
    for (const mesh of this.#meshes.values()) mesh.dispose();
    for (const shape of this.#shapes.values()) shape.dispose();
    this.#spots.dispose();
  }
}

const SPOT = new Matrix4();
const SPOT_AT = new Vector3();
const SPOT_SIZE = new Vector3();
const UPRIGHT = new Quaternion();
const ABOUT_Z = new Vector3(0, 0, 1);

/** Knights of both colours look at each other at first; the twin turns pieces at random, and so they are. */
function mirrored(piece: PieceView, geometry: Geometry): number {
  if (geometry.live || kindOf(piece.letter) !== "N") return 0;
  return isWhite(piece.letter) ? Math.PI / 2 : -Math.PI / 2;
}

export function matrixOf({ at, quat }: Pose, turn = 0): Matrix4 {
  const attitude = new Quaternion(quat[1], quat[2], quat[3], quat[0]);
  if (turn) attitude.multiply(new Quaternion().setFromAxisAngle(ABOUT_Z, turn));
  return new Matrix4().compose(new Vector3(...at), attitude, new Vector3(1, 1, 1));
}

/** z of whatever a thing at that point would stand on. */
export function surfaceBelow(geometry: Geometry, at: Vec3): number {
  if (squareAt(geometry, at)) return boardCentre(geometry)[2];
  const slot = slotAt(geometry, at);
  if (slot) for (const tray of geometry.trays) for (const one of tray.slots) if (one.name === slot) return one.at[2];
  return geometry.board.origin[2] - geometry.board.thickness;
}
