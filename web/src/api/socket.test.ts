import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { snapshot } from "../testing/views";
import { type Connection, Socket } from "./socket";
import type { Down } from "./types";

/** What a browser's WebSocket does as far as `Socket` looks, moved by hand. */
class FakeSocket {
  readyState = 0;
  readonly sent: { type: string; command?: { id: string; name: string } }[] = [];
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: string }) => void) | null = null;

  send(text: string) {
    this.sent.push(JSON.parse(text));
  }
  close() {
    this.readyState = 3;
    this.onclose?.();
  }
  opens(epoch = "one") {
    this.readyState = 1;
    this.onopen?.();
    this.says(snapshot({}, { epoch }));
  }
  says(message: Down) {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
  get commands() {
    return this.sent.flatMap((message) => (message.command ? [message.command] : []));
  }
}

let made: FakeSocket[];
let connections: Connection[];
let socket: Socket;
const newest = () => made.at(-1)!;

beforeEach(() => {
  vi.useFakeTimers();
  made = [];
  connections = [];
  socket = new Socket({
    url: "ws://here/api/ws",
    onDown: () => undefined,
    onConnection: (connection) => connections.push(connection),
    random: () => 1,
    open: () => {
      made.push(new FakeSocket());
      return newest() as unknown as WebSocket;
    },
  });
  socket.follow(["game"], false);
  socket.connect();
});
afterEach(() => {
  socket.close();
  vi.useRealTimers();
});

it("says what it follows as soon as it is open", () => {
  newest().opens();
  expect(newest().sent[0]).toEqual({ type: "follow", topics: ["game"], wire: false });
  expect(connections).toEqual(["open"]);
});

it("connects again, later each time", () => {
  newest().close();
  vi.advanceTimersByTime(250);
  expect(made).toHaveLength(2);
  newest().close();
  vi.advanceTimersByTime(499);
  expect(made).toHaveLength(2);
  vi.advanceTimersByTime(1);
  expect(made).toHaveLength(3);
  expect(connections).toEqual(["connecting", "lost"]);
});

it("sends an unanswered command again under the same id, and answers once", async () => {
  newest().opens();
  const reply = socket.command({ name: "pause" });
  const [first] = newest().commands;
  newest().close();
  vi.advanceTimersByTime(250);
  newest().opens();
  expect(newest().commands).toEqual([first]);
  newest().says({ type: "reply", reply: { id: first!.id, ok: true, error: "", hint: "", kind: "", error_said: [], hint_said: [], result: {} } });
  expect((await reply).ok).toBe(true);
});

it("does not repeat a command at a server that was started anew, but a stop it does", async () => {
  newest().opens();
  const paused = socket.command({ name: "pause" });
  void socket.command({ name: "estop" });
  newest().close();
  vi.advanceTimersByTime(250);
  newest().opens("two");
  expect(newest().commands.map((command) => command.name)).toEqual(["estop"]);
  expect((await paused).error).toBe("restarted");
});

it("never jogs later", async () => {
  const reply = await socket.command({ name: "jog", direction: [1, 0, 0], speed: 10 });
  expect(reply.ok).toBe(false);
  newest().opens();
  expect(newest().commands).toEqual([]);
});

it("tells that there was no answer", async () => {
  newest().opens();
  const reply = socket.command({ name: "home" });
  vi.advanceTimersByTime(40_000);
  expect((await reply).error).toBe("silent");
});
