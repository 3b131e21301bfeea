/**
 * The components that were started here: their status by tab, and a message when one ends with an error.
 */

import {notify} from "../kit/notices.js";
import {page} from "./page.js";
import {outputLog} from "./output-log.js";
import {FAILED} from "./problems.js";
import {store} from "./store.js";
import {t} from "../kit/texts.js";

/** @type {(string | undefined)[]} */
const ALIVE = ["generating", "starting", "started", "stopping"];

/** @import {StartedPush} from "./protocol.js" */

class ComponentStatus {
  /** @type {Map<number, StartedPush>} */
  #started = new Map();
  /** Functions that remove the message that the component of a tab has ended. @type {Map<number, () => void>} */
  #notices = new Map();
  /** The tabs whose run has failed in code that was changed since. @type {Set<number>} */
  #corrected = new Set();
  /** The tabs whose run this window saw, and did not stop. @type {Set<number>} */
  #watched = new Set();

  constructor() {
    store.addEventListener("started", ({detail}) => this.#take(detail));
    store.addEventListener("problems", ({detail}) => this.#review(detail.tab));
    store.addEventListener("closed", ({detail}) => this.#forget(detail.tab));
  }

  /**
   * The last status of the component of a tab; undefined if it never ran.
   *
   * @returns {StartedPush | undefined}
   * @param {number} tab
   */
  of(tab) {
    return this.#started.get(tab);
  }

  /** @param {number} tab */
  isAlive(tab) {
    return ALIVE.includes(this.of(tab)?.status);
  }

  /** The names of the components that start or run. */
  get names() {
    return [...this.#started.values()].filter(({tab}) => this.isAlive(tab)).map(({component}) => component);
  }

  /** This window stops the component of a tab, or all. @param {number} [tab] */
  stopHere(tab) {
    if (tab) this.#watched.delete(tab);
    else this.#watched.clear();
  }

  /** How a run has ended, in a window that saw it: also who has stopped it, if not this window. @param {StartedPush} run */
  endOf(run) {
    const {tab, message, elsewhere} = run;
    if (lacksRobot(run)) return t("it ended: no robot is here");
    return (this.#watched.has(tab) && elsewhere) || message;
  }

  /** The run of a tab that has ended with an error in code that is still there. @param {number} tab */
  failed(tab) {
    const run = this.of(tab);
    return run?.status === "ended" && run.place && !this.#corrected.has(tab) ? run : undefined;
  }

  /** The components of the realm that this editor has not started: another editor has, or a terminal. */
  get elsewhere() {
    const {tabs, present} = store.workspace;
    const ours = new Set(tabs.flatMap(({tab}) => this.of(tab)?.component ?? []));
    return present.map(({component}) => component).filter((name) => !ours.has(name));
  }

  /** Remove the message that the component of a tab has ended. @param {number} tab */
  dismiss(tab) {
    this.#notices.get(tab)?.();
    this.#notices.delete(tab);
  }

  /** @param {StartedPush} run */
  #take(run) {
    const former = this.of(run.tab)?.status; // undefined for the first status in a new window
    this.#started.set(run.tab, run);
    this.#corrected.delete(run.tab);
    if (run.status === "generating" || (!former && this.isAlive(run.tab))) this.#watched.add(run.tab);
    if (run.status === "generating" && former !== "generating") outputLog.clear(run.tab);
    const failed = run.exitCode || run.place;
    if (run.status === "ended" && failed && former && !["ended", "stopping"].includes(former)) this.#tellEnd(run);
  }

  /** @param {StartedPush} run */
  #tellEnd(run) {
    const {tab, component, place} = run;
    const message = this.endOf(run);
    const outcome = message ? subjected(message, component) : t("{component} has ended", {component});
    this.dismiss(tab);
    if (place) {
      page.dispatchEvent(new CustomEvent("alert", {detail: `${outcome}.`})); // the second row shows it
      return;
    }
    const why = lacksRobot(run) ? undefined : outputLog.lastError(tab);
    const text = `${outcome}${why === undefined ? "." : `: ${why}`}`;
    this.#notices.set(tab, notify(text, "error", undefined, {tab}));
  }

  /** Show where a run has ended. @param {StartedPush} run */
  showEnd({tab, place, line}) {
    if (!place) return;
    page.show(tab);
    page.jump(place, {line});
  }

  /** The code that failed has changed: what was said of it is over. @param {number} tab */
  #review(tab) {
    const {place} = this.of(tab) ?? {};
    const {problems = [], revision, checked} = store.documents.get(tab) ?? {};
    if (problems.some(({code}) => code === FAILED)) this.#corrected.delete(tab);
    else if (place && revision === checked) {
      this.#corrected.add(tab);
      this.dismiss(tab);
    }
  }

  /** @param {number} tab */
  #forget(tab) {
    this.#started.delete(tab);
    this.#corrected.delete(tab);
    this.#watched.delete(tab);
    this.dismiss(tab);
  }
}

/** Whether a run could not begin because nothing is in its realm. @param {StartedPush} run */
const lacksRobot = ({tab, exitCode}) =>
  exitCode === 1 && Boolean(outputLog.lastError(tab)?.includes("the realm has no servants"));

/** A message about a component, which begins with its name. @param {string} message @param {string} component */
const subjected = (message, component) =>
  message.startsWith("it ") ? message.replace("it", component) : `${component}: ${message}`;

/** How a component ended. @param {string} message that says so */
export function spokenEnd(message) {
  const how = message.replace(/^it (has ended:? |ended:? |was |has )?/, "");
  if (!how) return t("Ended");
  return how.startsWith("with") ? `Ended ${how}` : t("Ended: {how}", {how});
}

export const started = new ComponentStatus();
