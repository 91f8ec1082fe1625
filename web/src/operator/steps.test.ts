import { expect, it } from "vitest";
import type { RobotView, StationView } from "../api/types";
import { steps } from "./steps";

const STATION: StationView = {
  phase: "ready", busy: "", busy_said: [], robot_kind: "gantry", port: "/dev/ttyUSB0", on_twin: false, speed: 1,
  calibrated: false, game: null, again: false, unfinished: null, faults: [],
} as StationView; // prettier-ignore
const ROBOT: RobotView = { phase: "idle", homed: true, position: [0, 0, 200], gripper: "open", message: "" };

const states = (station: Partial<StationView>, robot: Partial<RobotView> = {}) =>
  steps({ ...STATION, ...station }, { ...ROBOT, ...robot }).map((step) => step.state);
const blocks = (station: Partial<StationView>, robot: Partial<RobotView> = {}) =>
  steps({ ...STATION, ...station }, { ...ROBOT, ...robot }).map((step) => step.blocked);

it("leads from a cold robot to a game", () => {
  expect(states({ phase: "off" }, { homed: false })).toEqual(["next", "later", "later", "later"]);
  expect(states({}, { homed: false })).toEqual(["done", "next", "later", "later"]);
  expect(states({})).toEqual(["done", "done", "next", "later"]);
  expect(states({ calibrated: true })).toEqual(["done", "done", "done", "next"]);
  expect(states({ on_twin: true })).toEqual(["done", "done", "done", "next"]);
  expect(states({ calibrated: true, phase: "playing" })).toEqual(["done", "done", "done", "done"]);
});

it("says why a step cannot be taken", () => {
  expect(blocks({ phase: "off" }, { homed: false })).toEqual(["", "off", "off", ""]);
  expect(blocks({}, { homed: false })).toEqual(["", "", "unhomed", ""]);
  expect(blocks({}, { phase: "alarm" })).toEqual(["", "", "", "alarm"]);
  expect(blocks({ phase: "playing" })).toEqual(["playing", "playing", "", "playing"]);
  expect(new Set(blocks({ busy: "Homing …" }))).toEqual(new Set(["busy"]));
});

it("offers nothing but connecting while nothing is known", () => {
  expect(steps(null, null).map((step) => step.blocked)).toEqual(["", "off", "off", ""]);
});
