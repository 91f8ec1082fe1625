// What the server says, as runes: `live.game`, `live.station` … are replaced whole, so read them anywhere.
import { applyDelta, applySnapshot, NOTHING, type Known } from "../api/reducer";
import { Socket, type Connection } from "../api/socket";
import type { Down, Role, TopicName } from "../api/types";

const ALWAYS: readonly TopicName[] = [
  "station",
  "robot",
  "game",
  "thinking",
  "activity",
  "prompts",
  "eyes",
  "calibration",
  "clients",
];

export type Extra = "squares" | "scene" | "wire";

class Live {
  #known = $state.raw<Known>(NOTHING);
  connection = $state<Connection>("connecting");
  /** Whether anything was ever received: until then nothing is known, not even that there is no game. */
  ready = $state(false);
  #wanted = new Map<Extra, number>();
  #socket: Socket | undefined;

  station = $derived(this.#known.topics.station);
  robot = $derived(this.#known.topics.robot);
  game = $derived(this.#known.topics.game);
  thinking = $derived(this.#known.topics.thinking);
  activity = $derived(this.#known.topics.activity);
  prompts = $derived(this.#known.topics.prompts ?? []);
  eyes = $derived(this.#known.topics.eyes);
  squares = $derived(this.#known.topics.squares);
  scene = $derived(this.#known.topics.scene);
  calibration = $derived(this.#known.topics.calibration);
  clients = $derived(this.#known.topics.clients);
  said = $derived(this.#known.said);
  wire = $derived(this.#known.wire);
  role = $derived<Role>(this.#known.role);
  mayPlay = $derived(this.#known.role !== "spectator");
  mayOperate = $derived(this.#known.role === "operator");

  /** The server's clock, s since the epoch. */
  now(): number {
    return Date.now() / 1000 + this.#known.clockOffset;
  }

  receive(message: Down): void {
    if (message.type === "snapshot") {
      this.#known = applySnapshot(this.#known, message, Date.now() / 1000);
      this.ready = true;
    } else if (message.type === "delta") {
      this.#known = applyDelta(this.#known, message);
    }
  }

  attach(socket: Socket): void {
    this.#socket = socket;
    this.#follow();
  }

  /** Follow something that only some pages need; the answer ends it. For `$effect(() => live.want("scene"))`. */
  want(extra: Extra): () => void {
    this.#count(extra, 1);
    let wanted = true;
    return () => {
      if (wanted) this.#count(extra, -1);
      wanted = false;
    };
  }

  #count(extra: Extra, change: number): void {
    const before = this.#wanted.get(extra) ?? 0;
    this.#wanted.set(extra, before + change);
    if (before === 0 || before + change === 0) this.#follow();
  }

  #wants(extra: Extra): boolean {
    return (this.#wanted.get(extra) ?? 0) > 0;
  }

  #follow(): void {
    const extra = (["squares", "scene"] as const).filter((name) => this.#wants(name));
    this.#socket?.follow([...ALWAYS, ...extra], this.#wants("wire"));
  }
}

export const live = new Live();
