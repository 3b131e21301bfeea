/**
 * The base of the elements of the monitor.
 *
 * @import {PropertyValues} from "lit"
 * @import {MonitorEvents} from "./monitor.js"
 */

import {PageElement} from "../element.js";
import {monitor} from "./monitor.js";

const PACE = 100; // ms between two moments that numbers and lists show; the canvas waits for nothing

/** Drawn again at the events of the monitor that `kinds` names. */
export class MonitorElement extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: []};
  /** @type {(keyof MonitorEvents)[]} */
  static kinds = ["shown", "mode", "structure"];

  #drawn = 0;
  #waiting = 0;

  connectedCallback() {
    super.connectedCallback();
    for (const kind of /** @type {typeof MonitorElement} */ (this.constructor).kinds)
      this.listen(monitor, kind, kind === "shown" ? () => this.#later() : () => this.requestUpdate());
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    clearTimeout(this.#waiting);
    this.#waiting = 0;
  }

  /** @param {PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    this.#drawn = performance.now();
  }

  #later() {
    if (this.#waiting) return;
    const wait = this.#drawn + PACE - performance.now();
    if (wait <= 0) this.requestUpdate();
    else {
      this.#waiting = setTimeout(() => {
        this.#waiting = 0;
        this.requestUpdate();
      }, wait);
    }
  }
}

/** Component time as people read it. @param {number} seconds */
export function spokenSeconds(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const minutes = Math.floor(seconds / 60);
  return minutes ? `${minutes}:${(seconds - minutes * 60).toFixed(1).padStart(4, "0")} min` : `${seconds.toFixed(1)} s`;
}

/** Why nothing is known of the robot's joints. */
export function whyUnknown() {
  const {trouble = ""} = monitor.newest?.robot ?? {};
  return trouble ? `The robot's joints cannot be read: ${trouble}` : "No robot reports its joints in this realm.";
}

/** A time of the wall's clock. @param {number} seconds since 1970 */
export const clockTime = (seconds) => new Date(seconds * 1000).toLocaleTimeString();
