import { Box3, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { pieceGeometry } from "./meshes";
import { outline, radiusAt } from "./profiles";
import { KINDS, type Shape } from "./types";

// Sizes as `kempelen.core.pieces.PRESETS` has them: height, base, head, grip height, grip diameter.
const SETS: Record<string, Record<string, readonly [number, number, number, number, number]>> = {
  club: { K: [95, 38, 24, 48, 18], Q: [85, 36, 24, 44, 17], R: [55, 33, 24, 30, 18], B: [70, 33, 21, 36, 16], N: [60, 33, 24, 32, 18], P: [45, 29, 18, 24, 13] },
  thesis: { K: [100, 36, 24, 50, 20], Q: [50, 34, 24, 25, 18], R: [50, 32, 24, 25, 20], B: [44, 32, 20, 22, 16], N: [60, 32, 24, 30, 20], P: [36, 28, 18, 18, 14] },
  small: { K: [65, 26, 17, 33, 12], Q: [57, 25, 17, 29, 12], R: [38, 22, 16, 20, 12], B: [48, 22, 14, 25, 11], N: [43, 22, 17, 22, 12], P: [33, 20, 13, 17, 9] },
};

function shapeOf([height, base_diameter, head_diameter, grip_height, grip_diameter]: readonly [number, number, number, number, number]): Shape {
  return { height, base_diameter, head_diameter, grip_height, grip_diameter };
}

const ALL = Object.entries(SETS).flatMap(([set, kinds]) =>
  KINDS.map((kind) => ({ set, kind, shape: shapeOf(kinds[kind] ?? [0, 0, 0, 0, 0]) })),
);

describe.each(ALL)("$set $kind", ({ kind, shape }) => {
  const turned = outline(kind, shape);

  it("is as high and as wide as its sizes say", () => {
    const bounds = new Box3().setFromBufferAttribute(pieceGeometry(kind, shape).getAttribute("position") as never);
    expect(bounds.min.z).toBeCloseTo(0, 5);
    expect(Math.abs(bounds.max.z - shape.height)).toBeLessThan(0.5);
    expect(bounds.getSize(new Vector3()).x).toBeCloseTo(shape.base_diameter, 0);
    expect(Math.max(...turned.map(([radius]) => radius))).toBeCloseTo(shape.base_diameter / 2, 5);
  });

  it.runIf(kind !== "N")("is as thick at the grip as the pads find it, and no wider above than its head", () => {
    expect(radiusAt(turned, shape.grip_height)).toBeCloseTo(shape.grip_diameter / 2, 1);
    const above = turned.filter(([, height]) => height > shape.grip_height + 0.01);
    const widest = Math.max(...above.map(([radius]) => radius));
    expect(widest).toBeLessThanOrEqual(Math.max(shape.head_diameter, shape.grip_diameter) / 2 + 1e-6);
    expect(widest).toBeGreaterThan(0.85 * (shape.head_diameter / 2));
  });

  it("goes up from its bottom and closes at its axis", () => {
    expect(turned[0]).toEqual([0, 0]);
    expect(turned.at(-1)?.[0]).toBe(0);
    expect(turned.every(([radius, height]) => radius >= 0 && height >= 0 && height <= shape.height + 1e-6)).toBe(true);
  });
});

it("knows a knight by its head, which reaches forwards and is thinner than long", () => {
  const shape = shapeOf([60, 33, 24, 32, 18]);
  const at = pieceGeometry("N", shape).getAttribute("position");
  const head = Array.from({ length: at.count }, (_, i) => [at.getX(i), at.getY(i), at.getZ(i)] as const).filter(([, , z]) => z > 38);
  const reach = (axis: 0 | 1): [number, number] => [Math.min(...head.map((p) => p[axis])), Math.max(...head.map((p) => p[axis]))];
  const [back, front] = reach(0);
  const [left, right] = reach(1);
  expect(front - back).toBeGreaterThan(1.7 * (right - left));
  expect(Math.max(front, -back)).toBeLessThanOrEqual(shape.head_diameter / 2 + 0.5);
});

// The horse's sections meet in the bend of its throat, where nobody looks.
it.each([["K", 0.998], ["Q", 0.998], ["R", 0.998], ["N", 0.98]] as const)("turns the faces of %s outwards, as its normals", (kind, most) => {
  const geometry = pieceGeometry(kind, shapeOf([85, 36, 24, 44, 17]));
  const [at, normal, index] = [geometry.getAttribute("position"), geometry.getAttribute("normal"), geometry.getIndex()];
  let agree = 0;
  let count = 0;
  const [a, b, c, n] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
  for (let i = 0; index && i < index.count; i += 3) {
    a.fromBufferAttribute(at, index.getX(i));
    b.fromBufferAttribute(at, index.getX(i + 1));
    c.fromBufferAttribute(at, index.getX(i + 2));
    n.fromBufferAttribute(normal, index.getX(i));
    const face = b.sub(a).cross(c.sub(a));
    if (face.length() < 1e-6) continue;
    count++;
    if (face.dot(n) > 0) agree++;
  }
  expect(agree / count).toBeGreaterThan(most);
});
