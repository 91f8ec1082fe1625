// Short tones, made here: nothing is loaded for them. Silent until they are switched on, and until the browser
// lets a page be heard, which is after the first press.
import { settings } from "./settings.svelte";

const TONES = { move: [520], capture: [520, 390], asked: [660, 880], over: [520, 660, 780] } as const;
export type Tone = keyof typeof TONES;
const LASTS_S = 0.11;
const LOUDNESS = 0.12;
let context: AudioContext | undefined;

export function sound(tone: Tone): void {
  if (!settings.sounds || typeof AudioContext === "undefined") return;
  context ??= new AudioContext();
  if (context.state === "suspended") void context.resume();
  TONES[tone].forEach((hertz, number) => beep(context!, hertz, context!.currentTime + number * LASTS_S));
}

function beep(audio: AudioContext, hertz: number, at: number): void {
  const tone = audio.createOscillator();
  const volume = audio.createGain();
  tone.type = "triangle";
  tone.frequency.value = hertz;
  volume.gain.setValueAtTime(LOUDNESS, at);
  volume.gain.exponentialRampToValueAtTime(0.001, at + LASTS_S);
  tone.connect(volume).connect(audio.destination);
  tone.start(at);
  tone.stop(at + LASTS_S);
}

/** What of a game's news is to be heard: the newest move's notation, and whether the game is over. */
export function soundOf(san: string | undefined, over: boolean): Tone | undefined {
  if (over) return "over";
  if (!san) return undefined;
  return san.includes("x") ? "capture" : "move";
}
