import { afterEach, expect, it } from "vitest";
import { setLocale } from "../i18n/i18n.svelte";
import { settings } from "../state/settings.svelte";
import { scoreText, whiteShare } from "./evaluation";
import { afterMove, formatFen, parseFen, possibleCastling, problems, START_FEN } from "./fen";
import { localSan, readMove, saidMove } from "./san";

afterEach(() => setLocale("en"));

const problemsOf = (fen: string) => problems(parseFen(fen)!);

it("reads a FEN and writes the same", () => {
  const fen = "r3k2r/8/8/3pP3/8/8/8/R3K2R w Kq d6 3 17";
  expect(formatFen(parseFen(fen)!)).toBe(fen);
});

it.each(["", "x", "8/8/8/8/8/8/8 w - - 0 1", "9/8/8/8/8/8/8/8 w - - 0 1", `${START_FEN} 7`, "8/8/8/8/8/8/8/8 w z - 0 1"])("refuses %j", (text) => {
  expect(parseFen(text)).toBeUndefined();
});

it("finds what no game can begin from", () => {
  expect(problemsOf(START_FEN)).toEqual([]);
  expect(problemsOf("8/8/8/8/8/8/8/4K3 w - - 0 1")).toEqual(["kings_black"]);
  expect(problemsOf("4k2P/8/8/8/8/8/8/4K3 w - - 0 1")).toEqual(["pawns_edge"]);
  expect(problemsOf("4k3/8/8/8/8/8/4R3/4K3 w - - 0 1")).toEqual(["other_check"]);
  expect(problemsOf("4k3/4p3/8/8/8/8/4R3/4K3 w - - 0 1")).toEqual([]);
  expect(problemsOf("4k3/8/3N4/8/8/8/8/4K3 w - - 0 1")).toEqual(["other_check"]);
});

it("allows castling where king and rook are at home", () => {
  expect(possibleCastling(parseFen("r3k3/8/8/8/8/8/8/4K2R w - - 0 1")!.pieces)).toBe("Kq");
});

it("shows a move before the server has it", () => {
  expect(afterMove("4k3/8/8/8/8/8/8/R3K2R w KQ - 0 1", "e1g1").split(" ")[0]).toBe("4k3/8/8/8/8/8/8/R4RK1");
  expect(afterMove("4k3/8/8/3pP3/8/8/8/4K3 w - d6 0 1", "e5d6").split(" ")[0]).toBe("4k3/8/3P4/8/8/8/8/4K3");
  expect(afterMove("4k3/8/8/8/8/8/p7/4K3 b - - 0 1", "a2a1n").split(" ")[0]).toBe("4k3/8/8/8/8/8/8/n3K3");
});

it("writes moves with the language's letters", async () => {
  await setLocale("cs");
  expect(["Nbd7", "exd8=Q+", "O-O-O", "e4"].map(localSan)).toEqual(["Jbd7", "exd8=D+", "O-O-O", "e4"]);
});

it("says moves", async () => {
  expect(saidMove("Nf6", "black")).toBe("Black plays knight f6");
  expect(saidMove("Qxf7#", "white")).toBe("White plays queen takes f7, checkmate");
  expect(saidMove("exd8=Q+", "white")).toBe("White plays pawn e takes d8, promotes to queen, check");
  await setLocale("de");
  expect(saidMove("O-O", "white")).toBe("Weiß spielt kurze Rochade");
});

it("reads typed moves among the legal ones", async () => {
  const legal = ["e2e4", "g1f3", "b1c3", "b1a3"];
  expect(readMove("Nf3", START_FEN, legal)).toEqual(["g1f3"]);
  expect(readMove("e2-e4", START_FEN, legal)).toEqual(["e2e4"]);
  expect(readMove("e4!", START_FEN, legal)).toEqual(["e2e4"]);
  expect(readMove("Ke2", START_FEN, legal)).toEqual([]);
  expect(readMove("0-0", "4k3/8/8/8/8/8/8/R3K2R w KQ - 0 1", ["e1g1", "e1c1"])).toEqual(["e1g1"]);
  await setLocale("de");
  expect(readMove("Sf3", START_FEN, legal)).toEqual(["g1f3"]);
});

it("leaves a choice where what was typed fits several moves", () => {
  const fen = "4k3/8/8/8/8/8/8/R4R1K w - - 0 1";
  expect(readMove("Rd1", fen, ["a1d1", "f1d1"])).toHaveLength(2);
  expect(readMove("Rad1", fen, ["a1d1", "f1d1"])).toEqual(["a1d1"]);
});

it("draws the evaluation from White's side", () => {
  expect(whiteShare(null)).toBe(0.5);
  expect(whiteShare({ centipawns: 400, mate: null })).toBeCloseTo(10 / 11);
  expect(whiteShare({ centipawns: null, mate: -3 })).toBe(0);
  expect(scoreText({ centipawns: -123, mate: null })).toBe("−1.2");
  expect(scoreText({ centipawns: null, mate: 5 })).toBe("M5");
});

it("writes pieces as its reader has chosen", async () => {
  await setLocale("cs");
  const written = (["local", "figurine", "english"] as const).map((letters) => {
    settings.letters = letters;
    return localSan("Nxe8=Q+");
  });
  settings.letters = "local";
  expect(written).toEqual(["Jxe8=D+", "♘xe8=♕+", "Nxe8=Q+"]);
});
