/**
 * Marks on the canvas that a panel shows: one panel's at a time.
 *
 * @import {Live} from "../canvas/live-marks.js"
 */

import {page} from "./page.js";

/** @param {Map<number, Map<string, Live>>} marks for each automaton, those of its states and transitions */
export function showMarks(marks) {
  page.highlight = marks;
  page.dispatchEvent(new Event("highlight"));
}

/** Show beside code what tests passed of it. @param {import("./page.js").Tested} [tested] nothing without it */
export function showTested(tested) {
  if (page.tested?.tab === tested?.tab && page.tested?.code === tested?.code) return;
  page.tested = tested;
  page.dispatchEvent(new Event("tested"));
}

/** Remove the marks from the canvas. */
export function showNoMarks() {
  if (!page.highlight) return;
  page.highlight = undefined;
  page.dispatchEvent(new Event("highlight"));
}
