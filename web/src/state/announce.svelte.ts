// What screen readers are told: one polite region, one assertive; speech says the same aloud when it is on.
import { i18n } from "../i18n/i18n.svelte";
import { settings } from "./settings.svelte";

export const announced = $state({ polite: "", assertive: "" });

export function announce(text: string, how: "polite" | "assertive" = "polite"): void {
  // A no-break space makes the same words a new text, which is read again.
  announced[how] = announced[how] === text ? `${text}\u00a0` : text;
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
