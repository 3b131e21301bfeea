/** What this window has started: from which tabs, and which runs it may steer, also after it was loaded again. */

import {windowStorage} from "../kit/location.js";

const STEERED = "visualhfsm.steered";

export class OwnRuns {
  /** The tab from which each component was started last, by any window. @type {Map<string, number>} */
  tabs = new Map();
  /** The components that this window has started and that are not known to have ended. @type {Set<string>} */
  running = new Set();
  /** The run of each component that this window may steer, by when it was started. @type {Map<string, number>} */
  #steered = new Map(JSON.parse(windowStorage.getItem(STEERED) ?? "[]"));

  /**
   * Whether a run of a component may be steered: this window has started it, or the user has allowed it.
   *
   * @param {string} component
   * @param {number} startedAt which run it is
   */
  maySteer(component, startedAt) {
    if (this.running.has(component)) this.allow(component, startedAt);
    return this.#steered.get(component) === startedAt;
  }

  /**
   * Allow a run to be steered; with undefined, none of the component.
   *
   * @param {string} component
   * @param {number | undefined} startedAt
   */
  allow(component, startedAt) {
    if (startedAt === undefined) this.#steered.delete(component);
    else this.#steered.set(component, startedAt);
    windowStorage.setItem(STEERED, JSON.stringify([...this.#steered]));
  }
}
