// The printed link carries a one-time token: it becomes a cookie before anything else is asked of the server.
import { HttpError, post } from "../api/http";
import { toast } from "./toasts.svelte";

export async function enterByLink(): Promise<void> {
  const url = new URL(location.href);
  const token = url.searchParams.get("token");
  if (!token) return;
  url.searchParams.delete("token"); // neither the history nor a copied address gives it away
  history.replaceState(null, "", url);
  try {
    await post("session", { token });
  } catch (error) {
    if (error instanceof HttpError) toast("error", error.message, error.hint);
  }
}
