// What the view asks of a robot, be it a gantry or an arm.
import type { Group } from "three";
import type { Vec3 } from "./types";

/** Where it stands: a gantry goes by its tool point, an arm by its joints, rad, where they are known. */
export interface Stance {
  readonly tool: Vec3;
  readonly joints: readonly number[] | null;
}

export interface Robot {
  /** In the robot's frame, mm. */
  readonly root: Group;
  /** `gap` is from the tool point to each pad, mm. */
  pose(stance: Stance, gap: number): void;
  /** Lets an eye at a point of the robot's frame see past what stands before it. */
  seenFrom(eye: Vec3): void;
  dispose(): void;
}
