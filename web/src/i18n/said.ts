// What the server says, in the page's language: codes and values are its own, the words are ours. What has no
// words here is shown in the server's English.
import type { Problem, Said } from "../api/types";
import { localSan, pieceName } from "../chess/san";
import { i18n, maybe, t } from "./i18n.svelte";
import { intlTag } from "./locales";

type Datum = Said["data"][string];
/** What is wrong, and what to do next. */
export type Told = readonly [text: string, hint: string];

export function spoken(parts: readonly Said[], text: string): string {
  return parts.length > 0 ? parts.map(part).join(" ") : text;
}

/** A refusal; of one that has no words of its own at least what it is about, before the English. */
export function refusal(why: Problem): Told {
  if (why.error_said.length > 0) return [spoken(why.error_said, why.error), spoken(why.hint_said, why.hint)];
  const about = i18n.locale === "en" ? undefined : maybe(`said.kind_${why.kind}`);
  return about === undefined ? [why.error, why.hint] : [about, `${why.error} ${why.hint}`.trim()];
}

function part({ code, text, data }: Said): string {
  const values = Object.entries(data).map(([name, value]) => [name, word(name, value)]);
  return maybe(`said.${code}`, Object.fromEntries(values)) ?? text;
}

function word(name: string, value: Datum): string | number {
  if (typeof value === "number") return value;
  if (typeof value !== "string") return either(value.map((one) => String(word(name, one))));
  if (name.startsWith("piece")) return piece(value);
  return name.startsWith("move") ? localSan(value) : value;
}

/** Of some only the colour is known, of others nothing. */
function piece(letter: string): string {
  if (letter === "white" || letter === "black") return t(`said.some_${letter}`);
  return letter ? pieceName(letter) : t("said.some_piece");
}

function either(names: readonly string[]): string {
  return new Intl.ListFormat(intlTag(i18n.locale), { type: "disjunction" }).format(names);
}
