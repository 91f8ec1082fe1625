// What the server's messages make of what a page knows: pure functions, tested without a socket.
import type { Delta, Role, Say, SceneView, Snapshot, TopicName, Topics, WireLine } from "./types";

export interface Known {
  readonly epoch: string;
  readonly sequence: number;
  readonly role: Role;
  readonly topics: Topics;
  /** What happened, oldest first; only the newest are kept. */
  readonly said: readonly Say[];
  readonly wire: readonly WireLine[];
  /** Server's clock minus ours, s. */
  readonly clockOffset: number;
}

export const NO_TOPICS: Topics = {
  station: null,
  robot: null,
  game: null,
  thinking: null,
  activity: null,
  prompts: null,
  eyes: null,
  squares: null,
  scene: null,
  calibration: null,
  clients: null,
};

export const NOTHING: Known = {
  epoch: "",
  sequence: -1,
  role: "spectator",
  topics: NO_TOPICS,
  said: [],
  wire: [],
  clockOffset: 0,
};

const SAID_KEPT = 200;
const WIRE_KEPT = 5000;

export function applySnapshot(known: Known, snapshot: Snapshot, now: number): Known {
  const sameRun = known.epoch === snapshot.epoch;
  return {
    epoch: snapshot.epoch,
    sequence: snapshot.sequence,
    role: snapshot.role,
    topics: snapshot.topics,
    said: snapshot.said.slice(-SAID_KEPT),
    wire: sameRun ? known.wire : [],
    clockOffset: snapshot.at - now,
  };
}

export function applyDelta(known: Known, delta: Delta): Known {
  if (delta.sequence <= known.sequence && delta.wire.length === 0 && delta.said.length === 0) return known;
  const topics = delta.sequence > known.sequence ? mergeTopics(known.topics, delta) : known.topics;
  return {
    ...known,
    topics,
    sequence: Math.max(known.sequence, delta.sequence),
    said: delta.said.length > 0 ? [...known.said, ...delta.said].slice(-SAID_KEPT) : known.said,
    wire: delta.wire.length > 0 ? [...known.wire, ...delta.wire].slice(-WIRE_KEPT) : known.wire,
  };
}

function mergeTopics(before: Topics, delta: Delta): Topics {
  const topics: { -readonly [Name in TopicName]: Topics[Name] } = { ...before };
  for (const name of delta.changed) setTopic(topics, delta.topics, name);
  topics.scene = mergeScene(before.scene, topics.scene);
  return topics;
}

function setTopic<Name extends TopicName>(into: { -readonly [N in TopicName]: Topics[N] }, from: Topics, name: Name) {
  into[name] = from[name] ?? NO_TOPICS[name];
}

/** A delta's scene holds only the pieces that moved, unless it says that it is whole. */
function mergeScene(before: SceneView | null, after: SceneView | null): SceneView | null {
  if (before === null || after === null || before === after || after.whole) return after;
  const pieces = new Map(before.pieces.map((piece) => [piece.id, piece]));
  for (const piece of after.pieces) pieces.set(piece.id, piece);
  return { ...after, pieces: [...pieces.values()] };
}
