// What screen readers are told: one polite region, one assertive; speech says the same aloud when it is on.
import { i18n } from "../i18n/i18n.svelte";
import { settings } from "./settings.svelte";

export interface Announcement {
  readonly id: number;
  readonly text: string;
}

type Regions = Record<"polite" | "assertive", readonly Announcement[]>;
const KEPT = 4;
let next = 1;

/** The newest of each; what is added to a live region is read, however soon the next one follows. */
export const announced: Regions = $state({ polite: [], assertive: [] });

export function announce(text: string, how: keyof Regions = "polite"): void {
  announced[how] = [...announced[how], { id: next++, text }].slice(-KEPT);
  if (settings.speech) speak(text);
}

export function canSpeak(): boolean {
  return typeof speechSynthesis !== "undefined";
}

function speak(text: string): void {
  if (!canSpeak()) return;
  const words = new SpeechSynthesisUtterance(text);
  words.lang = i18n.locale;
  speechSynthesis.speak(words);
}
