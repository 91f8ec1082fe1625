import { i18n } from "../i18n/i18n.svelte";

const UNITS = [
  ["day", 86_400],
  ["hour", 3600],
  ["minute", 60],
] as const;

/** "5 minutes ago", in the language of the page. */
export function ago(seconds: number): string {
  const format = new Intl.RelativeTimeFormat(i18n.locale, { numeric: "auto" });
  const unit = UNITS.find(([, length]) => seconds >= length);
  return unit ? format.format(-Math.floor(seconds / unit[1]), unit[0]) : format.format(0, "second");
}
