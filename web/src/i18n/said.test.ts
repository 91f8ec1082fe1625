import { afterEach, describe, expect, it } from "vitest";
import type { Problem, Said } from "../api/types";
import { refusal, spoken } from "./said";
import { setLocale } from "./i18n.svelte";

afterEach(() => setLocale("en"));

const say = (code: string, text: string, data: Said["data"] = {}): Said => ({ code, text, data });
const PUT_BACK = say("put_back", "put the white knight back on f3", { piece: "N", target: "f3" });

function problem(part: Partial<Problem>): Problem {
  return { error: "It is so.", hint: "Do this.", kind: "game", error_said: [], hint_said: [], ...part };
}

describe("what the server says", () => {
  it("has pieces and squares in the page's words", async () => {
    expect(spoken([PUT_BACK], "")).toBe("Put the white knight back on f3.");
    await setLocale("cs");
    expect(spoken([PUT_BACK], "")).toBe("Vraťte figurku (bílý jezdec) zpět na f3.");
  });

  it("has moves with the letters of the language, and alternatives as it lists them", async () => {
    const asked = say("what_was_played", "", { moves: ["Nf3", "Ng5"] });
    expect(spoken([asked], "")).toBe("What was played: Nf3 or Ng5?");
    await setLocale("de");
    expect(spoken([asked], "")).toBe("Was wurde gespielt: Sf3 oder Sg5?");
  });

  it("is one sentence after the other, English among them where there are no other words", async () => {
    await setLocale("de");
    const parts = [say("", "Motor 3 is hot."), say("game_is_kept", "The game is kept.")];
    expect(spoken(parts, "")).toBe("Motor 3 is hot. Die Partie ist gespeichert.");
  });

  it("names a piece of which only the colour is known, or nothing", () => {
    expect(spoken([say("take_off", "", { piece: "black", place: "e5" })], "")).toBe("Take the black piece off e5.");
    expect(spoken([say("still_there", "", { piece: "", square: "e5" })], "")).toBe("Is the piece still on e5?");
  });

  it("is English as it came where nothing else was sent", () => {
    expect(spoken([], "As it came.")).toBe("As it came.");
  });
});

describe("a refusal", () => {
  it("has words and a next step of its own", async () => {
    const why = problem({ error_said: [say("not_homed", "")], hint_said: [say("home_first", "")] });
    expect(refusal(why)).toEqual(["The robot does not know where it is.", "Home it first."]);
  });

  it("is at least said to be of a kind, the English after it", async () => {
    expect(refusal(problem({ kind: "link" }))).toEqual(["It is so.", "Do this."]);
    await setLocale("cs");
    expect(refusal(problem({ kind: "link" }))).toEqual(["S robotem se nelze spojit.", "It is so. Do this."]);
    expect(refusal(problem({ kind: "" }))).toEqual(["It is so.", "Do this."]);
  });
});
