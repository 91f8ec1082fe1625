// Marks on the board: squares of the last move, check, a square to put something right on, and targets of a drag.
import { CanvasTexture, Group, Mesh, MeshBasicMaterial, PlaneGeometry, type Texture } from "three";
import { squareCentre, yaw } from "./frames";
import type { Geometry } from "./types";

export type MarkKind = "last" | "check" | "prompt" | "target" | "aim" | "capture";

const LOOKS: Record<MarkKind, { readonly colour: string; readonly opacity: number; readonly shape: "plate" | "dot" | "ring" | "glow" }> = {
  last: { colour: "#e8b53a", opacity: 0.34, shape: "plate" },
  check: { colour: "#e03127", opacity: 0.75, shape: "glow" },
  prompt: { colour: "#2fb7ff", opacity: 0.9, shape: "ring" },
  target: { colour: "#1c6b4f", opacity: 0.75, shape: "dot" },
  capture: { colour: "#1c6b4f", opacity: 0.75, shape: "ring" },
  aim: { colour: "#38c793", opacity: 0.62, shape: "plate" },
};

const LIFT: Record<MarkKind, number> = { last: 0.2, check: 0.25, prompt: 0.5, target: 0.5, capture: 0.45, aim: 0.3 };

export class Marks {
  readonly root = new Group();
  readonly #materials: Record<MarkKind, MeshBasicMaterial>;
  readonly #plane: PlaneGeometry;
  readonly #shown = new Map<MarkKind, string>();

  constructor(private readonly geometry: Geometry) {
    this.#plane = new PlaneGeometry(geometry.board.square, geometry.board.square);
    const entries = Object.entries(LOOKS).map(([kind, look]) => [
      kind,
      new MeshBasicMaterial({ map: shapeTexture(look.shape), color: look.colour, opacity: look.opacity, transparent: true, depthWrite: false, toneMapped: false }),
    ]);
    this.#materials = Object.fromEntries(entries) as Record<MarkKind, MeshBasicMaterial>;
  }

  /** Replaces the marks of a kind; returns whether that is another picture. */
  set(kind: MarkKind, squares: readonly string[]): boolean {
    const key = squares.join(" ");
    if ((this.#shown.get(kind) ?? "") === key) return false;
    this.#shown.set(kind, key);
    for (const old of this.root.children.filter((child) => child.name === kind)) this.root.remove(old);
    for (const square of squares) this.root.add(this.#mark(kind, square));
    return true;
  }

  /** Lets what is asked for swell: 0 to 1. */
  pulse(share: number): void {
    this.#materials.prompt.opacity = 0.55 + 0.45 * share;
  }

  get pulsing(): boolean {
    return (this.#shown.get("prompt") ?? "") !== "";
  }

  #mark(kind: MarkKind, square: string): Mesh {
    const mesh = new Mesh(this.#plane, this.#materials[kind]);
    const [x, y, z] = squareCentre(this.geometry, square);
    mesh.position.set(x, y, z + LIFT[kind]);
    mesh.rotation.z = yaw(this.geometry.board.quaternion);
    mesh.name = kind;
    mesh.renderOrder = 2;
    return mesh;
  }

  dispose(): void {
    this.#plane.dispose();
    for (const material of Object.values(this.#materials)) {
      material.map?.dispose();
      material.dispose();
    }
  }
}

function shapeTexture(shape: "plate" | "dot" | "ring" | "glow"): Texture {
  const element = document.createElement("canvas");
  element.width = element.height = 128;
  const context = element.getContext("2d");
  if (!context) throw new Error("no 2D canvas");
  context.fillStyle = context.strokeStyle = "#ffffff";
  if (shape === "plate") {
    context.globalAlpha = 0.8;
    context.fillRect(1, 1, 126, 126);
    context.globalAlpha = 1;
    context.lineWidth = 5;
    context.strokeRect(3.5, 3.5, 121, 121);
  } else if (shape === "glow") {
    const gradient = context.createRadialGradient(64, 64, 10, 64, 64, 64);
    gradient.addColorStop(0, "rgba(255,255,255,1)");
    gradient.addColorStop(1, "rgba(255,255,255,0)");
    context.fillStyle = gradient;
    context.fillRect(0, 0, 128, 128);
  } else {
    context.beginPath();
    context.arc(64, 64, shape === "dot" ? 18 : 54, 0, 2 * Math.PI);
    context.lineWidth = 10;
    if (shape === "dot") context.fill();
    else context.stroke();
  }
  return new CanvasTexture(element);
}
