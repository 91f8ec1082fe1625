// What was refused, or failed on the way, in the page's language.
import { HttpError } from "../api/http";
import type { Problem } from "../api/types";
import { t } from "../i18n/i18n.svelte";
import { refusal, type Told } from "../i18n/said";
import { toast } from "./toasts.svelte";

const ON_THE_WAY = { lost: "shell.error_lost", silent: "shell.error_silent", restarted: "shell.error_restarted" } as const;
export type OnTheWay = keyof typeof ON_THE_WAY;

/** What the page itself says of a command that got no answer. */
export function unanswered(error: OnTheWay): Problem {
  return { error, hint: "", kind: "", error_said: [], hint_said: [] };
}

export function told(why: Problem): Told {
  return why.error in ON_THE_WAY ? [t(ON_THE_WAY[why.error as OnTheWay]), ""] : refusal(why);
}

export function complain(error: unknown): void {
  toast("error", ...told(error instanceof HttpError ? error.why : unanswered("lost")));
}
