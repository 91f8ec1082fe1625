// The server makes a session of the printed link's one-time token, and takes it out of the address. A link that
// was used before leads here as a spectator, who is told why.
import { t } from "../i18n/i18n.svelte";
import { toast } from "./toasts.svelte";

export function tellOfUsedLink(): void {
  const url = new URL(location.href);
  if (url.searchParams.get("link") !== "used") return;
  url.searchParams.delete("link");
  history.replaceState(null, "", url);
  toast("error", t("shell.link_used"), t("shell.link_used_hint"));
}
