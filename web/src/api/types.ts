// Short names for what goes over the wire. schema.ts is generated (npm run types); nothing is declared twice.
import type { components } from "./schema";

type Schemas = components["schemas"];

export type ActivityView = Schemas["ActivityView"];
export type CalibrationView = Schemas["CalibrationView"];
export type Candidate = Schemas["Candidate"];
export type ClientsView = Schemas["ClientsView"];
export type Clock = Schemas["Clock"];
export type ClockView = Schemas["ClockView"];
export type Delta = Schemas["Delta"];
export type EyesView = Schemas["EyesView"];
export type Fault = Schemas["Fault"];
export type GameView = Schemas["GameView"];
export type MoveView = Schemas["MoveView"];
export type PieceView = Schemas["PieceView"];
export type Problem = Schemas["Problem"];
export type PromptView = Schemas["PromptView"];
export type Refused = Schemas["Refused"];
export type Replied = Schemas["Replied"];
export type Reply = Schemas["Reply"];
export type RobotView = Schemas["RobotView"];
export type Said = Schemas["Said"];
export type Say = Schemas["Say"];
export type SceneView = Schemas["SceneView"];
export type SideView = Schemas["SideView"];
export type Snapshot = Schemas["Snapshot"];
export type SquaresView = Schemas["SquaresView"];
export type StationView = Schemas["StationView"];
export type ThinkingView = Schemas["ThinkingView"];
export type Topics = Schemas["Topics"];
export type WireLine = Schemas["WireLine"];

export type Down = Snapshot | Delta | Replied | Refused;
export type Role = Snapshot["role"];
export type Colour = "white" | "black";
export type TopicName = keyof Topics;
export type AnyCommand = Schemas["Ask"]["command"];
export type CommandName = AnyCommand["name"];

/** A command without its id, which the socket makes up; told apart by `name`. */
export type Order = AnyCommand extends infer C ? (C extends AnyCommand ? Omit<C, "id"> : never) : never;
