// The table's form: changes to it, each giving a new one.
import type { ShapeConfig, TableFormView, Tray } from "./api";

export const KINDS = ["king", "queen", "rook", "bishop", "knight", "pawn"] as const;
export type Kind = (typeof KINDS)[number];

export const SIZES = ["height", "base_diameter", "head_diameter", "grip_height", "grip_diameter"] as const;
export type Size = (typeof SIZES)[number];

type Shapes = Readonly<Partial<Record<Kind, Partial<ShapeConfig>>>>;
export type Preset = "club" | "thesis" | "small";

/** A form with everything filled in that the server would take for granted. */
export interface Draft {
  readonly square: number;
  readonly trays: readonly Required<Tray>[];
  readonly pieces: Shapes & { readonly preset: Preset };
}

/** What is sent: sizes that do not differ from the set's are left out. */
export function toForm({ square, trays, pieces }: TableFormView): Draft {
  const own: Partial<Record<Kind, Partial<ShapeConfig>>> = {};
  for (const kind of KINDS) {
    const sizes = given(pieces?.[kind]);
    if (sizes) own[kind] = sizes;
  }
  const whole = trays.map((tray) => ({ rows: 8, columns: 2, pitch: 50, height: 0, ...tray }));
  return { square, trays: whole, pieces: { ...own, preset: pieces?.preset ?? "club" } };
}

export function withSize(draft: Draft, kind: Kind, size: Size, value: number, preset: number | undefined): Draft {
  const { [size]: _, ...others } = given(draft.pieces[kind]) ?? {};
  const sizes = value === preset ? others : { ...others, [size]: value };
  return withKind(draft, kind, Object.keys(sizes).length > 0 ? sizes : undefined);
}

export function withKind(draft: Draft, kind: Kind, sizes: Partial<ShapeConfig> | undefined): Draft {
  const { [kind]: _, ...others } = draft.pieces;
  return { ...draft, pieces: { ...others, ...(sizes && { [kind]: sizes }), preset: draft.pieces.preset } };
}

export function changed(draft: Draft, kept: TableFormView): boolean {
  return JSON.stringify(ordered(toForm(draft))) !== JSON.stringify(ordered(toForm(kept)));
}

function given(sizes: Partial<ShapeConfig> | undefined): Partial<ShapeConfig> | undefined {
  const known = Object.entries(sizes ?? {}).filter(([, value]) => value !== null && value !== undefined);
  return known.length > 0 ? (Object.fromEntries(known) as Partial<ShapeConfig>) : undefined;
}

function ordered(value: unknown): unknown {
  if (Array.isArray(value)) return value.map(ordered);
  if (typeof value !== "object" || value === null) return value;
  const entries = Object.entries(value).sort(([one], [other]) => (one < other ? -1 : 1));
  return entries.map(([key, inner]) => [key, ordered(inner)]);
}
