/**
 * The base of the elements of the monitor.
 *
 * @import {MonitorEvents} from "./shown-run.js"
 */

import {html} from "lit";

import {offers} from "../kit/buttons.js";
import {PageElement} from "../data/element.js";
import {language, t} from "../kit/texts.js";
import {monitor} from "./monitor.js";

/**
 * Milliseconds between two updates of numbers and lists; the canvas is updated at once. It is less than the 0.1 s
 * between two snapshots, so that one frame of the page shows all of a snapshot.
 */
const PACE = 80;
/** Elements that will show the next moment, all in one frame. @type {Set<MonitorElement>} */
const waiting = new Set();
let shownAt = -PACE; // when they were last updated, ms

/** @param {MonitorElement} element */
function showSoon(element) {
  const isPlanned = waiting.size > 0;
  waiting.add(element);
  if (isPlanned) return;
  const wait = shownAt + PACE - performance.now();
  if (wait > 0) setTimeout(showMoment, wait);
  else queueMicrotask(showMoment);
}

function showMoment() {
  shownAt = performance.now();
  for (const element of waiting) element.requestUpdate();
  waiting.clear();
}

/** Drawn again at the events of the monitor that `kinds` names. */
export class MonitorElement extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: []};
  /** @type {(keyof MonitorEvents)[]} */
  static kinds = ["shown", "mode", "structure"];

  connectedCallback() {
    super.connectedCallback();
    for (const kind of /** @type {typeof MonitorElement} */ (this.constructor).kinds)
      this.listen(monitor, kind, kind === "shown" ? () => showSoon(this) : () => this.requestUpdate());
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    waiting.delete(this);
  }
}

/** What one may do where nothing runs. @param {import("../kit/registry.js").Context} context */
export const nothingRuns = (context) =>
  html`<p>${t("Nothing runs yet.")}</p>
    ${offers({run: t("Run"), followComponent: t("Watch what runs elsewhere")}, context)}`;

/** Why nothing is known of the robot's joints. */
export function whyUnknown() {
  const {trouble = ""} = monitor.newest?.robot ?? {};
  return trouble
    ? t("The robot's joints cannot be read: {trouble}", {trouble})
    : t("No robot here reports its joints.");
}

/** A time of the wall's clock. @param {number} seconds since 1970 */
export const clockTime = (seconds) => new Date(seconds * 1000).toLocaleTimeString(language);
