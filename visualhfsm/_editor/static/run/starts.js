/** What this window has started: from which tabs, and which runs it may steer, also after it was loaded again. */

import {windowStorage} from "../kit/storage.js";

const STEERED = "visualhfsm.steered";

export class Starts {
  /** The tab from which each component was started last. @type {Map<string, number>} */
  #tabs = new Map();
  /** The components that this window has started and that have not ended. @type {Set<string>} */
  #running = new Set();
  /** The run of each component that this window may steer, by when it was started. @type {Map<string, number>} */
  #steered = new Map(JSON.parse(windowStorage.getItem(STEERED) ?? "[]"));

  /** This window starts a component. @param {string} component */
  begin(component) {
    this.#running.add(component);
  }

  /** A component has ended. @param {string} component */
  end(component) {
    this.#running.delete(component);
  }

  /** Nothing that was started is known to run any more. */
  forget() {
    this.#running.clear();
  }

  /** Whether this window has started a component. @param {string} component */
  has(component) {
    return this.#running.has(component);
  }

  /** A component was started from a tab, by any window. @param {string} component @param {number} tab */
  from(component, tab) {
    this.#tabs.set(component, tab);
  }

  /** The tab from which a component was started last. @param {string} component */
  tabOf(component) {
    return this.#tabs.get(component);
  }

  /**
   * Whether a run of a component may be steered: this window has started it, or the user has allowed it.
   *
   * @param {string} component
   * @param {number} startedAt which run it is
   */
  maySteer(component, startedAt) {
    if (this.has(component)) this.allow(component, startedAt);
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
