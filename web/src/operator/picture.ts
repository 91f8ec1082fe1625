// The table from above, as numbers for an SVG: x to the right, y up in millimetres, y down in the picture.
import type { CalibrationView } from "../api/types";
import type { FindingView, GeometryView } from "./api";

export type Flat = readonly [x: number, y: number];

export interface Box {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** As much of a robot's reach is shown beyond what stands there, mm: an arm reaches far. */
const BEYOND = 160;

/** Everything that stands there and the reach around it, with an edge. */
export function viewBox(geometry: GeometryView, edge = 25): Box {
  const r = geometry.radius;
  const points: Flat[] = [
    ...geometry.areas.flatMap((area) => area.corners),
    ...geometry.places.flatMap(({ at: [x, y] }): Flat[] => [[x - r, y - r], [x + r, y + r]]),
  ];
  const [left, right] = shown(points.map(([x]) => x), geometry.lower[0], geometry.upper[0], edge);
  const [bottom, top] = shown(points.map(([, y]) => y), geometry.lower[1], geometry.upper[1], edge);
  return { x: left, y: -top, width: right - left, height: top - bottom };
}

function shown(things: readonly number[], lower: number, upper: number, edge: number): [number, number] {
  const [least, most] = [Math.min(...things), Math.max(...things)];
  return [Math.min(least, Math.max(lower, least - BEYOND)) - edge, Math.max(most, Math.min(upper, most + BEYOND)) + edge];
}

export function outline(corners: readonly Flat[]): string {
  return corners.map(([x, y]) => `${round(x)},${round(-y)}`).join(" ");
}

/** A square's four corners on a board that may be turned; file and rank from 0. */
export function cell(board: readonly Flat[], file: number, rank: number): readonly Flat[] {
  const [a, b, , d] = board;
  if (!a || !b || !d) return [];
  const at = (x: number, y: number): Flat => [
    a[0] + (x * (b[0] - a[0]) + y * (d[0] - a[0])) / 8,
    a[1] + (x * (b[1] - a[1]) + y * (d[1] - a[1])) / 8,
  ];
  return [at(file, rank), at(file + 1, rank), at(file + 1, rank + 1), at(file, rank + 1)];
}

/** Names of everything that some finding is about. */
export function marked(findings: readonly FindingView[]): ReadonlySet<string> {
  return new Set(findings.flatMap((finding) => finding.where));
}

export interface Note {
  readonly at: Flat;
  readonly text: string;
}

/** The number of each finding, where its place is in the picture; pieces and lifts have none. */
export function notes(geometry: GeometryView, findings: readonly FindingView[]): readonly Note[] {
  const places = new Map(geometry.places.map((place) => [place.name, place.at as Flat]));
  const areas = new Map(geometry.areas.map((area) => [area.name, middle(area.corners)]));
  return findings.flatMap((finding) => {
    const at = finding.where.map((name) => places.get(name)).find(Boolean) ?? areas.get(finding.where[0] ?? "");
    return at ? [{ at, text: `${round(finding.by)} ${finding.unit}` }] : [];
  });
}

export interface CornerMark {
  readonly corner: string;
  readonly at: Flat;
  /** mm; null where nothing can be said yet. */
  readonly residual: number | null;
  readonly state: "touched" | "good" | "fair" | "bad";
  /** Of the circle drawn around it, mm: the residual, much enlarged. */
  readonly radius: number;
}

/** Larger ones are refused. */
export const TOLERANCE = 1.5;
const FAIR = 0.5;
const ENLARGED = 24;
const LEAST = 6;
const MOST = 40;

/** Two corners fit any board: their residuals say nothing. */
export function cornerMarks({ touched, residuals }: Pick<CalibrationView, "touched" | "residuals">): readonly CornerMark[] {
  const corners = Object.entries(touched);
  return corners.map(([corner, point]) => {
    const residual = corners.length > 2 ? (residuals[corner] ?? null) : null;
    return {
      corner,
      at: [point[0], point[1]],
      residual,
      state: residual === null ? "touched" : residual > TOLERANCE ? "bad" : residual > FAIR ? "fair" : "good",
      radius: Math.min(MOST, LEAST + ENLARGED * (residual ?? 0)),
    };
  });
}

export function round(value: number): number {
  return Math.round(10 * value) / 10;
}

function middle(corners: readonly Flat[]): Flat {
  const sum = corners.reduce<[number, number]>(([sx, sy], [x, y]) => [sx + x, sy + y], [0, 0]);
  return [sum[0] / corners.length, sum[1] / corners.length];
}
