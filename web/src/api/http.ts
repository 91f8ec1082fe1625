// Reads and the few posts that are no commands. Errors come as `HttpError` with words for people.
import type { AnyCommand, Problem, Reply } from "./types";

export class HttpError extends Error {
  constructor(
    readonly status: number,
    readonly why: Problem,
  ) {
    super(why.error);
  }
}

export async function get<T>(path: string, signal?: AbortSignal): Promise<T> {
  return (await answer(await fetch(`/api/${path}`, signal ? { signal } : {}))).json() as Promise<T>;
}

export async function getText(path: string): Promise<string> {
  return (await answer(await fetch(`/api/${path}`))).text();
}

export async function getBlob(path: string, signal: AbortSignal): Promise<Blob> {
  return (await answer(await fetch(`/api/${path}`, { signal }))).blob();
}

export function post<T>(path: string, body: unknown): Promise<T> {
  return send<T>("POST", path, body);
}

export function put<T>(path: string, body: unknown): Promise<T> {
  return send<T>("PUT", path, body);
}

async function send<T>(method: string, path: string, body: unknown): Promise<T> {
  const init = { method, headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
  return (await answer(await fetch(`/api/${path}`, init))).json() as Promise<T>;
}

export async function remove(path: string): Promise<void> {
  await answer(await fetch(`/api/${path}`, { method: "DELETE" }));
}

export function postCommand(command: AnyCommand): Promise<Reply> {
  return post<Reply>("commands", command);
}

async function answer(response: Response): Promise<Response> {
  if (response.ok) return response;
  const body: unknown = await response.json().catch(() => null);
  throw new HttpError(response.status, problem(body, response.statusText || String(response.status)));
}

/** As the server words it; of anything else, a proxy's answer perhaps, only that it failed. */
function problem(body: unknown, otherwise: string): Problem {
  const nothing = { error: otherwise, hint: "", kind: "", error_said: [], hint_said: [] };
  return typeof body === "object" && body !== null && "error_said" in body ? { ...nothing, ...(body as Problem) } : nothing;
}
