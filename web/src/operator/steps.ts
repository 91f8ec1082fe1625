// From a cold robot to a game: which steps are done, which is next, and why a later one cannot be taken yet.
import type { RobotView, StationView } from "../api/types";

export type StepName = "robot" | "home" | "board" | "play";
export type StepState = "done" | "next" | "later" | "optional";

export interface Step {
  readonly name: StepName;
  readonly state: StepState;
  /** Why it cannot be taken now, as the end of a key `operator.why_…`; empty when it can. */
  readonly blocked: Blocked | "";
}

export type Blocked = "busy" | "off" | "unhomed" | "playing" | "alarm";

export function steps(station: StationView | null, robot: RobotView | null): readonly Step[] {
  const phase = station?.phase ?? "off";
  const connected = phase !== "off" && phase !== "connecting";
  const homed = connected && (robot?.homed ?? false);
  const measured = (station?.calibrated ?? false) || (station?.on_twin ?? false);
  const inGame = phase === "playing" || phase === "starting" || phase === "leaving";
  const done = { robot: connected, home: homed, board: connected && measured, play: inGame };
  const order: readonly StepName[] = ["robot", "home", "board", "play"];
  const next = order.find((name) => !done[name]);
  return order.map((name) => ({
    name,
    state: done[name] ? "done" : name === next ? "next" : "later",
    blocked: blocked(name, { phase, busy: station?.busy ?? "", connected, homed, alarm: robot?.phase === "alarm" }),
  }));
}

interface Facts {
  readonly phase: StationView["phase"];
  readonly busy: string;
  readonly connected: boolean;
  readonly homed: boolean;
  readonly alarm: boolean;
}

function blocked(name: StepName, { phase, busy, connected, homed, alarm }: Facts): Blocked | "" {
  if (busy) return "busy";
  if (name === "robot") return phase === "off" || phase === "ready" ? "" : "playing";
  if (!connected) return name === "play" ? "" : "off"; // a game connects and homes by itself
  if (name === "home") return phase === "ready" ? "" : "playing";
  if (name === "board") return homed ? "" : "unhomed";
  return alarm ? "alarm" : phase === "ready" ? "" : "playing";
}
