// Positions as FEN has them: read, written, and looked at for what a game cannot begin from.

export const START_FEN = "rnbqkbnr/pppppppp/8/8/8/8/PPPPPPPP/RNBQKBNR w KQkq - 0 1";
export const FILES = "abcdefgh";

/** A FEN letter by square: "e1" -> "K". */
export type Placement = ReadonlyMap<string, string>;

export interface Position {
  readonly pieces: Placement;
  readonly turn: "white" | "black";
  readonly castling: string;
  readonly enPassant: string;
  readonly halfmoves: number;
  readonly number: number;
}

/** All squares as the eye reads a board: a8, b8 … h1. */
export const SQUARES: readonly string[] = Array.from({ length: 64 }, (_, i) => `${FILES[i % 8]}${8 - Math.floor(i / 8)}`);

export function colourOf(letter: string): "white" | "black" {
  return letter === letter.toUpperCase() ? "white" : "black";
}

export function isSquare(place: string | null | undefined): place is string {
  return typeof place === "string" && /^[a-h][1-8]$/.test(place);
}

/** The pieces of the first field; what cannot be read is left out. */
export function placement(fen: string): Map<string, string> {
  const pieces = new Map<string, string>();
  const rows = (fen.split(" ")[0] ?? "").split("/");
  rows.slice(0, 8).forEach((row, down) => {
    let file = 0;
    for (const letter of row) {
      if (/[1-8]/.test(letter)) file += Number(letter);
      else if (/[prnbqk]/i.test(letter) && file < 8) pieces.set(`${FILES[file++]}${8 - down}`, letter);
    }
  });
  return pieces;
}

/** `undefined` for what is no FEN. */
export function parseFen(text: string): Position | undefined {
  const fields = text.trim().split(/\s+/);
  const [board = "", turn = "w", castling = "-", enPassant = "-", halfmoves = "0", number = "1"] = fields;
  const rows = board.split("/");
  const whole = rows.length === 8 && rows.every((row) => /^[prnbqkPRNBQK1-8]+$/.test(row) && width(row) === 8);
  if (!whole || !/^[wb]$/.test(turn) || !/^(-|K?Q?k?q?)$/.test(castling) || !/^(-|[a-h][36])$/.test(enPassant)) return undefined;
  if (!/^\d+$/.test(halfmoves) || !/^\d+$/.test(number) || fields.length > 6) return undefined;
  return {
    pieces: placement(board),
    turn: turn === "w" ? "white" : "black",
    castling,
    enPassant,
    halfmoves: Number(halfmoves),
    number: Number(number),
  };
}

function width(row: string): number {
  return [...row].reduce((sum, letter) => sum + (/\d/.test(letter) ? Number(letter) : 1), 0);
}

export function formatFen(position: Position): string {
  const turn = position.turn === "white" ? "w" : "b";
  const castling = position.castling || "-";
  return `${formatPlacement(position.pieces)} ${turn} ${castling} ${position.enPassant} ${position.halfmoves} ${position.number}`;
}

export function formatPlacement(pieces: Placement): string {
  const rows = Array.from({ length: 8 }, (_, down) => {
    const row = Array.from(FILES, (file) => pieces.get(`${file}${8 - down}`) ?? "1").join("");
    return row.replaceAll(/1+/g, (empty) => String(empty.length));
  });
  return rows.join("/");
}

/** Castling rights that kings and rooks on their places allow. */
export function possibleCastling(pieces: Placement): string {
  const rights = [
    ["K", "e1", "h1", "R"],
    ["Q", "e1", "a1", "R"],
    ["k", "e8", "h8", "r"],
    ["q", "e8", "a8", "r"],
  ] as const;
  const has = ([right, king, rook, letter]: (typeof rights)[number]) =>
    pieces.get(king) === (right === right.toUpperCase() ? "K" : "k") && pieces.get(rook) === letter;
  return rights.filter(has).map(([right]) => right).join("") || "-";
}

export type PositionProblem = "kings_white" | "kings_black" | "pawns_edge" | "too_many" | "other_check";

/** Why no game can begin here; the server has the last word. */
export function problems(position: Position): PositionProblem[] {
  const found: PositionProblem[] = [];
  const letters = [...position.pieces.values()];
  const count = (letter: string) => letters.filter((one) => one === letter).length;
  if (count("K") !== 1) found.push("kings_white");
  if (count("k") !== 1) found.push("kings_black");
  if ([...position.pieces].some(([square, letter]) => /[pP]/.test(letter) && /[18]/.test(square))) found.push("pawns_edge");
  const most = (colour: string) => letters.filter((letter) => colourOf(letter) === colour).length > 16;
  if (most("white") || most("black")) found.push("too_many");
  if (found.length === 0 && otherKingAttacked(position)) found.push("other_check");
  return found;
}

/** Whether the side that is not to move stands in check: then its king could be taken. */
function otherKingAttacked({ pieces, turn }: Position): boolean {
  const king = [...pieces].find(([, letter]) => letter === (turn === "white" ? "k" : "K"))?.[0];
  if (!king) return false;
  return [...pieces].some(([square, letter]) => colourOf(letter) === turn && attacks(pieces, square, letter, king));
}

function attacks(pieces: Placement, from: string, letter: string, to: string): boolean {
  const [dx, dy] = [FILES.indexOf(to[0]!) - FILES.indexOf(from[0]!), Number(to[1]) - Number(from[1])];
  const kind = letter.toLowerCase();
  const [ax, ay] = [Math.abs(dx), Math.abs(dy)];
  if (kind === "p") return ax === 1 && dy === (letter === "P" ? 1 : -1);
  if (kind === "k") return Math.max(ax, ay) === 1;
  if (kind === "n") return ax * ay === 2;
  const straight = ax === 0 || ay === 0;
  const diagonal = ax === ay;
  if (!(straight && kind !== "b") && !(diagonal && kind !== "r")) return false;
  return empty(pieces, from, Math.sign(dx), Math.sign(dy), Math.max(ax, ay));
}

function empty(pieces: Placement, from: string, x: number, y: number, steps: number): boolean {
  for (let i = 1; i < steps; i++) {
    if (pieces.has(`${FILES[FILES.indexOf(from[0]!) + i * x]}${Number(from[1]) + i * y}`)) return false;
  }
  return true;
}

/** What stands where after a move; castling and en passant are told by what moves how. */
export function afterMove(fen: string, uci: string): string {
  const pieces = placement(fen);
  const [from, to, promotion] = [uci.slice(0, 2), uci.slice(2, 4), uci[4]];
  const piece = pieces.get(from);
  if (!piece) return fen;
  const kind = piece.toLowerCase();
  if (kind === "p" && from[0] !== to[0] && !pieces.has(to)) pieces.delete(`${to[0]}${from[1]}`);
  if (kind === "k" && from[0] === "e" && (to[0] === "g" || to[0] === "c")) moveRook(pieces, to);
  pieces.delete(from);
  pieces.set(to, promotion ? (colourOf(piece) === "white" ? promotion.toUpperCase() : promotion) : piece);
  return [formatPlacement(pieces), ...fen.split(" ").slice(1)].join(" ");
}

function moveRook(pieces: Map<string, string>, king: string): void {
  const [corner, beside] = king[0] === "g" ? ["h", "f"] : ["a", "d"];
  const rook = pieces.get(`${corner}${king[1]}`);
  if (!rook) return;
  pieces.delete(`${corner}${king[1]}`);
  pieces.set(`${beside}${king[1]}`, rook);
}
