/** Going back in a run: the shown moment, and playing from it. */

import {notifyError} from "../kit/notices.js";
import {monitor} from "./monitor.js";

const NEAR_NOW = 0.15; // s from the end of the run that count as now
const FRAME = 80; // ms between two moments while it plays

/** Events: `play` when playing begins or ends. */
class Scrubbing extends /** @type {new () => import("../kit/events.js").Target<{play: null}>} */ (EventTarget) {
  /** Whether it plays. */
  plays = false;
  /** The speed of playing, in component seconds per second. */
  speed = 1;

  /** The component time to request next. @type {number | undefined} */
  #wanted;
  #busy = false;
  #timer = 0;

  constructor() {
    super();
    monitor.addEventListener("mode", () => !monitor.looking && this.plays && this.pause());
  }

  /** The component time that is shown, s. */
  get time() {
    return this.#wanted ?? monitor.time ?? 0;
  }

  /** Show a moment; at the end of an ongoing run, the present. @param {number} time */
  async to(time) {
    const {start, end} = monitor.past;
    if (!monitor.recording && time >= end - NEAR_NOW) {
      this.#wanted = undefined;
      monitor.lookAt(undefined);
      return;
    }
    this.#wanted = Math.min(end, Math.max(Number.isFinite(start) ? start : 0, time));
    if (this.#busy) return;
    this.#busy = true;
    try {
      while (this.#wanted !== undefined) {
        /** @type {number} */
        const asked = this.#wanted;
        const found = await monitor.ask("moment", {time: asked});
        if (this.#wanted === undefined) break; // back to the present
        if (found) monitor.lookAt(found, asked);
        if (this.#wanted === asked) this.#wanted = undefined;
      }
    } catch (error) {
      this.#wanted = undefined;
      this.pause();
      notifyError(error);
    } finally {
      this.#busy = false;
    }
  }

  /** Play from the shown moment, or at the end from the beginning. */
  play() {
    const {start, end} = monitor.past;
    this.plays = true;
    let time = this.time >= end - NEAR_NOW ? start : this.time;
    let last = performance.now();
    clearInterval(this.#timer);
    this.#timer = setInterval(() => {
      const now = performance.now();
      time += ((now - last) / 1000) * this.speed;
      last = now;
      if (!monitor.component || time >= monitor.past.end) this.pause();
      this.to(time);
    }, FRAME);
    this.dispatchEvent(new Event("play"));
  }

  pause() {
    clearInterval(this.#timer);
    this.plays = false;
    this.dispatchEvent(new Event("play"));
  }

  /** Show the change of a state before or after the shown moment. @param {number} step */
  toChange(step) {
    const times = monitor.past.changes.map((each) => each.time);
    const {time} = this;
    const found = step > 0 ? times.find((each) => each > time + 0.01) : times.findLast((each) => each < time - 0.01);
    this.to(found ?? (step > 0 ? monitor.past.end : monitor.past.start));
  }
}

export const scrubbing = new Scrubbing();
