import { describe, expect, it } from "vitest";
import { decide, mayTake, snapped, targets, type Rules } from "./drag";
import { onSquare, TABLE } from "./fixture";
import { squareAt, squareCentre, slotAt, toBoard, toRobot } from "./frames";
import { atHand, onLevel, pick } from "./picking";

const PERSON: Rules = { legal: ["e2e4", "e2e3", "g1f3", "a7a8q", "a7a8n", "e1g1"], personToMove: true, hand: false };
const WITH_HAND: Rules = { ...PERSON, hand: true };
const pawn = onSquare(1, "P", "e2", 2, -3);

describe("squares and slots", () => {
  it("are found again from their middles, on a board that is turned", () => {
    for (const square of ["a1", "h1", "e4", "a8", "h8"]) expect(squareAt(TABLE, squareCentre(TABLE, square))).toBe(square);
    expect(squareAt(TABLE, toRobot(TABLE, [-5, 20, 0]))).toBeNull();
    expect(slotAt(TABLE, [70, 95, 0])).toBe("left2");
    expect(slotAt(TABLE, [300, 300, 0])).toBeNull();
    const [x, y] = toBoard(TABLE, squareCentre(TABLE, "c6"));
    expect([x, y].map(Math.round)).toEqual([125, 275]);
  });
});

describe("a piece that is set down", () => {
  const drop = (square: string, rules: Rules = PERSON, piece = pawn) => decide(piece, squareCentre(TABLE, square), TABLE, rules);

  it("makes a legal move", () => {
    expect(drop("e4")).toEqual({ kind: "move", uci: "e2e4", to: "e4" });
    expect(drop("g1", PERSON, onSquare(2, "K", "e1"))).toEqual({ kind: "move", uci: "e1g1", to: "g1" });
  });

  it("asks what a pawn becomes", () => {
    const decision = drop("a8", PERSON, onSquare(3, "P", "a7"));
    expect(decision).toEqual({ kind: "promotion", from: "a7", to: "a8", choices: ["a7a8q", "a7a8n"] });
  });

  it("is carried there by the virtual hand when it is no legal move, so that the camera sees it", () => {
    const [x, y] = squareCentre(TABLE, "e5");
    expect(drop("e5", WITH_HAND)).toEqual({ kind: "hand_carry", source: [pawn.at[0], pawn.at[1]], target: [x, y] });
    expect(decide(pawn, [60, 50, 0], TABLE, WITH_HAND).kind).toBe("hand_carry");
    expect(drop("e4", { ...WITH_HAND, personToMove: false }).kind).toBe("hand_carry");
  });

  it("goes back where no hand is there to carry it", () => {
    expect(drop("e5")).toEqual({ kind: "refused", why: "illegal" });
    expect(drop("e4", { ...PERSON, personToMove: false })).toEqual({ kind: "refused", why: "not_your_turn" });
  });

  it("was never taken when it hardly moved", () => {
    const [x, y, z] = pawn.at;
    expect(decide(pawn, [x + 5, y, z], TABLE, WITH_HAND)).toEqual({ kind: "nothing" });
    expect(decide(pawn, toRobot(TABLE, [220, 90, 0]), TABLE, PERSON)).toEqual({ kind: "nothing" });
    expect(decide(pawn, toRobot(TABLE, [204, 96, 0]), TABLE, WITH_HAND).kind).toBe("hand_carry");
  });
});

describe("what may be taken", () => {
  it("is what has a legal move, or anything where a hand is", () => {
    expect(mayTake(pawn, TABLE, PERSON)).toBe(true);
    expect(mayTake(onSquare(5, "P", "d2"), TABLE, PERSON)).toBe(false);
    expect(mayTake(onSquare(5, "P", "d2"), TABLE, WITH_HAND)).toBe(true);
    expect(mayTake(pawn, TABLE, { ...PERSON, personToMove: false })).toBe(false);
  });

  it("shows where it may go, each square once", () => {
    expect(targets(pawn, TABLE, PERSON)).toEqual(["e4", "e3"]);
    expect(targets(onSquare(3, "P", "a7"), TABLE, PERSON)).toEqual(["a8"]);
    const near = toRobot(TABLE, [215, 190, 0]);
    expect(squareAt(TABLE, snapped(pawn, near, TABLE, PERSON))).toBe("e4");
    expect(snapped(pawn, near, TABLE, PERSON)).toEqual(squareCentre(TABLE, "e4"));
    const off = toRobot(TABLE, [260, 190, 0]);
    expect(snapped(pawn, off, TABLE, PERSON)).toEqual(off);
  });
});

describe("picking", () => {
  const king = onSquare(7, "K", "e1");
  const ray = (from: readonly [number, number, number], to: readonly [number, number, number]) => {
    const way = [to[0] - from[0], to[1] - from[1], to[2] - from[2]] as const;
    const length = Math.hypot(...way);
    return { from, way: [way[0] / length, way[1] / length, way[2] / length] as const };
  };

  it("takes the nearer of two pieces that a ray meets, and nothing beside them", () => {
    const [x, y, z] = king.at;
    const eye = [x, y - 500, z + 300] as const;
    expect(pick(ray(eye, [x, y, z + 80]), [pawn, king], TABLE)?.id).toBe(7);
    expect(pick(ray(eye, [pawn.at[0], pawn.at[1], z + 40]), [pawn], TABLE)?.id).toBe(1);
    expect(pick(ray(eye, [x + 200, y, z]), [pawn, king], TABLE)).toBeNull();
    expect(pick(ray(eye, [x, y - 900, z + 500]), [king], TABLE)).toBeNull();
    expect(pick(ray([x, y, z + 400], [x, y, z]), [king], TABLE)?.id).toBe(7);
  });

  it("finds a piece that lies on its side", () => {
    const lying = { ...king, quaternion: [Math.SQRT1_2, 0, Math.SQRT1_2, 0] as const };
    const [x, y, z] = king.at;
    expect(pick(ray([x + 70, y, z + 300], [x + 70, y, z]), [lying], TABLE)?.id).toBe(7);
    expect(pick(ray([x + 70, y, z + 300], [x + 70, y, z]), [king], TABLE)).toBeNull();
  });

  it("finds what a hand can reach", () => {
    const [x, y, z] = pawn.at;
    expect(atHand([x + 20, y, z + 40], [pawn, king], TABLE, 55)?.id).toBe(1);
    expect(atHand([x, y, z + 300], [pawn, king], TABLE, 55)).toBeNull();
  });

  it("meets a level ahead of it only", () => {
    expect(onLevel(ray([0, 0, 100], [10, 0, 50]), 0)).toEqual([20, 0, 0]);
    expect(onLevel(ray([0, 0, 100], [10, 0, 150]), 0)).toBeNull();
    expect(onLevel({ from: [0, 0, 10], way: [1, 0, 0] }, 0)).toBeNull();
  });
});
