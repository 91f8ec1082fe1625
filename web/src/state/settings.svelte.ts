// What this browser remembers. One key of localStorage; a browser without storage keeps it for the visit.
import type { Locale } from "../i18n/locales";

export interface Settings {
  theme: "auto" | "light" | "dark";
  locale: Locale | "";
  /** Evaluation bar and the engine's line. */
  thinking: boolean;
  /** What the game page shows. */
  view: "board" | "scene" | "both";
  /** Speak moves and prompts. */
  speech: boolean;
  /** Letters and numbers on the board's edge. */
  coordinates: boolean;
  /** Pieces in moves: by the letters of the page's language, as pictures, or by English letters. */
  letters: "local" | "figurine" | "english";
  board: "wood" | "green" | "blue" | "grey";
  /** A short tone for moves, ends of games and prompts. */
  sounds: boolean;
  /** Board seen from: the person's side, or one colour always. */
  orientation: "auto" | "white" | "black";
}

const KEY = "kempelen.settings";
const DEFAULTS: Settings = {
  theme: "auto",
  locale: "",
  thinking: true,
  view: "board",
  speech: false,
  coordinates: true,
  letters: "local",
  board: "wood",
  sounds: false,
  orientation: "auto",
};

function load(): Settings {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(KEY) ?? "{}");
    return { ...DEFAULTS, ...known(kept) };
  } catch {
    return { ...DEFAULTS };
  }
}

/** Only what has the type it should: storage may hold anything. */
function known(kept: unknown): Partial<Settings> {
  if (typeof kept !== "object" || kept === null) return {};
  const fits = ([name, value]: [string, unknown]) => name in DEFAULTS && typeof value === typeof DEFAULTS[name as keyof Settings];
  return Object.fromEntries(Object.entries(kept).filter(fits));
}

export const settings: Settings = $state(load());

export function keepSettings(): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(settings));
  } catch {
    // Private windows refuse storage: the settings hold until the page is closed.
  }
}
