/**
 * The components that were started here: their status by tab, and a message when one ends with an error.
 */

import {notify} from "./notices.js";
import {page} from "./page.js";
import {outputLog} from "./panels/output-log.js";
import {store} from "./store.js";

/** @type {(string | undefined)[]} */
const ALIVE = ["generating", "starting", "running", "stopping"];

/** @import {Place, RunPush} from "./protocol.js" */

class Runs {
  /** @type {Map<number, RunPush>} */
  #runs = new Map();
  /** Functions that remove the message that the component of a tab has ended. @type {Map<number, () => void>} */
  #notices = new Map();

  constructor() {
    store.addEventListener("run", ({detail}) => this.#take(detail));
    store.addEventListener("closed", ({detail}) => this.#forget(detail.tab));
  }

  /**
   * The last status of the component of a tab; undefined if it never ran.
   *
   * @returns {RunPush | undefined}
   * @param {number} tab
   */
  of(tab) {
    return this.#runs.get(tab);
  }

  /** @param {number} tab */
  isRunning(tab) {
    return ALIVE.includes(this.of(tab)?.status);
  }

  /** Remove the message that the component of a tab has ended. @param {number} tab */
  dismiss(tab) {
    this.#notices.get(tab)?.();
    this.#notices.delete(tab);
  }

  /** @param {RunPush} run */
  #take(run) {
    const former = this.of(run.tab)?.status; // undefined for the first status in a new window
    this.#runs.set(run.tab, run);
    if (run.status === "generating" && former !== "generating") outputLog.clear(run.tab);
    const failed = run.exitCode || run.place;
    if (run.status === "ended" && failed && former && !["ended", "stopping"].includes(former)) this.#tellEnd(run);
  }

  /** @param {RunPush} run */
  #tellEnd({tab, message, place, line}) {
    const outcome = (message || "it has ended").replace(/^it /, "The component ");
    const text = outputLog.lastError(tab, place);
    this.#notices.set(
      tab,
      notify(
        `${outcome}${text === undefined ? "." : `: ${text}`}`,
        "error",
        place ? {label: line ? `line ${line}` : "show it", run: () => showPlace(tab, place, line)} : undefined,
      ),
    );
  }

  /** @param {number} tab */
  #forget(tab) {
    this.#runs.delete(tab);
    this.#notices.delete(tab);
  }
}

/** @param {number} tab @param {Place} place @param {number} [line] */
function showPlace(tab, place, line) {
  page.show(tab);
  page.jump(place, {line});
}

export const runs = new Runs();
