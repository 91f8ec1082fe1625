// Standing at the table in VR (WebXR): a controller, or a hand, takes a piece and sets it down. What that means
// is decided as for a mouse.
import {
  BufferGeometry,
  Group,
  Line,
  LineBasicMaterial,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  SphereGeometry,
  Vector3,
  type WebXRManager,
  type XRHandSpace,
  type XRTargetRaySpace,
} from "three";
import type { Decision } from "./drag";
import { squareCentre } from "./frames";
import { atHand, onLevel, pick } from "./picking";
import { kindOf, type PieceView, type Vec3 } from "./types";
import type { TableView } from "./view";

type Promotion = Extract<Decision, { kind: "promotion" }>;
type Source = "none" | "near" | "ray";

export interface VrSession {
  end(): void;
}

const HEADSETS = /OculusBrowser|Quest|Pico|Vive|Wolvic|Mobile VR/i;
/** From the board's middle to where one stands, m: at arm's length of the far side, clear of the table's edge. */
const STANDS_AT = 0.56;
/** How near a hand has to be to a piece to take it, mm. */
const REACH = 55;
/** From where a controller points to where it takes things, m, forwards. */
const TIP = 0.02;

export async function vrSupport(): Promise<"no" | "yes" | "insecure"> {
  if (!navigator.xr) return !isSecureContext && HEADSETS.test(navigator.userAgent) ? "insecure" : "no";
  return (await navigator.xr.isSessionSupported("immersive-vr").catch(() => false)) ? "yes" : "no";
}

/** @param allowed Whether pieces may be taken now. */
export async function enterVr(view: TableView, allowed: () => boolean, ended: () => void): Promise<VrSession> {
  const xr = navigator.xr;
  if (!xr) throw new Error("no WebXR");
  const session = await xr.requestSession("immersive-vr", {
    requiredFeatures: ["local-floor"],
    optionalFeatures: ["hand-tracking"],
  });
  const manager = view.renderer.xr;
  manager.enabled = true;
  manager.setReferenceSpaceType("local-floor");
  const visit = new Visit(view, manager, allowed);
  session.addEventListener("end", () => {
    visit.dispose();
    ended();
  });
  try {
    await manager.setSession(session);
  } catch (error) {
    await session.end().catch(() => undefined);
    throw error;
  }
  view.renderer.setAnimationLoop((now) => view.drawFor(now));
  return { end: () => void session.end().catch(() => undefined) };
}

/** Somebody at the table. */
class Visit {
  readonly #rig = new Group();
  readonly #hands: readonly Hand[];
  readonly #choice: Choice;

  constructor(
    private readonly view: TableView,
    private readonly manager: WebXRManager,
    allowed: () => boolean,
  ) {
    const black = view.side === "black";
    this.#rig.position.z = black ? -STANDS_AT : STANDS_AT;
    this.#rig.rotation.y = black ? Math.PI : 0;
    this.#rig.add(view.camera);
    view.room.scene.add(this.#rig);
    this.#choice = new Choice(view);
    view.chooser = (promotion, piece) => this.#choice.offer(promotion, piece);
    this.#hands = [0, 1].map((index) => new Hand(view, manager, index, this.#rig, this.#choice, allowed));
    view.attendants.add(this.#attend);
  }

  readonly #attend = (): boolean => {
    for (const hand of this.#hands) hand.attend();
    return true;
  };

  dispose(): void {
    this.view.attendants.delete(this.#attend);
    this.view.chooser = null;
    this.#choice.close();
    for (const hand of this.#hands) hand.dispose();
    this.view.renderer.setAnimationLoop(null);
    this.manager.enabled = false;
    this.#rig.remove(this.view.camera);
    this.#rig.removeFromParent();
    this.view.letGo();
    this.view.back();
  }
}

/** A controller or a tracked hand: pinching is selecting. */
class Hand {
  readonly #ray: XRTargetRaySpace;
  readonly #joints: XRHandSpace;
  readonly #tip = new Mesh(new SphereGeometry(0.008, 16, 12), new MeshStandardMaterial({ color: "#5fe0b0", roughness: 0.4 }));
  readonly #line = new Line(
    new BufferGeometry().setFromPoints([new Vector3(), new Vector3(0, 0, -1)]),
    new LineBasicMaterial({ color: "#5fe0b0", transparent: true, opacity: 0.35 }),
  );
  #source: XRInputSource | null = null;
  #holds: Source = "none";
  #aim: string | null = null;

  constructor(
    private readonly view: TableView,
    manager: WebXRManager,
    index: number,
    rig: Group,
    private readonly choice: Choice,
    private readonly allowed: () => boolean,
  ) {
    this.#ray = manager.getController(index);
    this.#joints = manager.getHand(index);
    this.#tip.position.z = -TIP;
    this.#ray.add(this.#line, this.#tip);
    rig.add(this.#ray, this.#joints);
    this.#ray.addEventListener("connected", this.#connected);
    this.#ray.addEventListener("disconnected", this.#disconnected);
    for (const name of ["selectstart", "squeezestart"] as const) this.#ray.addEventListener(name, this.#take);
    for (const name of ["selectend", "squeezeend"] as const) this.#ray.addEventListener(name, this.#release);
  }

  readonly #connected = (event: { data: XRInputSource }): void => {
    this.#source = event.data;
  };

  readonly #disconnected = (): void => {
    this.#source = null;
    if (this.#holds !== "none") this.view.letGo();
    this.#holds = "none";
  };

  /** Where it takes things, robot frame, mm; null while it is not seen. */
  #at(): Vec3 | null {
    if (!this.#source || !this.#ray.visible) return null;
    return this.view.toTable(this.#pinch() ?? this.#tip.getWorldPosition(new Vector3()));
  }

  /** Between thumb and forefinger of a tracked hand, in the room. */
  #pinch(): Vector3 | null {
    const [thumb, finger] = [this.#joints.joints["thumb-tip"], this.#joints.joints["index-finger-tip"]];
    if (!this.#source?.hand || !thumb?.visible || !finger?.visible) return null;
    return thumb.getWorldPosition(new Vector3()).lerp(finger.getWorldPosition(new Vector3()), 0.5);
  }

  #beam(): { from: Vec3; way: Vec3 } {
    const turn = new Matrix4().extractRotation(this.#ray.matrixWorld);
    return this.view.rayOf(this.#ray.getWorldPosition(new Vector3()), new Vector3(0, 0, -1).applyMatrix4(turn));
  }

  /** What it would take now. */
  #nearest(): { piece: PieceView; how: Source } | null {
    const { geometry, pieces } = this.view;
    if (!geometry || !pieces) return null;
    const at = this.#at();
    const near = at && atHand(at, pieces.all, geometry, REACH);
    if (near) return { piece: near, how: "near" };
    const far = pick(this.#beam(), pieces.all, geometry);
    return far ? { piece: far, how: "ray" } : null;
  }

  readonly #take = (): void => {
    if (this.choice.open) {
      if (this.choice.take(this.#at(), this.#beam())) this.#pulse(0.8, 60);
      return;
    }
    const found = this.#nearest();
    if (!found || !this.allowed() || this.view.holding || !this.view.mayTake(found.piece)) return;
    this.#holds = found.how;
    this.view.take(found.piece);
    this.#pulse(0.7, 50);
  };

  readonly #release = (): void => {
    if (this.#holds === "none") return;
    this.#holds = "none";
    this.#aim = null;
    const { kind } = this.view.drop();
    if (kind === "refused") this.#pulse(1, 260);
    else this.#pulse(0.5, 40);
  };

  attend(): void {
    this.#line.visible = this.#holds !== "near";
    if (this.#holds === "none") {
      const found = this.allowed() && !this.view.holding && !this.choice.open ? this.#nearest() : null;
      if (found && this.view.mayTake(found.piece)) this.view.hover(found.piece);
      return;
    }
    this.#carry();
    const aim = this.view.aim;
    if (aim !== this.#aim) this.#pulse(0.25, 15);
    this.#aim = aim;
  }

  #carry(): void {
    const { geometry, holding } = this.view;
    if (!geometry || !holding) return;
    const level = this.view.level;
    if (this.#holds === "ray") {
      const over = onLevel(this.#beam(), level);
      if (over) this.view.carry(over, 26);
      return;
    }
    const at = this.#at();
    const shape = geometry.shapes[kindOf(holding.letter)];
    if (!at || !shape) return;
    this.view.carry([at[0], at[1], level], Math.max(at[2] - level - 0.8 * shape.height, 0));
  }

  #pulse(strength: number, ms: number): void {
    const actuator = this.#source?.gamepad?.hapticActuators?.[0] as { pulse?: (strength: number, ms: number) => unknown } | undefined;
    actuator?.pulse?.(strength, ms);
  }

  dispose(): void {
    this.#ray.removeEventListener("connected", this.#connected);
    this.#ray.removeEventListener("disconnected", this.#disconnected);
    for (const name of ["selectstart", "squeezestart"] as const) this.#ray.removeEventListener(name, this.#take);
    for (const name of ["selectend", "squeezeend"] as const) this.#ray.removeEventListener(name, this.#release);
    this.#ray.remove(this.#line, this.#tip);
    this.#ray.removeFromParent();
    this.#joints.removeFromParent();
    for (const thing of [this.#line, this.#tip]) {
      thing.geometry.dispose();
      (thing.material as LineBasicMaterial | MeshStandardMaterial).dispose();
    }
  }
}

/** What a pawn becomes: four pieces that float over its square, to be taken. */
class Choice {
  readonly #root = new Group();
  readonly #material = new MeshBasicMaterial({ color: "#5fe0b0" });
  #offered: { readonly promotion: Promotion; readonly piece: PieceView; readonly places: readonly (readonly [string, Vec3])[] } | null = null;

  constructor(private readonly view: TableView) {}

  get open(): boolean {
    return this.#offered !== null;
  }

  offer(promotion: Promotion, piece: PieceView): void {
    const { geometry, pieces } = this.view;
    if (!geometry || !pieces) return;
    const [x, y, z] = squareCentre(geometry, promotion.to);
    const places = promotion.choices.map((uci, i): readonly [string, Vec3] => [uci, [x + (i - 1.5) * 60, y, z + 180]]);
    for (const [uci, at] of places) {
      const shape = pieces.shape(kindOf(uci.charAt(4)));
      if (!shape) continue;
      const mesh = new Mesh(shape, this.#material);
      mesh.position.set(...at);
      this.#root.add(mesh);
    }
    pieces.root.add(this.#root);
    this.#offered = { promotion, piece, places };
  }

  /** Takes the one at a hand, or under its ray; none of them calls it off. */
  take(hand: Vec3 | null, ray: { from: Vec3; way: Vec3 }): boolean {
    const { geometry } = this.view;
    if (!this.#offered || !geometry) return false;
    const { piece, places } = this.#offered;
    const floating = places.map(([uci, at], id): PieceView => ({ id, letter: uci.charAt(4), at, quaternion: [1, 0, 0, 0] }));
    const found = (hand && atHand(hand, floating, geometry, REACH)) || pick(ray, floating, geometry);
    const uci = found && places[found.id]?.[0];
    this.close();
    if (uci) this.view.give({ kind: "move", uci, to: uci.slice(2, 4) }, piece);
    else this.view.forget();
    return Boolean(uci);
  }

  close(): void {
    this.#offered = null;
    this.#root.clear();
    this.#root.removeFromParent();
  }
}
