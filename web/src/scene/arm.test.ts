import { MeshStandardMaterial, Vector3 } from "three";
import { expect, test } from "vitest";
import { Arm, linkMatrix, type ArmGeometry } from "./arm";
import { TABLE } from "./fixture";
import type { Materials } from "./furniture";
import { JointTrack } from "./motion";

const QUARTER = Math.PI / 2;
// The Lab-Volt 5150.
const ARM: ArmGeometry = {
  links: [
    { a: 0, alpha: QUARTER, d: 255, offset: 0 },
    { a: 190, alpha: 0, d: 0, offset: 0 },
    { a: 190, alpha: 0, d: 0, offset: 0 },
    { a: 0, alpha: QUARTER, d: 0, offset: 0 },
    { a: 0, alpha: 0, d: 115, offset: Math.PI },
  ],
  home: [0, QUARTER, -QUARTER, 0, 0],
};

const materials = new Proxy({}, { get: () => new MeshStandardMaterial() }) as Materials;

function standing(joints: readonly number[] | null): Arm {
  const arm = new Arm(ARM, { ...TABLE.gripper, plumb: true }, materials);
  arm.pose({ tool: [0, 0, 0], joints }, 5);
  arm.root.updateMatrixWorld(true);
  return arm;
}

/** Where the hand is, and which way its z axis points. */
function hand(arm: Arm): { at: Vector3; up: Vector3; closing: Vector3 } {
  const frame = arm.gripper.root.matrixWorld;
  const axis = (x: number, y: number, z: number): Vector3 => new Vector3(x, y, z).transformDirection(frame);
  return { at: new Vector3().setFromMatrixPosition(frame), up: axis(0, 0, 1), closing: axis(1, 0, 0) };
}

test("at home the hand hangs straight down where the paper has it, closing across the arm", () => {
  const { at, up, closing } = hand(standing(null));
  expect(at.distanceTo(new Vector3(190, 0, 330))).toBeLessThan(1e-6);
  expect(up.z).toBeCloseTo(1);
  expect(Math.abs(closing.y)).toBeCloseTo(1);
});

test("the base turns all of it, and joints move the hand as their frames say", () => {
  const joints = [0.7, 1.2, -1.4, 0.5, 0.2];
  let frame = linkMatrix(ARM.links[0]!, joints[0]!);
  ARM.links.slice(1).forEach((link, i) => (frame = frame.multiply(linkMatrix(link, joints[i + 1]!))));
  const { at, up } = hand(standing(joints));
  expect(at.distanceTo(new Vector3().setFromMatrixPosition(frame))).toBeLessThan(1e-6);
  expect(Math.atan2(at.y, at.x)).toBeCloseTo(0.7);
  expect(up.dot(new Vector3(0, 0, 1).transformDirection(frame))).toBeCloseTo(-1);
});

test("pads on pivots stay plumb while the hand tilts", () => {
  const arm = standing([0, 1.2, -1.4, 0.5, 0]);
  const pad = arm.gripper.pads[0]!;
  pad.updateWorldMatrix(true, false);
  expect(new Vector3(0, 0, 1).transformDirection(pad.matrixWorld).z).toBeCloseTo(1);
  expect(hand(arm).up.z).toBeLessThan(0.99);
});

test("joints are shown between two samples", () => {
  const track = new JointTrack([0, 1], 0);
  track.add([1, 3], 50, 0);
  expect(track.at(25)).toEqual([0.5, 2]);
  expect(track.movesAfter(20)).toBe(true);
});
