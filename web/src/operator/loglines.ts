// What of the wire's traffic is shown: a bounded window, filtered.
import type { WireLine } from "../api/types";

export const SHOWN = 2000;

export interface Filter {
  readonly text: string;
  /** Status queries and their answers make up most of the traffic. */
  readonly polls: boolean;
  readonly ways: "both" | "out" | "in";
}

export function isPoll(line: Pick<WireLine, "text">): boolean {
  return line.text === "?" || /^<\w+(?::\d+)?\|/.test(line.text);
}

/** The newest that are wanted; several words must all be there, one that begins with "-" must not. */
export function wanted(lines: readonly WireLine[], filter: Filter, most = SHOWN): readonly WireLine[] {
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  const keep = (line: WireLine) =>
    (filter.ways === "both" || line.way === filter.ways) && (filter.polls || !isPoll(line)) && fits(line.text, words);
  return lines.filter(keep).slice(-most);
}

/** Two stretches that may overlap, as one, in order of their numbers. */
export function joined(before: readonly WireLine[], after: readonly WireLine[], most: number): readonly WireLine[] {
  const first = after[0];
  if (first === undefined) return before.slice(-most);
  return [...before.filter((line) => line.number < first.number), ...after].slice(-most);
}

export function asText(lines: readonly WireLine[]): string {
  return lines.map((line) => `${clockTime(line.at)} ${line.way === "out" ? ">" : "<"} ${line.text}\n`).join("");
}

/** Hours to milliseconds, the same in every language: it is to be compared, not read aloud. */
export function clockTime(at: number): string {
  const date = new Date(1000 * at);
  const two = (value: number) => String(value).padStart(2, "0");
  const fine = String(date.getMilliseconds()).padStart(3, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${fine}`;
}

function fits(text: string, words: readonly string[]): boolean {
  const said = text.toLowerCase();
  return words.every((word) => (word.length > 1 && word.startsWith("-") ? !said.includes(word.slice(1)) : said.includes(word)));
}
