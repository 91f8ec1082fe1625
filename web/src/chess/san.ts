// Moves as people write and say them. SAN comes from the server with English letters; there are no rules here.
import { type Key, t } from "../i18n/i18n.svelte";
import { settings } from "../state/settings.svelte";
import { placement } from "./fen";

const LETTERS = { K: "game.letter_k", Q: "game.letter_q", R: "game.letter_r", B: "game.letter_b", N: "game.letter_n" } as const;
export type PieceKind = "k" | "q" | "r" | "b" | "n" | "p";

const FIGURINES = { K: "♔", Q: "♕", R: "♖", B: "♗", N: "♘" } as const;

/** "Nf3" with the letters of the page's language: "Jf3", "Sf3"; or as its reader has chosen: "♘f3". */
export function localSan(san: string): string {
  if (san.startsWith("O") || settings.letters === "english") return san;
  const figurines = settings.letters === "figurine";
  return san.replaceAll(/[KQRBN]/g, (letter) => {
    const kind = letter as keyof typeof LETTERS;
    return figurines ? FIGURINES[kind] : t(LETTERS[kind]);
  });
}

export function pieceKind(letter: string): PieceKind {
  return letter.toLowerCase() as PieceKind;
}

/** "the knight", as it stands after "carrying". */
export function thePiece(letter: string): string {
  return t(`game.the_${pieceKind(letter)}`);
}

export function pieceName(letter: string): string {
  const colour = letter === letter.toUpperCase() ? "white" : "black";
  return t(`game.${colour}_${pieceKind(letter)}`);
}

interface Spelled {
  readonly kind: PieceKind;
  readonly from: string;
  readonly takes: boolean;
  readonly to: string;
  readonly promotion: string;
  readonly end: string;
}

function spell(san: string): Spelled | undefined {
  const match = /^([KQRBN]?)([a-h]?[1-8]?)(x?)([a-h][1-8])(?:=?([QRBN]))?([+#]?)$/.exec(san);
  if (!match) return undefined;
  const [, kind = "", from = "", takes = "", to = "", promotion = "", end = ""] = match;
  return { kind: (kind || "p").toLowerCase() as PieceKind, from, takes: takes !== "", to, promotion, end };
}

/** For the ear: "Black plays knight f6, check". */
export function saidMove(san: string, colour: "white" | "black"): string {
  return t("game.say_plays", { colour: t(`game.${colour}`), move: saidSan(san) });
}

export function saidSan(san: string): string {
  const end = san.endsWith("#") ? t("game.say_mate") : san.endsWith("+") ? t("game.say_check") : "";
  const core = san.replace(/[+#]$/, "");
  if (core === "O-O") return t("game.say_castles_short") + end;
  if (core === "O-O-O") return t("game.say_castles_long") + end;
  const move = spell(san);
  if (!move) return san;
  const key: Key = move.takes ? "game.say_takes" : "game.say_to";
  const promotion = move.promotion ? t("game.say_promotes", { piece: t(`game.piece_${pieceKind(move.promotion)}`) }) : "";
  const piece = [t(`game.piece_${move.kind}`), move.from].filter(Boolean).join(" ");
  return t(key, { piece, square: move.to }) + promotion + end;
}

/** A typed move, "Nf3", "e2e4", "0-0", among those that are legal; several when it could be more than one. */
export function readMove(text: string, fen: string, legal: readonly string[]): readonly string[] {
  const typed = english(text.trim());
  const asUci = legal.filter((uci) => uci === typed.toLowerCase().replaceAll(/[-\s=]/g, ""));
  if (asUci.length > 0) return asUci;
  const pieces = placement(fen);
  const castling = /^[O0o]-?[O0o](-?[O0o])?[+#]?$/.exec(typed);
  if (castling) return legal.filter((uci) => castles(uci, pieces, castling[1] ? "c" : "g"));
  const move = spell(typed.replaceAll("-", "").replace(/[!?]+$/, ""));
  if (!move) return [];
  return legal.filter((uci) => {
    const kind = (pieces.get(uci.slice(0, 2)) ?? "").toLowerCase();
    const from = move.from === "" || (move.from.length === 2 ? uci.startsWith(move.from) : uci.slice(0, 2).includes(move.from));
    return kind === move.kind && uci.slice(2, 4) === move.to && from && (move.promotion === "" || uci[4] === move.promotion.toLowerCase());
  });
}

function castles(uci: string, pieces: ReadonlyMap<string, string>, file: "c" | "g"): boolean {
  return (pieces.get(uci.slice(0, 2)) ?? "").toLowerCase() === "k" && uci[0] === "e" && uci[2] === file;
}

/** Letters of the page's language become English ones; those of English, where it has no such letter, stay. */
function english(text: string): string {
  const one = (letter: string) => Object.entries(LETTERS).find(([, key]) => t(key) === letter)?.[0] ?? letter;
  return text.replace(/^./u, one).replace(/(?<==)./u, one);
}
