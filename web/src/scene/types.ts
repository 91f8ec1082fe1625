// Names used all over the 3D view. Lengths are mm in the robot's frame unless a name says otherwise.
import type { components } from "../api/schema";
import type { PieceView, SceneView } from "../api/types";

export type Geometry = components["schemas"]["SceneGeometry"];
export type Shape = components["schemas"]["ShapeView"];
export type Vec3 = readonly [number, number, number];
export type Vec2 = readonly [number, number];
/** w, x, y, z */
export type Quat = readonly [number, number, number, number];
export type Kind = "K" | "Q" | "R" | "B" | "N" | "P";
export type { PieceView, SceneView };

export const KINDS: readonly Kind[] = ["K", "Q", "R", "B", "N", "P"];

export function kindOf(letter: string): Kind {
  const upper = letter.toUpperCase();
  return KINDS.find((kind) => kind === upper) ?? "P";
}

export function isWhite(letter: string): boolean {
  return letter === letter.toUpperCase();
}
