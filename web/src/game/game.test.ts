import { render, screen } from "@testing-library/svelte";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { clockText, secondsLeft } from "../chess/clock";
import { setLocale } from "../i18n/i18n.svelte";
import { Herald } from "../shell/herald";
import { live } from "../state/live.svelte";
import { gameView, moveView, promptView, snapshot, stationView } from "../testing/views";
import ClockFace from "./ClockFace.svelte";
import MoveList from "./MoveList.svelte";
import NowCard from "./NowCard.svelte";
import PlayerStrip from "./PlayerStrip.svelte";
import Prompts from "./Prompts.svelte";
import { activityText, reasonText } from "./words";

const HTML = "<img src=x onerror=alert(1)>";
const E5 = moveView({ ply: 2, san: "e5", uci: "e7e5", fen: "rnbqkbnr/pppp1ppp/8/4p3/4P3/8/PPPP1PPP/RNBQKBNR w KQkq - 0 2" });

beforeEach(() => void vi.useFakeTimers({ now: 1_000_000_000 }));
afterEach(async () => {
  vi.useRealTimers();
  await setLocale("en");
});

describe("the clock", () => {
  const clock = { white: 65, black: 30, running: "white", at: 1_000_000 } as const;

  it("runs for one side only, and not below none", () => {
    expect(secondsLeft(clock, "white", 1_000_002)).toBe(63);
    expect(secondsLeft(clock, "black", 1_000_002)).toBe(30);
    expect(secondsLeft(clock, "white", 1_000_500)).toBe(0);
  });

  it("shows tenths at the end, hours at the beginning", () => {
    expect([5400, 65, 20, 9.87, 0].map(clockText)).toEqual(["1:30:00", "1:05", "0:20", "0:09.8", "0:00.0"]);
  });

  it("counts down by itself between two messages", async () => {
    live.receive(snapshot({}));
    render(ClockFace, { clock: { ...clock, at: live.now() }, colour: "white" });
    expect(screen.getByRole("timer")).toHaveTextContent("1:05");
    await vi.advanceTimersByTimeAsync(6000);
    expect(screen.getByRole("timer")).toHaveTextContent("0:59");
  });
});

it("counts down what the robot is doing", async () => {
  const activity = { kind: "carrying", piece: "N", source: "g1", target: "f3", number: 1, count: 1, ends_at: 1_000_002.1 } as const;
  live.receive(snapshot({ game: gameView({ person_to_move: false }), station: stationView(), activity }));
  render(NowCard);
  expect(screen.getByText("The robot is carrying the knight to f3")).toBeVisible();
  expect(screen.getByText("2.1 s left")).toBeVisible();
  await vi.advanceTimersByTimeAsync(1000);
  expect(screen.getByText("1.1 s left")).toBeVisible();
});

it("says what the robot does with the piece in the case that the language wants", async () => {
  const activity = { kind: "carrying", piece: "n", source: "g8", target: "left3", number: 1, count: 1, ends_at: null } as const;
  await setLocale("cs");
  expect(activityText(activity)).toBe("odnáší jezdce ze šachovnice");
});

describe("prompts", () => {
  it("offer the answers that fit, in a live region", () => {
    const candidates = [{ uci: "g1f3", san: "Nf3" }];
    live.receive(
      snapshot({ prompts: [promptView({ text: "Put the white knight back on f3." }), promptView({ id: "p2", kind: "which_move", candidates })] }),
    );
    render(Prompts);
    expect(screen.getByRole("region")).toHaveAttribute("aria-live", "assertive");
    expect(screen.getByText("Put the white knight back on f3.")).toBeVisible();
    expect(screen.getAllByRole("button").map((button) => button.textContent.trim())).toEqual(["Done", "Nf3"]);
  });

  it("leave the answer to players", () => {
    live.receive(snapshot({ prompts: [promptView()] }, { role: "spectator" }));
    render(Prompts);
    expect(screen.queryAllByRole("button")).toEqual([]);
  });
});

it("shows names as text, whatever is in them", () => {
  const { container } = render(PlayerStrip, { game: gameView({ black: { name: HTML, kind: "engine" } }), colour: "black" });
  expect(container.querySelector("img")).toBeNull();
  expect(screen.getByText(HTML)).toBeVisible();
});

it("lists moves by number with the language's letters, each to look back at", async () => {
  await setLocale("de");
  const onlook = vi.fn();
  const knight = moveView({ ply: 3, san: "Nf3", uci: "g1f3" });
  render(MoveList, { moves: [moveView(), E5, knight], startFen: gameView().start_fen, ply: 3, onlook });
  const button = screen.getByRole("button", { name: "Weiß spielt Springer f3" });
  expect(button).toHaveTextContent("Sf3");
  expect(button).toHaveAttribute("aria-current", "step");
  screen.getByRole("button", { name: "Schwarz spielt Bauer e5" }).click();
  expect(onlook).toHaveBeenCalledExactlyOnceWith(2);
});

it("begins with Black's move where the position does", () => {
  render(MoveList, { moves: [E5], startFen: "4k3/4p3/8/8/8/8/8/4K3 b - - 0 17", ply: 1, onlook: () => undefined });
  expect(screen.getByRole("listitem")).toHaveTextContent("17. …e5");
});

it("knows reasons in the page's language, and shows others as they came", async () => {
  await setLocale("de");
  expect(reasonText("White's time is over, and Black cannot mate")).toBe("Die Zeit von Weiß ist um, und Schwarz kann nicht mattsetzen");
  expect(reasonText("adjudication by the arbiter")).toBe("adjudication by the arbiter");
});

describe("what is said aloud", () => {
  it("are new moves, whose turn it is, and the end", () => {
    const herald = new Herald();
    expect(herald.game(gameView({ moves: [moveView()], person_to_move: false }))).toEqual([]);
    expect(herald.game(gameView({ moves: [moveView(), E5] }))).toEqual(["Black plays pawn e5 Your move."]);
    expect(herald.game(gameView({ moves: [moveView(), E5], result: "0-1", reason: "White resigns" }))).toEqual([
      "Black wins. White resigns.",
    ]);
  });

  it("are prompts, once each", () => {
    const herald = new Herald();
    expect(herald.prompts([promptView({ text: "A" })], null)).toEqual(["A"]);
    expect(herald.prompts([promptView({ text: "A" }), promptView({ id: "p2", text: "B" })], null)).toEqual(["B"]);
  });
});
