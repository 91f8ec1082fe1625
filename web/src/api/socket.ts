// The WebSocket: connects, connects again, sends commands until they are answered. Knows no Svelte.
import type { AnyCommand, CommandName, Down, Order, Reply, TopicName } from "./types";

export type Connection = "connecting" | "open" | "lost";

export interface SocketOptions {
  readonly url: string;
  readonly onDown: (message: Down) => void;
  readonly onConnection: (connection: Connection) => void;
  readonly open?: (url: string) => WebSocket;
  readonly random?: () => number;
}

interface Pending {
  readonly command: AnyCommand;
  readonly resolve: (reply: Reply) => void;
  timer: ReturnType<typeof setTimeout> | undefined;
}

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 8000;
const SILENT_MS = 40_000; // the longest that a command takes without any answer
/** These mean something only at the moment they are given. */
const NEVER_AGAIN: ReadonlySet<CommandName> = new Set(["jog", "jog_stop"]);

export class Socket {
  #socket: WebSocket | undefined;
  #pending = new Map<string, Pending>();
  #attempt = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #closed = false;
  #epoch = "";
  #follow: { topics: readonly TopicName[]; wire: boolean } = { topics: [], wire: false };

  constructor(private readonly options: SocketOptions) {}

  connect(): void {
    this.#closed = false;
    this.#open();
  }

  close(): void {
    this.#closed = true;
    clearTimeout(this.#timer);
    for (const id of [...this.#pending.keys()]) this.#settle(id, failed(id, "lost"));
    this.#socket?.close();
  }

  /** Connects at once instead of waiting any longer. */
  hurry(): void {
    if (this.#timer === undefined || this.#closed) return;
    this.#attempt = 0;
    this.#open();
  }

  follow(topics: readonly TopicName[], wire: boolean): void {
    this.#follow = { topics, wire };
    this.#send({ type: "follow", topics, wire });
  }

  get isOpen(): boolean {
    return this.#socket?.readyState === 1;
  }

  /** Never rejects: what cannot be done comes as a reply that is not ok. */
  command(order: Order, id = newId()): Promise<Reply> {
    const command = { ...order, id } as AnyCommand;
    if (NEVER_AGAIN.has(command.name) && !this.isOpen) return Promise.resolve(failed(id, "lost"));
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.#settle(id, failed(id, "silent")), SILENT_MS);
      this.#pending.set(id, { command, resolve, timer });
      this.#send({ type: "command", command });
    });
  }

  #open(): void {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    const socket = (this.options.open ?? ((url) => new WebSocket(url)))(this.options.url);
    this.#socket = socket;
    socket.onopen = () => this.#opened(socket);
    socket.onmessage = (event) => this.#received(socket, String(event.data));
    socket.onclose = () => this.#lost(socket);
  }

  #opened(socket: WebSocket): void {
    if (socket !== this.#socket) return;
    this.#send({ type: "follow", ...this.#follow });
  }

  #received(socket: WebSocket, text: string): void {
    if (socket !== this.#socket) return;
    const message = JSON.parse(text) as Down;
    if (message.type === "snapshot") this.#welcomed(message.epoch);
    if (message.type === "reply") this.#settle(message.reply.id, message.reply);
    else this.options.onDown(message);
  }

  /** Only now is the connection good: unanswered commands go out again, under the ids they had. */
  #welcomed(epoch: string): void {
    const restarted = this.#epoch !== "" && this.#epoch !== epoch;
    const again = this.#attempt > 0 || restarted;
    this.#attempt = 0;
    this.#epoch = epoch;
    this.options.onConnection("open");
    if (!again) return;
    for (const [id, pending] of [...this.#pending]) {
      const may = pending.command.name === "estop" || !(restarted || NEVER_AGAIN.has(pending.command.name));
      if (may) this.#send({ type: "command", command: pending.command });
      else this.#settle(id, failed(id, restarted ? "restarted" : "lost"));
    }
  }

  #lost(socket: WebSocket): void {
    if (socket !== this.#socket || this.#closed) return;
    this.#attempt += 1;
    this.options.onConnection(this.#attempt === 1 ? "connecting" : "lost");
    const longest = Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** (this.#attempt - 1));
    const wait = longest * (0.5 + 0.5 * (this.options.random ?? Math.random)());
    this.#timer = setTimeout(() => this.#open(), wait);
  }

  #settle(id: string, reply: Reply): void {
    const pending = this.#pending.get(id);
    if (!pending) return;
    this.#pending.delete(id);
    clearTimeout(pending.timer);
    pending.resolve(reply);
  }

  #send(message: unknown): void {
    if (this.isOpen) this.#socket?.send(JSON.stringify(message));
  }
}

/** Replies that we make up ourselves have one of these as their error; the page says them in its language. */
export type OwnError = "lost" | "silent" | "restarted";

function failed(id: string, error: OwnError): Reply {
  return { id, ok: false, error, hint: "", kind: "", error_said: [], hint_said: [], result: {} };
}

export function newId(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
