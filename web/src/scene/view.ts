// The 3D view of one table on one canvas. It draws only when something looks other than before.
import {
  NeutralToneMapping,
  Group,
  Mesh,
  MeshStandardMaterial,
  PCFShadowMap,
  PerspectiveCamera,
  Raycaster,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { Arm } from "./arm";
import { eyeOf, keyed, Orbit, presetView, type Preset, type View } from "./camera";
import { decide, mayTake, snapped, targets, type Decision, type Rules } from "./drag";
import { boardCentre, distance, squareAt, squareCentre, toRobot, yaw } from "./frames";
import { makeBoard, makeHand, makeTray } from "./furniture";
import { Gantry } from "./gantry";
import { Ghost } from "./ghost";
import { Marks, type MarkKind } from "./marks";
import { makeMaterials, type AllMaterials } from "./materials";
import { DELAY_MS, Glide, tracked, turned, UPRIGHT, type JointTrack, type Pose, type Track } from "./motion";
import { Pace } from "./pace";
import { onLevel, pick, type Ray } from "./picking";
import { Pieces } from "./pieces";
import type { Robot } from "./robot";
import { hasGraphicsCard, Room, TABLE_HEIGHT, type Theme } from "./room";
import { kindOf, type Geometry, type PieceView, type SceneView, type Vec3 } from "./types";
import { boardTexture } from "./wood";

export interface Wishes {
  readonly theme: Theme;
  readonly calm: boolean;
  readonly side: "white" | "black";
  /** Reflections and fine shadows, whatever draws; undefined: where a graphics card does. */
  readonly rich?: boolean | undefined;
}

export interface Hooks {
  /** A piece was set down. */
  readonly dropped: (decision: Decision, piece: PieceView) => void;
  /** The graphics card took the picture away, or gave it back. */
  readonly lost: (lost: boolean) => void;
}

const FIELD = 36;
/** How high a piece hangs while it is dragged, mm. */
const LIFTED = 26;
const NO_RULES: Rules = { legal: [], personToMove: false, hand: false };

interface Held {
  readonly piece: PieceView;
  at: Vec3;
}

export class TableView {
  readonly renderer: WebGLRenderer;
  readonly camera = new PerspectiveCamera(FIELD, 1, 0.02, 12);
  readonly room: Room;
  /** Millimetres of the robot's frame inside, metres of the room outside. */
  readonly stage = new Group();
  geometry: Geometry | null = null;
  pieces: Pieces | null = null;
  rules: Rules = NO_RULES;
  /** Asks what a pawn becomes, where the page's own question cannot be seen. */
  chooser: ((decision: Extract<Decision, { kind: "promotion" }>, piece: PieceView) => void) | null = null;
  /** Called before each picture, with the time of what it shows; returns whether to go on. */
  readonly attendants = new Set<(now: number) => boolean>();
  #orbit: Orbit;
  #preset: Preset | null = "player";
  #robot: Robot | null = null;
  #person: Group | null = null;
  #marks: Marks | null = null;
  #tool: Track | null = null;
  #joints: JointTrack | null = null;
  #hand: Track | null = null;
  #handGone = 0;
  #heard = -Infinity;
  #gap = new Glide(0, 140);
  #held: Held | null = null;
  #ghost: Ghost | null = null;
  readonly #materials: AllMaterials;
  #wishes: Wishes;
  #frame = 0;
  #again = true;
  #shadows = true;
  #sizes = { width: 1, height: 1, ratio: 1 };
  #pace = new Pace();
  #shownAt = 0;
  #preparing = false;

  constructor(
    readonly canvas: HTMLCanvasElement,
    wishes: Wishes,
    private readonly hooks: Hooks,
  ) {
    this.#wishes = wishes;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.toneMapping = NeutralToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    const rich = wishes.rich ?? hasGraphicsCard(this.renderer);
    this.room = new Room(this.renderer, rich);
    this.room.light(wishes.theme);
    this.room.scene.add(this.stage);
    this.#materials = makeMaterials(rich);
    this.#orbit = new Orbit(presetView("player", 0.6, 1.5, wishes.side));
    canvas.addEventListener("webglcontextlost", this.#onLost);
    canvas.addEventListener("webglcontextrestored", this.#onRestored);
  }

  // --- what is shown ------------------------------------------------------------------------------------------

  setGeometry(geometry: Geometry): void {
    this.#clear();
    this.geometry = geometry;
    const [x, y, z] = boardCentre(geometry);
    const turn = yaw(geometry.board.quaternion);
    const inner = new Group();
    inner.position.set(-x, -y, -z);
    const turned = new Group().add(inner);
    turned.rotation.z = -turn;
    const upright = new Group().add(turned);
    upright.rotation.x = -Math.PI / 2;
    upright.scale.setScalar(0.001);
    upright.position.y = TABLE_HEIGHT;
    this.stage.add(upright);
    this.room.furnish(geometry);
    const top = this.#materials.boardTop as MeshStandardMaterial;
    top.map?.dispose();
    top.map = boardTexture(geometry, this.renderer.capabilities.getMaxAnisotropy());
    top.needsUpdate = true;
    const board = makeBoard(geometry, this.#materials);
    board.position.set(...geometry.board.origin);
    const [w, i, j, k] = geometry.board.quaternion;
    board.quaternion.set(i, j, k, w);
    this.#robot = geometry.arm ? new Arm(geometry.arm, geometry.gripper, this.#materials) : new Gantry(geometry, this.#materials);
    this.#robot.root.visible = false;
    this.#person = makeHand(this.#materials);
    this.#person.visible = false;
    this.#marks = new Marks(geometry);
    this.pieces = new Pieces(geometry, this.#materials.white, this.#materials.black);
    inner.add(board, ...geometry.trays.map((tray) => makeTray(tray, turn, this.#materials)));
    inner.add(this.#robot.root, this.#person, this.#marks.root, this.pieces.root);
    this.#gap = new Glide(geometry.gripper.opening / 2, 140);
    if (this.#preset) this.look(this.#preset, true);
    this.touch();
  }

  setScene(scene: SceneView | null): void {
    if (!this.geometry || !this.pieces) return;
    const now = performance.now();
    this.pieces.set(scene?.pieces ?? [], now);
    this.#tool = tracked(this.#tool, scene?.tool ?? null, now, this.#heard);
    this.#joints = turned(this.#joints, scene?.joints ?? null, now, this.#heard);
    if (scene?.hand) this.#hand = tracked(this.#hand, scene.hand, now, this.#heard);
    else if (this.#hand && !this.#handGone) this.#handGone = now;
    if (scene?.hand) this.#handGone = 0;
    this.#heard = now;
    if (scene) this.#gap.aim(this.#gapOf(scene), now + DELAY_MS);
    if (this.#ghost?.arrived(this.pieces?.get(this.#ghost.id))) this.#dropGhost();
    this.touch();
  }

  mark(kind: MarkKind, squares: readonly string[]): void {
    if (this.#marks?.set(kind, squares)) this.touch();
  }

  wish(wishes: Wishes): void {
    const before = this.#wishes;
    this.#wishes = wishes;
    if (before.theme !== wishes.theme) this.room.light(wishes.theme);
    if (before.side !== wishes.side && this.#preset) this.look(this.#preset);
    this.touch();
  }

  resize(width: number, height: number): void {
    if (width < 1 || height < 1 || this.renderer.xr.isPresenting) return;
    const refit = this.#sizes.width === 1;
    this.#sizes = { width, height, ratio: Math.min(devicePixelRatio, 2) };
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setPixelRatio(this.#sizes.ratio * this.#pace.share);
    this.renderer.setSize(width, height, false);
    if (this.#preset && (refit || this.#preset !== "follow")) this.look(this.#preset, true);
    if (!this.#preparing && !refit) this.#draw();
  }

  // --- the eye ------------------------------------------------------------------------------------------------

  look(preset: Preset, atOnce = false): void {
    this.#preset = preset;
    const to = presetView(preset, this.#reach(), this.camera.aspect, this.#wishes.side);
    this.#orbit.fly(to, performance.now(), atOnce || this.#wishes.calm ? 0 : 900);
    this.touch();
  }

  /** Look from there, at once. */
  lookFrom(view: View): void {
    this.#preset = null;
    this.#orbit.fly(view, 0, 0);
    this.touch();
  }

  /** Answers whether the key was one of the view's. */
  key(key: string): boolean {
    const to = keyed(this.#orbit.view, key);
    if (!to) return false;
    this.#orbit.fly(to, performance.now(), this.#wishes.calm ? 0 : 160);
    if (this.#preset !== "follow") this.#preset = null;
    this.touch();
    return true;
  }

  turn(right: number, down: number): void {
    const scale = Math.PI / Math.max(this.#sizes.height, 200);
    this.#orbit.turn(right * scale, down * scale);
    if (this.#preset !== "follow") this.#preset = null;
    this.touch();
  }

  pan(right: number, down: number): void {
    const scale = (1.3 * this.#orbit.view.distance) / Math.max(this.#sizes.height, 200);
    this.#orbit.pan(-right * scale, -down * scale);
    this.#preset = null;
    this.touch();
  }

  zoom(factor: number): void {
    this.#orbit.zoom(factor);
    if (this.#preset !== "follow") this.#preset = null;
    this.touch();
  }

  // --- taking pieces ------------------------------------------------------------------------------------------

  /** The ray through a point of the canvas, CSS pixels, in the robot's frame. */
  ray(x: number, y: number): Ray {
    this.#stand();
    const caster = new Raycaster();
    const at = new Vector2((x / this.#sizes.width) * 2 - 1, 1 - (y / this.#sizes.height) * 2);
    caster.setFromCamera(at, this.camera);
    return this.rayOf(caster.ray.origin, caster.ray.direction);
  }

  rayOf(from: Vector3, way: Vector3): Ray {
    const start = this.toTable(from);
    const end = this.toTable(from.clone().add(way));
    const step: Vec3 = [end[0] - start[0], end[1] - start[1], end[2] - start[2]];
    const length = Math.hypot(...step) || 1;
    return { from: start, way: [step[0] / length, step[1] / length, step[2] / length] };
  }

  /** From the room (m) to the robot's frame (mm). */
  toTable(point: Vector3): Vec3 {
    const inner = this.#robot?.root.parent;
    if (!inner) return [0, 0, 0];
    inner.updateWorldMatrix(true, false);
    const { x, y, z } = inner.worldToLocal(point.clone());
    return [x, y, z];
  }

  toRoom(point: Vec3): Vector3 {
    const inner = this.#robot?.root.parent;
    inner?.updateWorldMatrix(true, false);
    return inner ? inner.localToWorld(new Vector3(...point)) : new Vector3();
  }

  /** Where on the canvas, CSS pixels, a point so high above the middle of a square is seen. */
  pointOf(square: string, height = 0): { x: number; y: number } {
    if (!this.geometry) return { x: 0, y: 0 };
    this.#stand();
    const [x, y, z] = squareCentre(this.geometry, square);
    const seen = this.toRoom([x, y, z + height]).project(this.camera);
    return { x: ((seen.x + 1) / 2) * this.#sizes.width, y: ((1 - seen.y) / 2) * this.#sizes.height };
  }

  /** The piece under a point of the canvas that may be taken. */
  takeable(x: number, y: number): PieceView | null {
    if (!this.geometry || !this.pieces) return null;
    const piece = pick(this.ray(x, y), this.pieces.all, this.geometry);
    return piece && mayTake(piece, this.geometry, this.rules) ? piece : null;
  }

  hover(piece: PieceView | null): void {
    if (this.pieces?.hover(piece?.id ?? null)) this.touch();
  }

  take(piece: PieceView): void {
    if (!this.geometry) return;
    this.#dropGhost();
    this.#held = { piece, at: piece.at };
    const to = targets(piece, this.geometry, this.rules);
    const taken = new Set((this.pieces?.all ?? []).map((other) => squareAt(this.geometry!, other.at)));
    this.mark("target", to.filter((square) => !taken.has(square)));
    this.mark("capture", to.filter((square) => taken.has(square)));
    this.#show(this.#held.at, LIFTED / 2);
  }

  get holding(): PieceView | null {
    return this.#held?.piece ?? null;
  }

  /** Square that the held piece would go to. */
  get aim(): string | null {
    return this.#held && this.geometry ? squareAt(this.geometry, this.#held.at) : null;
  }

  /** The held piece follows the pointer over the board. */
  dragTo(x: number, y: number): void {
    if (!this.#held || !this.geometry) return;
    const over = onLevel(this.ray(x, y), boardCentre(this.geometry)[2] + LIFTED / 2);
    if (over) this.carry([over[0], over[1], boardCentre(this.geometry)[2]], LIFTED);
  }

  /** The held piece is over a point, so high above it. */
  carry(over: Vec3, lift: number): void {
    if (!this.#held || !this.geometry) return;
    const bound = this.#bounded(over);
    this.#held.at = snapped(this.#held.piece, bound, this.geometry, this.rules);
    const square = squareAt(this.geometry, bound);
    this.mark("aim", square && targets(this.#held.piece, this.geometry, this.rules).includes(square) ? [square] : []);
    this.#show(bound, lift);
  }

  mayTake(piece: PieceView): boolean {
    return this.geometry !== null && mayTake(piece, this.geometry, this.rules);
  }

  drop(): Decision {
    if (!this.#held || !this.geometry) return { kind: "nothing" };
    const { piece, at } = this.#held;
    const decision = decide(this.pieces?.get(piece.id) ?? piece, at, this.geometry, this.rules);
    this.letGo();
    if (decision.kind === "move" || decision.kind === "promotion" || decision.kind === "hand_carry") this.#haunt(piece, at);
    if (decision.kind === "promotion" && this.chooser) this.chooser(decision, piece);
    else this.give(decision, piece);
    return decision;
  }

  give(decision: Decision, piece: PieceView): void {
    this.hooks.dropped(decision, piece);
  }

  /** Back to where it really is. */
  letGo(): void {
    if (!this.#held) return;
    this.pieces?.override(this.#held.piece.id, null);
    this.#held = null;
    for (const kind of ["target", "capture", "aim"] as const) this.mark(kind, []);
    this.touch();
  }

  /** What was asked for is not going to happen. */
  forget(): void {
    this.#dropGhost();
    this.touch();
  }

  get side(): "white" | "black" {
    return this.#wishes.side;
  }

  /** z of the playing surface, mm. */
  get level(): number {
    return this.geometry ? boardCentre(this.geometry)[2] : 0;
  }

  // --- pictures -----------------------------------------------------------------------------------------------

  /** Something looks other than before. */
  touch(): void {
    this.#again = true;
    if (!this.#frame && !this.renderer.xr.isPresenting) this.#frame = requestAnimationFrame(this.#tick);
  }

  readonly #tick = (now: number): void => {
    this.#frame = 0;
    if (this.#sizes.width === 1 || this.#preparing) return;
    this.#again = false;
    this.advance(now);
    this.#draw();
    this.#pace.note(now);
    if (this.#again || this.#moving(now)) {
      this.#resample();
      this.#frame = requestAnimationFrame(this.#tick);
    } else if (this.#pace.rest()) {
      this.#resample();
      this.#draw();
    }
  };

  /** Everything to where it is to be seen at `now`, ms. */
  advance(now: number): void {
    const time = now - DELAY_MS;
    this.#shadows = (this.pieces?.show(time) ?? false) || this.#shadows;
    if (this.#tool && this.#robot) {
      this.#robot.root.visible = true;
      if (this.#robotMovesAfter(this.#shownAt) || this.#gap.movesAfter(this.#shownAt) || this.#again) this.#shadows = true;
      this.#robot.pose({ tool: this.#tool.at(time).at, joints: this.#joints?.at(time) ?? null }, this.#gap.at(now));
    } else if (this.#robot) this.#robot.root.visible = false;
    this.#reachOut(time);
    this.#orbit.advance(now);
    if (this.#preset === "follow" && this.#tool) this.#follow(this.#tool.at(time));
    if (this.#marks?.pulsing && !this.#wishes.calm) this.#marks.pulse(0.5 + 0.5 * Math.sin(now / 300));
    if (this.#ghost?.faded(now)) this.#dropGhost();
    let go = false;
    for (const attendant of this.attendants) go = attendant(now) || go;
    if (go) this.#again = true;
    this.#shownAt = time;
  }

  /** The camera to where one looks from, drawn or not. */
  #stand(): void {
    this.camera.position.set(...this.#inRoom(eyeOf(this.#orbit.view)));
    this.camera.lookAt(...this.#inRoom(this.#orbit.view.target));
    this.camera.updateMatrixWorld();
  }

  #draw(): void {
    if (!this.renderer.xr.isPresenting) {
      this.#stand();
      this.#robot?.seenFrom(this.toTable(this.camera.position));
    }
    if (this.#shadows) this.renderer.shadowMap.needsUpdate = true;
    this.#shadows = false;
    this.renderer.render(this.room.scene, this.camera);
  }

  /** Programs for the graphics card, made without holding up the page where the browser can. */
  async prepare(): Promise<void> {
    if (!this.renderer.getContext().getExtension("KHR_parallel_shader_compile")) return;
    this.#preparing = true;
    try {
      await this.renderer.compileAsync(this.room.scene, this.camera);
    } finally {
      this.#preparing = false;
    }
    this.touch();
  }

  /** From a headset back onto the page. */
  back(): void {
    this.camera.rotation.set(0, 0, 0);
    this.camera.fov = FIELD;
    const { width, height } = this.#sizes;
    this.resize(width, height);
    this.touch();
  }

  /** For a headset: draw at its pace. */
  drawFor(now: number): void {
    this.advance(now);
    this.#draw();
  }

  #moving(now: number): boolean {
    const time = now - DELAY_MS;
    return (
      (this.pieces?.movesAfter(time) ?? false) ||
      this.#robotMovesAfter(time) ||
      (this.#hand !== null && (this.#hand.movesAfter(time) || this.#handGone > time)) ||
      this.#gap.movesAfter(now) ||
      this.#orbit.movesAfter(now) ||
      (!this.#wishes.calm && (this.#marks?.pulsing ?? false))
    );
  }

  #robotMovesAfter(time: number): boolean {
    return (this.#tool?.movesAfter(time) ?? false) || (this.#joints?.movesAfter(time) ?? false);
  }

  #resample(): void {
    const ratio = this.#sizes.ratio * this.#pace.share;
    if (Math.abs(this.renderer.getPixelRatio() - ratio) > 0.01) this.renderer.setPixelRatio(ratio);
  }

  #inRoom([x, y, z]: readonly [number, number, number]): [number, number, number] {
    return [x, y + TABLE_HEIGHT, z];
  }

  /** The person's hand, its forearm towards the person. */
  #reachOut(time: number): void {
    if (!this.#person || !this.#hand || !this.geometry) return;
    const gone = this.#handGone > 0 && time >= this.#handGone;
    if (this.#person.visible === gone) this.#shadows = true;
    this.#person.visible = !gone;
    if (gone) {
      this.#hand = null;
      return;
    }
    const tip = this.#hand.at(time).at;
    const shoulder = toRobot(this.geometry, [4 * this.geometry.board.square, -800, 0]);
    this.#person.position.set(...tip);
    this.#person.rotation.z = Math.atan2(shoulder[1] - tip[1], shoulder[0] - tip[0]);
    this.#shadows = true;
  }

  #follow(pose: Pose): void {
    const { x, y, z } = this.toRoom(pose.at);
    const [a, b, c] = this.#orbit.view.target;
    const near = (from: number, to: number): number => from + (to - from) * (this.#wishes.calm ? 1 : 0.08);
    const to = [near(a, x), near(b, y - TABLE_HEIGHT), near(c, z)] as const;
    if (Math.hypot(to[0] - a, to[1] - b, to[2] - c) > 2e-4) this.#again = true;
    this.#orbit.look(to);
  }

  #reach(): number {
    if (!this.geometry) return 0.6;
    const middle = boardCentre(this.geometry);
    const slots = this.geometry.trays.flatMap((tray) => tray.slots.map((slot) => distance(slot.at, middle) * 0.9));
    // An arm stands high behind the board: its shoulder should be in the picture.
    const room = this.geometry.arm ? 1.35 : 1;
    return (room * 2 * Math.max(4.4 * this.geometry.board.square, ...slots)) / 1000;
  }

  /** Half the way between the pads: open, on a stem, or closed on nothing. */
  #gapOf(scene: SceneView): number {
    if (!this.geometry) return 0;
    const { gripper, shapes } = this.geometry;
    if (!scene.closed || !scene.tool) return gripper.opening / 2;
    const tool = scene.tool;
    const held = scene.pieces.find((piece) => distance(piece.at, tool) < gripper.opening / 2 && piece.at[2] < tool[2] && tool[2] < piece.at[2] + 90);
    const shape = held && shapes[kindOf(held.letter)];
    return shape ? shape.grip_diameter / 2 : 1.5;
  }

  #bounded([x, y, z]: Vec3): Vec3 {
    const space = this.geometry?.space;
    if (!space) return [x, y, z];
    const keep = (value: number, low: number, high: number): number => Math.min(Math.max(value, low), high);
    return [keep(x, space.lower[0], space.upper[0]), keep(y, space.lower[1], space.upper[1]), z];
  }

  #show([x, y, z]: Vec3, lift: number): void {
    if (!this.#held) return;
    this.pieces?.override(this.#held.piece.id, { at: [x, y, z + lift], quat: this.geometry?.board.quaternion ?? UPRIGHT });
    this.touch();
  }

  /** A pale piece where the real one is meant to go. */
  #haunt(piece: PieceView, at: Vec3): void {
    const shape = this.pieces?.shape(kindOf(piece.letter));
    const parent = this.pieces?.root;
    if (!shape || !parent || !this.geometry) return;
    const { quaternion } = this.geometry.board;
    this.#ghost = new Ghost(parent, shape, this.#materials.ghost, piece.id, at, quaternion, performance.now());
    this.touch();
  }

  #dropGhost(): void {
    this.#ghost?.remove();
    this.#ghost = null;
  }

  readonly #onLost = (event: Event): void => {
    event.preventDefault();
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.hooks.lost(true);
  };

  readonly #onRestored = (): void => {
    this.room.light(this.#wishes.theme);
    this.#shadows = true;
    this.hooks.lost(false);
    this.touch();
  };

  #clear(): void {
    this.#dropGhost();
    this.#held = null;
    this.pieces?.dispose();
    this.#marks?.dispose();
    this.#robot?.dispose();
    this.stage.traverse((thing) => {
      if (thing instanceof Mesh && !(thing.parent === this.pieces?.root)) thing.geometry.dispose();
    });
    this.stage.clear();
    this.#tool = this.#hand = this.#joints = null;
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    this.canvas.removeEventListener("webglcontextlost", this.#onLost);
    this.canvas.removeEventListener("webglcontextrestored", this.#onRestored);
    this.#clear();
    this.room.dispose();
    for (const material of Object.values(this.#materials)) {
      if (material instanceof MeshStandardMaterial) material.map?.dispose();
      material.dispose();
    }
    this.renderer.setAnimationLoop(null);
    this.renderer.dispose();
  }
}
