// Mouse, finger and pen on the canvas: a piece that may be taken is dragged, anything else turns the picture.
import type { TableView } from "./view";

interface Finger {
  x: number;
  y: number;
}

const WHEEL = 0.0011;

export class Pointer {
  readonly #fingers = new Map<number, Finger>();
  #dragging: number | null = null;
  #spread = 0;
  readonly #ends: (() => void)[] = [];

  constructor(
    private readonly view: TableView,
    private readonly canvas: HTMLCanvasElement,
    private readonly interactive: () => boolean,
  ) {
    canvas.style.touchAction = "none";
    this.#on("pointerdown", (event) => this.#down(event));
    this.#on("pointermove", (event) => this.#move(event));
    this.#on("pointerup", (event) => this.#up(event, true));
    this.#on("pointercancel", (event) => this.#up(event, false));
    this.#on("pointerleave", () => this.view.hover(null));
    this.#on("wheel", (event) => this.#wheel(event), { passive: false });
    this.#on("contextmenu", (event) => event.preventDefault());
  }

  #on<Name extends keyof HTMLElementEventMap>(name: Name, call: (event: HTMLElementEventMap[Name]) => void, options?: AddEventListenerOptions): void {
    this.canvas.addEventListener(name, call, options);
    this.#ends.push(() => this.canvas.removeEventListener(name, call, options));
  }

  #down(event: PointerEvent): void {
    const at = this.#at(event);
    this.#fingers.set(event.pointerId, at);
    this.canvas.setPointerCapture(event.pointerId);
    if (this.#fingers.size === 2) {
      this.cancel();
      this.#spread = this.#apart();
      return;
    }
    const piece = this.interactive() && event.button === 0 && this.#fingers.size === 1 ? this.view.takeable(at.x, at.y) : null;
    if (!piece) return;
    this.#dragging = event.pointerId;
    this.view.take(piece);
    this.canvas.style.cursor = "grabbing";
  }

  #move(event: PointerEvent): void {
    const [now, before] = [this.#at(event), this.#fingers.get(event.pointerId)];
    if (!before) {
      const piece = this.interactive() && event.pointerType !== "touch" ? this.view.takeable(now.x, now.y) : null;
      this.view.hover(piece);
      this.canvas.style.cursor = piece ? "grab" : "";
      return;
    }
    this.#fingers.set(event.pointerId, now);
    if (this.#dragging === event.pointerId) this.view.dragTo(now.x, now.y);
    else if (this.#fingers.size === 2) this.#pinch(now.x - before.x, now.y - before.y);
    else if (event.buttons & 6 || event.shiftKey) this.view.pan(now.x - before.x, now.y - before.y);
    else this.view.turn(now.x - before.x, now.y - before.y);
  }

  #pinch(right: number, down: number): void {
    const apart = this.#apart();
    if (apart > 0 && this.#spread > 0) this.view.zoom(this.#spread / apart);
    this.#spread = apart;
    this.view.pan(right / 2, down / 2);
  }

  #up(event: PointerEvent, done: boolean): void {
    this.#fingers.delete(event.pointerId);
    if (this.#dragging !== event.pointerId) return;
    this.#dragging = null;
    this.canvas.style.cursor = "";
    if (done) this.view.drop();
    else this.view.letGo();
  }

  #wheel(event: WheelEvent): void {
    event.preventDefault();
    this.view.zoom(Math.exp(Math.min(Math.max(event.deltaY, -200), 200) * WHEEL));
  }

  /** Puts back what is being dragged. */
  cancel(): void {
    this.#dragging = null;
    this.view.letGo();
    this.canvas.style.cursor = "";
  }

  #at(event: PointerEvent): Finger {
    const { left, top } = this.canvas.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  }

  #apart(): number {
    const [a, b] = [...this.#fingers.values()];
    return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }

  dispose(): void {
    for (const end of this.#ends) end();
  }
}
