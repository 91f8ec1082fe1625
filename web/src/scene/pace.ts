/** Fewer pixels while a slow machine shows motion; all of them at rest. */
export class Pace {
  share = 1;
  #last = 0;
  #mean = 16;

  note(now: number): void {
    const took = now - this.#last;
    this.#last = now;
    if (took > 400) return;
    this.#mean += 0.15 * (took - this.#mean);
    if (this.#mean > 42) this.#set(Math.max(this.share * 0.8, 0.4));
    else if (this.#mean < 20 && this.share < 1) this.#set(Math.min(this.share * 1.1, 1));
  }

  #set(share: number): void {
    this.share = share;
    this.#mean = 30;
  }

  /** Nothing moves: returns whether the picture should be drawn once more, better. */
  rest(): boolean {
    const better = this.share < 1;
    this.share = 1;
    return better;
  }
}
