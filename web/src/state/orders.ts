// Commands: given here by all pages, refused in words that a person understands.
import { HttpError, postCommand } from "../api/http";
import { newId, Socket } from "../api/socket";
import type { AnyCommand, Order, Problem, Reply } from "../api/types";
import { t } from "../i18n/i18n.svelte";
import { told, unanswered } from "./complain";
import { live } from "./live.svelte";
import { toast } from "./toasts.svelte";
import { counted } from "./waiting.svelte";

let socket: Socket | undefined;

export function startSocket(): Socket {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  socket = new Socket({
    url: `${scheme}//${location.host}/api/ws`,
    onDown: (message) => {
      if (message.type === "refused") toast("error", message.error, message.hint);
      else live.receive(message);
    },
    onConnection: (connection) => (live.connection = connection),
  });
  live.attach(socket);
  socket.connect();
  addEventListener("online", () => socket?.hurry());
  return socket;
}

/** Give a command and tell what came of it; a refusal is shown as well, unless `quiet`. */
export async function order(command: Order, { quiet = false } = {}): Promise<Reply> {
  const reply = socket ? await counted(command.name, socket.command(command)) : { id: "", ok: false, ...unanswered("lost"), result: {} };
  if (!reply.ok && !quiet) toast("error", ...told(reply));
  return reply;
}

/** Over both ways at once, whichever is quicker: the id makes one stop of the two. */
export async function emergencyStop(): Promise<void> {
  const id = newId();
  const overSocket = socket ? socket.command({ name: "estop" }, id) : Promise.reject(new Error("no socket"));
  const overHttp = postCommand({ name: "estop", id } as AnyCommand);
  const results = await Promise.allSettled([socket?.isOpen ? overSocket : overHttp, overHttp]);
  const done = results.find((result) => result.status === "fulfilled" && result.value.ok);
  if (done) return;
  const failed = results.map((result) => (result.status === "fulfilled" ? result.value : asReply(result.reason)))[0];
  toast("error", t("shell.stop_failed"), failed ? told(failed).join(" ").trim() : "");
}

function asReply(reason: unknown): Problem {
  return reason instanceof HttpError ? reason.why : unanswered("lost");
}
