/** Rate and detail with which a view is drawn: without a GPU it must leave time for the rest of the page. */

const SLOW = 30; // ms that a frame may occupy the page before the view is drawn simply
const FAST = 8; // ms; when simple frames take less, the view is drawn in full again
const FRAMES = 8; // frames that are evaluated together
const SHARE = 6; // simple drawing takes one of so many parts of the time
const LONGEST = 400; // ms between two simple frames at most
const TRIES = 2; // how often full drawing is tried again

export class Pace {
  /** Whether it is drawn simply. */
  simple = false;
  /** Milliseconds from one frame to the next. */
  wait = 0;

  /** @type {number[]} */
  #frames = [];
  #tries = TRIES;

  /** @param {boolean} noGpu whether the lack of a GPU is known */
  constructor(noGpu = false) {
    if (!noGpu) return;
    this.#be(true, SLOW);
    this.#tries = 0;
  }

  /**
   * Note how long a frame occupied the page in ms; returns whether the view is drawn differently from now on.
   *
   * @param {number} took
   */
  note(took) {
    this.#frames.push(took);
    if (this.#frames.length < FRAMES) return false;
    const typical = this.#frames.sort((a, b) => a - b)[FRAMES / 2];
    this.#frames = [];
    if (this.simple && typical < FAST && this.#tries > 0) {
      this.#tries -= 1;
      return this.#be(false, 0);
    }
    return this.simple || typical > SLOW ? this.#be(true, typical) : false;
  }

  /** @param {boolean} simple @param {number} typical */
  #be(simple, typical) {
    const changed = this.simple !== simple;
    this.simple = simple;
    this.wait = simple ? Math.min(LONGEST, SHARE * typical) : 0;
    return changed;
  }
}
