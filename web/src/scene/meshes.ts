// Chessmen as triangles. One geometry for each kind; its origin is the foot's centre, z is up.
import { BufferAttribute, BufferGeometry, Vector3 } from "three";
import { crossHeight, horseFoot, HORSE, outline, type Outline, type Section } from "./profiles";
import type { Kind, Shape } from "./types";

/** Triangles in the making. */
export class Soup {
  readonly #points: number[] = [];
  readonly #normals: number[] = [];
  readonly #uvs: number[] = [];
  readonly #faces: number[] = [];

  get count(): number {
    return this.#points.length / 3;
  }

  vertex(at: readonly number[], normal: readonly number[], uv: readonly number[]): number {
    this.#points.push(at[0] ?? 0, at[1] ?? 0, at[2] ?? 0);
    this.#normals.push(normal[0] ?? 0, normal[1] ?? 0, normal[2] ?? 0);
    this.#uvs.push(uv[0] ?? 0, uv[1] ?? 0);
    return this.count - 1;
  }

  face(a: number, b: number, c: number): void {
    this.#faces.push(a, b, c);
  }

  /** Joins a grid of rows of vertices, `columns` in each, without closing it. */
  grid(first: number, rows: number, columns: number): void {
    for (let i = 0; i + 1 < rows; i++) {
      for (let j = 0; j + 1 < columns; j++) {
        const a = first + i * columns + j;
        this.face(a, a + 1, a + columns);
        this.face(a + 1, a + columns + 1, a + columns);
      }
    }
  }

  add(geometry: BufferGeometry): void {
    const [at, normal, uv, index] = [
      geometry.getAttribute("position"),
      geometry.getAttribute("normal"),
      geometry.getAttribute("uv"),
      geometry.getIndex(),
    ];
    const first = this.count;
    for (let i = 0; i < at.count; i++) {
      this.vertex(
        [at.getX(i), at.getY(i), at.getZ(i)],
        [normal.getX(i), normal.getY(i), normal.getZ(i)],
        uv ? [uv.getX(i), uv.getY(i)] : [0, 0],
      );
    }
    const count = index ? index.count : at.count;
    for (let i = 0; i < count; i++) this.#faces.push(first + (index ? index.getX(i) : i));
    geometry.dispose();
  }

  geometry(): BufferGeometry {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(this.#points), 3));
    geometry.setAttribute("normal", new BufferAttribute(new Float32Array(this.#normals), 3));
    geometry.setAttribute("uv", new BufferAttribute(new Float32Array(this.#uvs), 2));
    geometry.setIndex(this.#faces);
    geometry.computeBoundingBox();
    geometry.computeBoundingSphere();
    return geometry;
  }
}

const SIDES = 36;
const CREASE = Math.cos((32 * Math.PI) / 180);
/** Length of wood, mm, that the grain's picture covers. */
const GRAIN_MM = 60;

export function pieceGeometry(kind: Kind, shape: Shape): BufferGeometry {
  const soup = new Soup();
  turn(soup, outline(kind, shape), kind === "R" ? battlement(shape) : undefined, kind === "Q" ? coronet(shape) : undefined);
  if (kind === "N") horse(soup, shape);
  if (kind === "K") cross(soup, shape);
  return soup.geometry();
}

type Carve = (radius: number, height: number, angle: number) => readonly [radius: number, height: number];

/** The rook's battlements: gaps cut into the rim. */
function battlement(shape: Shape): Carve {
  const head = shape.head_diameter / 2;
  const depth = 0.11 * (shape.height - shape.grip_height);
  const gaps = 6;
  return (radius, height, angle) => {
    const phase = ((angle / (2 * Math.PI)) * gaps) % 1;
    const cut = phase > 0.68 && height > shape.height - 0.01 && radius > 0.6 * head;
    return [radius, cut ? height - depth : height];
  };
}

/** The queen's coronet: a scalloped rim. */
function coronet(shape: Shape): Carve {
  const head = shape.head_diameter / 2;
  return (radius, height, angle) => {
    const rim = Math.max(0, (radius / head - 0.86) / 0.14);
    const wave = 0.5 - 0.5 * Math.cos(angle * 9);
    return height > shape.grip_height + 0.5 * (shape.height - shape.grip_height)
      ? [radius, height - rim * wave * 0.045 * (shape.height - shape.grip_height)]
      : [radius, height];
  };
}

/** A solid of revolution with creases where the outline has corners. */
function turn(soup: Soup, points: Outline, ...carves: (Carve | undefined)[]): void {
  const carve = carves.find((one) => one !== undefined);
  const sides = carve ? 72 : SIDES;
  for (const run of runs(points)) {
    const first = soup.count;
    const normals = slopes(run);
    run.forEach(([radius, height], i) => {
      const [out, up] = normals[i] ?? [1, 0];
      for (let j = 0; j <= sides; j++) {
        const angle = (2 * Math.PI * j) / sides;
        const [c, s] = [Math.cos(angle), Math.sin(angle)];
        const [r, h] = carve ? carve(radius, height, angle) : [radius, height];
        soup.vertex([r * c, r * s, h], [out * c, out * s, up], [(j / sides) * 2, height / GRAIN_MM]);
      }
    });
    soup.grid(first, run.length, sides + 1);
  }
}

/** The outline cut at its corners, so that each part is smooth. */
function runs(points: Outline): Outline[] {
  const out: [number, number][][] = [];
  let run: [number, number][] = [];
  points.forEach((point, i) => {
    const [before, after] = [points[i - 1], points[i + 1]];
    run.push([point[0], point[1]]);
    if (!before || !after || bend(before, point, after) >= CREASE) return;
    out.push(run);
    run = [[point[0], point[1]]];
  });
  out.push(run);
  return out.filter((one) => one.length > 1);
}

function bend(a: readonly [number, number], b: readonly [number, number], c: readonly [number, number]): number {
  const [x, y, u, v] = [b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]];
  return (x * u + y * v) / (Math.hypot(x, y) * Math.hypot(u, v) || 1);
}

/** Outward normals of an outline that goes up: (out, up). */
function slopes(run: Outline): (readonly [number, number])[] {
  return run.map((_, i) => {
    const [a, b] = [run[Math.max(i - 1, 0)], run[Math.min(i + 1, run.length - 1)]];
    if (!a || !b) return [1, 0] as const;
    const [dr, dh] = [b[0] - a[0], b[1] - a[1]];
    const length = Math.hypot(dr, dh) || 1;
    return [dh / length, -dr / length] as const;
  });
}

function cross(soup: Soup, shape: Shape): void {
  const tall = crossHeight(shape) * 1.25;
  const [low, wide, thick] = [shape.height - tall, 0.3 * tall, 0.26 * tall];
  // Four arms that widen outwards (a pattée), drawn once and turned.
  const arm = (from: number, to: number, a: number, b: number, angle: number): void => {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const middle = low + 0.6 * tall;
    const place = (along: number, across: number, y: number): number[] => [along * s + across * c, y, middle + along * c - across * s];
    prism(soup, [place(from, -a, 0), place(to, -b, 0), place(to, b, 0), place(from, a, 0)], thick / 2);
  };
  arm(0, 0.4 * tall, 0.1 * tall, 0.22 * tall, 0);
  arm(0, 0.6 * tall, 0.1 * tall, 0.24 * tall, Math.PI);
  arm(0, wide + 0.06 * tall, 0.1 * tall, 0.2 * tall, Math.PI / 2);
  arm(0, wide + 0.06 * tall, 0.1 * tall, 0.2 * tall, -Math.PI / 2);
}

/** A flat polygon in the x-z plane, `half` thick to both sides of y = 0. */
function prism(soup: Soup, polygon: number[][], half: number): void {
  const corners = area(polygon) > 0 ? polygon.toReversed() : polygon;
  for (const side of [-1, 1]) {
    const ring = corners.map(([x, , z]) => soup.vertex([x ?? 0, side * half, z ?? 0], [0, side, 0], [0, 0]));
    for (let i = 1; i + 1 < ring.length; i++) {
      const [a, b, c] = [ring[0] ?? 0, ring[i] ?? 0, ring[i + 1] ?? 0];
      if (side > 0) soup.face(a, b, c);
      else soup.face(a, c, b);
    }
  }
  corners.forEach((corner, i) => {
    const next = corners[(i + 1) % corners.length] ?? corner;
    const [x0, z0, x1, z1] = [corner[0] ?? 0, corner[2] ?? 0, next[0] ?? 0, next[2] ?? 0];
    const length = Math.hypot(x1 - x0, z1 - z0) || 1;
    const normal = [-(z1 - z0) / length, 0, (x1 - x0) / length];
    const a = soup.vertex([x0, -half, z0], normal, [0, 0]);
    const b = soup.vertex([x1, -half, z1], normal, [0, 0]);
    const c = soup.vertex([x1, half, z1], normal, [0, 0]);
    const d = soup.vertex([x0, half, z0], normal, [0, 0]);
    soup.face(a, b, c);
    soup.face(a, c, d);
  });
}

/** Twice the area of a polygon in the x-z plane, positive from x to z. */
function area(polygon: number[][]): number {
  return polygon.reduce((sum, [x = 0, , z = 0], i) => {
    const [u = 0, , v = 0] = polygon[(i + 1) % polygon.length] ?? [];
    return sum + x * v - u * z;
  }, 0);
}

// --- the horse ------------------------------------------------------------------------------------------------

const ROUND = 20;
const BETWEEN = 3;

function horse(soup: Soup, shape: Shape): void {
  const [low, head] = [horseFoot(shape), shape.head_diameter / 2];
  const tall = shape.height - low;
  const sections = refined(HORSE);
  const ridge = sections.map((section) => back(section, sections, head, low, tall));
  const first = soup.count;
  sections.forEach((section, i) => {
    const frame = frameAt(sections, i, head, tall);
    for (let j = 0; j <= ROUND; j++) {
      const angle = (2 * Math.PI * j) / ROUND;
      const [c, s] = [roundish(Math.cos(angle)), roundish(Math.sin(angle))];
      const [deep, thick] = [section.deep * head, section.thick * head];
      const at = [
        section.x * head + c * deep * frame.nx,
        s * thick,
        low + section.z * tall + c * deep * frame.nz,
      ];
      const [a, b] = [Math.cos(angle) / deep, Math.sin(angle) / thick];
      const length = Math.hypot(a, b);
      soup.vertex(at, [(a / length) * frame.nx, b / length, (a / length) * frame.nz], [j / ROUND, section.z]);
    }
  });
  soup.grid(first, sections.length, ROUND + 1);
  muzzle(soup, sections, first, head, low, tall);
  mane(soup, ridge.slice(BETWEEN, BETWEEN * 6 + 1), head);
  for (const side of [-1, 1]) ear(soup, side, head, low, tall);
  for (const side of [-1, 1]) {
    eye(soup, [0.3 * head, side * 0.335 * head, low + 0.8 * tall], 0.07 * head);
    eye(soup, [0.8 * head, side * 0.17 * head, low + 0.5 * tall], 0.05 * head);
  }
}

function roundish(value: number): number {
  return Math.sign(value) * Math.abs(value) ** 0.88;
}

function refined(sections: readonly Section[]): Section[] {
  const out: Section[] = [];
  for (let i = 0; i + 1 < sections.length; i++) {
    const [a, b, c, d] = [sections[Math.max(i - 1, 0)], sections[i], sections[i + 1], sections[Math.min(i + 2, sections.length - 1)]];
    if (!a || !b || !c || !d) continue;
    for (let j = 0; j < BETWEEN; j++) out.push(between(a, b, c, d, j / BETWEEN));
  }
  const last = sections.at(-1);
  return last ? [...out, last] : out;
}

function between(a: Section, b: Section, c: Section, d: Section, s: number): Section {
  const mix = (of: (section: Section) => number): number => {
    const [p, q, r, t] = [of(a), of(b), of(c), of(d)];
    return q + 0.5 * s * (r - p + s * (2 * p - 5 * q + 4 * r - t + s * (3 * (q - r) + t - p)));
  };
  return { x: mix((v) => v.x), z: mix((v) => v.z), deep: mix((v) => v.deep), thick: mix((v) => v.thick) };
}

/** The direction across the spine in the plane of the picture: forwards at the neck, up at the forehead. */
function frameAt(sections: readonly Section[], i: number, head: number, tall: number): { nx: number; nz: number } {
  const [a, b] = [sections[Math.max(i - 1, 0)], sections[Math.min(i + 1, sections.length - 1)]];
  if (!a || !b || i === 0) return { nx: 1, nz: 0 };
  const [dx, dz] = [(b.x - a.x) * head, (b.z - a.z) * tall];
  const length = Math.hypot(dx, dz) || 1;
  return { nx: dz / length, nz: -dx / length };
}

function back(section: Section, sections: readonly Section[], head: number, low: number, tall: number): readonly [number, number, number, number] {
  const { nx, nz } = frameAt(sections, sections.indexOf(section), head, tall);
  return [section.x * head - section.deep * head * nx, low + section.z * tall - section.deep * head * nz, -nx, -nz];
}

function muzzle(soup: Soup, sections: readonly Section[], first: number, head: number, low: number, tall: number): void {
  const last = sections.at(-1);
  if (!last) return;
  const frame = frameAt(sections, sections.length - 1, head, tall);
  const ahead = [-frame.nz, 0, frame.nx];
  const tip = soup.vertex(
    [last.x * head + ahead[0]! * 0.1 * head, 0, low + last.z * tall + ahead[2]! * 0.1 * head],
    ahead,
    [0, 1],
  );
  const ring = first + (sections.length - 1) * (ROUND + 1);
  for (let j = 0; j < ROUND; j++) soup.face(ring + j, ring + j + 1, tip);
}

/** A notched crest along the back of the neck. */
function mane(soup: Soup, ridge: readonly (readonly [number, number, number, number])[], head: number): void {
  const half = 0.13 * head;
  ridge.slice(0, -1).forEach(([x, z, ox, oz], i) => {
    const next = ridge[i + 1];
    if (!next) return;
    const out = 0.13 * head;
    const lower = [x - ox * out, 0, z - oz * out];
    const upper = [next[0] - next[2] * out, 0, next[1] - next[3] * out];
    const tip = [next[0] + next[2] * out, 0, next[1] + next[3] * out];
    const start = [x + ox * out * 0.35, 0, z + oz * out * 0.35];
    prism(soup, [lower, start, tip, upper], half);
  });
}

function ear(soup: Soup, side: number, head: number, low: number, tall: number): void {
  const foot = new Vector3(0.02 * head, side * 0.22 * head, low + 0.84 * tall);
  const tip = new Vector3(0.1 * head, side * 0.27 * head, low + tall);
  const [wide, ring] = [0.17 * head, 8];
  const first = soup.count;
  for (const share of [0, 0.55, 1]) {
    const middle = foot.clone().lerp(tip, share);
    const radius = wide * [1, 0.78, 0.02][Math.round(share * 2)]!;
    for (let j = 0; j <= ring; j++) {
      const angle = (2 * Math.PI * j) / ring;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      soup.vertex([middle.x + radius * c, middle.y + 0.7 * radius * s, middle.z], [c, s, 0.3], [0, 0]);
    }
  }
  soup.grid(first, 3, ring + 1);
}

function eye(soup: Soup, [x, y, z]: readonly [number, number, number], radius: number): void {
  const [rows, columns] = [6, 9];
  const first = soup.count;
  for (let i = 0; i < rows; i++) {
    const polar = (Math.PI * i) / (rows - 1);
    for (let j = 0; j < columns; j++) {
      const angle = (2 * Math.PI * j) / (columns - 1);
      const normal = [Math.sin(polar) * Math.cos(angle), Math.sin(polar) * Math.sin(angle), -Math.cos(polar)];
      soup.vertex([x + radius * normal[0]!, y + radius * normal[1]!, z + radius * normal[2]!], normal, [0, 0]);
    }
  }
  soup.grid(first, rows, columns);
}
