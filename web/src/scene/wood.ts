// Pictures of wood and of the board's top, painted when they are needed: nothing is downloaded.
import { CanvasTexture, RepeatWrapping, SRGBColorSpace } from "three";
import type { Geometry } from "./types";

/** Numbers that look random and are the same each time (mulberry32). */
export function randomness(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
  };
}

export interface Wood {
  readonly base: string;
  readonly dark: string;
  readonly light: string;
  /** How strongly the grain shows, 0 to 1. */
  readonly grain: number;
}

export const MAPLE: Wood = { base: "#cbb088", dark: "#a88558", light: "#dcc8a4", grain: 0.55 };
export const WALNUT: Wood = { base: "#6f4d36", dark: "#452d1f", light: "#8d6849", grain: 0.62 };
export const FRAME: Wood = { base: "#50362a", dark: "#33211a", light: "#6b4c3a", grain: 0.55 };
export const BOXWOOD: Wood = { base: "#e6d6b8", dark: "#cbb48a", light: "#f3e8d2", grain: 0.35 };
export const EBONY: Wood = { base: "#332822", dark: "#1c1512", light: "#4a3a31", grain: 0.5 };
export const OAK: Wood = { base: "#a99a86", dark: "#8b7b66", light: "#bfb19d", grain: 0.4 };
export const SMOKED: Wood = { base: "#3b332d", dark: "#262019", light: "#4a4038", grain: 0.42 };

function canvas(width: number, height: number): [HTMLCanvasElement, CanvasRenderingContext2D] {
  const element = document.createElement("canvas");
  element.width = width;
  element.height = height;
  const context = element.getContext("2d");
  if (!context) throw new Error("no 2D canvas");
  return [element, context];
}

/** Streaks along x, with a slow swing as of a sawn log. */
function paintGrain(context: CanvasRenderingContext2D, width: number, height: number, wood: Wood, random: () => number): void {
  context.fillStyle = wood.base;
  context.fillRect(0, 0, width, height);
  const swing = 2 + random() * 5;
  const phase = random() * 7;
  const lines = Math.round(height * 1.1);
  for (let i = 0; i < lines; i++) {
    const y = random() * height;
    const start = (random() - 0.4) * width;
    context.strokeStyle = random() < 0.56 ? wood.dark : wood.light;
    context.globalAlpha = wood.grain * (0.05 + 0.22 * random() ** 2);
    context.lineWidth = 0.4 + random() * 1.6;
    context.beginPath();
    for (let x = start; x <= start + width * (0.4 + random() * 0.8); x += width / 14) {
      context.lineTo(x, y + swing * Math.sin(phase + x / (0.33 * width) + y / (0.45 * height)));
    }
    context.stroke();
  }
  context.globalAlpha = 1;
}

const PIXELS = 2048;

/** The board's top with its frame: column along the board's x, row against its y. */
export function boardTexture(geometry: Geometry, sharpness: number): CanvasTexture {
  const { square, border } = geometry.board;
  const scale = PIXELS / (8 * square + 2 * border);
  const [element, context] = canvas(PIXELS, PIXELS);
  const [edge, side] = [border * scale, square * scale];
  frame(context, edge);
  const planks = { light: planksOf(MAPLE, 11), dark: planksOf(WALNUT, 23) };
  const random = randomness(5);
  for (let file = 0; file < 8; file++) {
    for (let rank = 0; rank < 8; rank++) {
      const wood = (file + rank) % 2 === 1 ? planks.light : planks.dark;
      inlay(context, wood, edge + file * side, edge + (7 - rank) * side, side, random);
    }
  }
  context.strokeStyle = "#e3c795";
  context.lineWidth = Math.max(1, 0.7 * scale);
  context.strokeRect(edge - 1.4 * scale, edge - 1.4 * scale, PIXELS - 2 * edge + 2.8 * scale, PIXELS - 2 * edge + 2.8 * scale);
  coordinates(context, edge, side);
  const texture = new CanvasTexture(element);
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = sharpness;
  return texture;
}

function planksOf(wood: Wood, seed: number): HTMLCanvasElement {
  const [element, context] = canvas(1024, 1024);
  paintGrain(context, 1024, 1024, wood, randomness(seed));
  return element;
}

function inlay(context: CanvasRenderingContext2D, wood: HTMLCanvasElement, x: number, y: number, side: number, random: () => number): void {
  const room = wood.width - side;
  context.drawImage(wood, random() * room, random() * room, side, side, x, y, side + 0.5, side + 0.5);
  context.fillStyle = random() < 0.5 ? "#000000" : "#ffffff";
  context.globalAlpha = 0.06 * random();
  context.fillRect(x, y, side + 0.5, side + 0.5);
  context.globalAlpha = 0.22;
  context.strokeStyle = "#20130a";
  context.lineWidth = 1;
  context.strokeRect(x + 0.5, y + 0.5, side - 1, side - 1);
  context.globalAlpha = 1;
}

/** Four strips with mitred corners. */
function frame(context: CanvasRenderingContext2D, edge: number): void {
  const [strip, paint] = canvas(PIXELS, Math.ceil(edge) + 2);
  paintGrain(paint, strip.width, strip.height, FRAME, randomness(31));
  for (let turn = 0; turn < 4; turn++) {
    context.save();
    context.translate(PIXELS / 2, PIXELS / 2);
    context.rotate((turn * Math.PI) / 2);
    context.translate(-PIXELS / 2, -PIXELS / 2);
    context.beginPath();
    context.moveTo(0, 0);
    context.lineTo(PIXELS, 0);
    context.lineTo(PIXELS - edge, edge);
    context.lineTo(edge, edge);
    context.clip();
    context.drawImage(strip, 0, 0);
    context.restore();
  }
}

function coordinates(context: CanvasRenderingContext2D, edge: number, side: number): void {
  context.fillStyle = "#ead5ab";
  context.globalAlpha = 0.92;
  context.font = `600 ${Math.round(0.62 * edge)}px Georgia, "Noto Serif", "DejaVu Serif", serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (let i = 0; i < 8; i++) {
    const along = edge + (i + 0.5) * side;
    const file = String.fromCharCode(97 + i);
    const rank = String(i + 1);
    context.fillText(file, along, PIXELS - 0.47 * edge);
    context.fillText(rank, 0.5 * edge, PIXELS - along);
    upsideDown(context, file, along, 0.47 * edge);
    upsideDown(context, rank, PIXELS - 0.5 * edge, PIXELS - along);
  }
  context.globalAlpha = 1;
}

function upsideDown(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  context.save();
  context.translate(x, y);
  context.rotate(Math.PI);
  context.fillText(text, 0, 0);
  context.restore();
}

/** A patch of wood that is repeated. */
export function woodTexture(wood: Wood, seed: number, repeat: readonly [number, number], size = 512): CanvasTexture {
  const [element, context] = canvas(size, size);
  paintGrain(context, size, size, wood, randomness(seed));
  const texture = new CanvasTexture(element);
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.repeat.set(repeat[0], repeat[1]);
  texture.anisotropy = 4;
  return texture;
}

/** A round soft spot: the dark below things that stand, and the glow of a marked square. */
export function spotTexture(): CanvasTexture {
  const [element, context] = canvas(128, 128);
  const gradient = context.createRadialGradient(64, 64, 18, 64, 64, 64);
  gradient.addColorStop(0, "rgba(255,255,255,0.95)");
  gradient.addColorStop(0.45, "rgba(255,255,255,0.5)");
  gradient.addColorStop(1, "rgba(255,255,255,0)");
  context.fillStyle = gradient;
  context.fillRect(0, 0, 128, 128);
  return new CanvasTexture(element);
}
