// What everything in the 3D view is made of.
import { MeshStandardMaterial } from "three";
import { standard, type Materials } from "./furniture";
import { BOXWOOD, EBONY, woodTexture } from "./wood";

export type AllMaterials = Materials & Record<"white" | "black" | "ghost", MeshStandardMaterial>;

/** Metal without a room to mirror would be black: then it is paint. */
export function makeMaterials(rich: boolean): AllMaterials {
  const metal = rich ? 1 : 0.25;
  const textured = (texture: MeshStandardMaterial["map"], roughness: number): MeshStandardMaterial =>
    new MeshStandardMaterial({ map: texture, roughness });
  const ghost = standard("#5fe0b0", 0.6);
  ghost.transparent = true;
  ghost.opacity = 0.38;
  ghost.depthWrite = false;
  return {
    boardTop: standard("#ffffff", 0.48),
    frame: standard("#4b2d1b", 0.5),
    tray: standard("#7d5a3c", 0.6),
    slot: standard("#5f4029", 0.85),
    aluminium: standard("#c3c7cc", 0.34, 0.85 * metal),
    enamel: standard("#c9cbc8", 0.42, 0.1),
    steel: standard("#8b9199", 0.3, 0.9 * metal),
    dark: standard("#22262b", 0.55, 0.15),
    accent: standard("#1f8a68", 0.5),
    pad: standard("#17191c", 0.85),
    skin: standard("#d9a184", 0.62),
    sleeve: standard("#33415f", 0.9),
    white: textured(woodTexture(BOXWOOD, 7, [1, 1], 256), 0.46),
    black: textured(woodTexture(EBONY, 9, [1, 1], 256), 0.4),
    ghost,
  };
}
