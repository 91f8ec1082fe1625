// What the station is busy with comes in English; the page says it in its own language where it knows the words.
import { maybe } from "../i18n/i18n.svelte";

export function busyText(said: string): string {
  const key = said.toLowerCase().replace(/[^a-z]+/g, "_").replace(/^_|_$/g, "");
  return maybe(`operator.busy_${key.startsWith("connecting") ? "connecting" : key}`) ?? said;
}
