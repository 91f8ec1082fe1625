// Views as the server would send them, for tests: everything quiet, and what a test gives instead.
import type { Delta, GameView, MoveView, PromptView, Snapshot, StationView, Topics } from "../api/types";
import { NO_TOPICS } from "../api/reducer";
import { START_FEN } from "../chess/fen";

export function gameView(part: Partial<GameView> = {}): GameView {
  return {
    number: 1,
    mode: "play",
    white: { name: "Person", kind: "person" },
    black: { name: "Engine", kind: "engine" },
    people: ["white"],
    start_fen: START_FEN,
    fen: START_FEN,
    moves: [],
    turn: "white",
    person_to_move: true,
    legal: ["e2e4", "e2e3", "g1f3"],
    check: null,
    captured: { white: "", black: "" },
    paused: false,
    in_transfer: false,
    draw_offer: null,
    result: "",
    reason: "",
    length: null,
    clock: null,
    by_hand: false,
    ...part,
  };
}

export function moveView(part: Partial<MoveView> = {}): MoveView {
  return { ply: 1, san: "e4", uci: "e2e4", fen: "rnbqkbnr/pppppppp/8/8/4P3/8/PPPP1PPP/RNBQKBNR b KQkq - 0 1", ...part };
}

export function stationView(part: Partial<StationView> = {}): StationView {
  return {
    phase: "playing",
    busy: "",
    busy_said: [],
    robot_kind: "gantry",
    port: "twin",
    on_twin: true,
    speed: 1,
    calibrated: true,
    game: 1,
    again: false,
    faults: [],
    ...part,
  };
}

export function promptView(part: Partial<PromptView> = {}): PromptView {
  return { id: "p1", kind: "do", text: "Please.", text_said: [], square: null, piece: null, candidates: [], ...part };
}

export function snapshot(topics: Partial<Topics> = {}, part: Partial<Snapshot> = {}): Snapshot {
  return {
    type: "snapshot",
    epoch: "one",
    sequence: 1,
    at: Date.now() / 1000,
    role: "operator",
    topics: { ...NO_TOPICS, ...topics },
    said: [],
    ...part,
  };
}

export function delta(sequence: number, topics: Partial<Topics>, part: Partial<Delta> = {}): Delta {
  const changed = Object.keys(topics) as (keyof Topics)[];
  return { type: "delta", sequence, moved_at: 0, changed, topics: { ...NO_TOPICS, ...topics }, said: [], wire: [], ...part };
}
