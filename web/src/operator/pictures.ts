// Pictures of the camera, one after the other: the next is asked for when the last has come, so none pile up.
export interface PictureSource {
  fetch(url: string, signal: AbortSignal): Promise<Blob>;
  show(blob: Blob): void;
  fail(error: unknown): void;
}

export const PAUSE_MS = 120;
export const AFTER_ERROR_MS = 1500;

export class PictureLoop {
  #timer: ReturnType<typeof setTimeout> | undefined;
  #running: AbortController | undefined;

  constructor(
    private readonly source: PictureSource,
    private url: string,
  ) {}

  start(): void {
    if (this.#running) return;
    this.#running = new AbortController();
    void this.#next(this.#running.signal);
  }

  stop(): void {
    this.#running?.abort();
    this.#running = undefined;
    clearTimeout(this.#timer);
  }

  /** Another kind of picture, at once. */
  change(url: string): void {
    if (url === this.url) return;
    this.url = url;
    if (!this.#running) return;
    this.stop();
    this.start();
  }

  async #next(signal: AbortSignal): Promise<void> {
    let pause = PAUSE_MS;
    try {
      const blob = await this.source.fetch(this.url, signal);
      if (!signal.aborted) this.source.show(blob);
    } catch (error) {
      if (!signal.aborted) this.source.fail(error);
      pause = AFTER_ERROR_MS;
    }
    if (!signal.aborted) this.#timer = setTimeout(() => void this.#next(signal), pause);
  }
}
