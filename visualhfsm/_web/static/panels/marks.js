/**
 * Marks on the canvas that a panel shows: one panel's at a time.
 *
 * @import {Live} from "../canvas/live-marks.js"
 */

import {page} from "../page.js";

/** @param {Map<number, Map<string, Live>>} marks for each automaton, those of its states and transitions */
export function showMarks(marks) {
  page.highlight = marks;
  page.dispatchEvent(new Event("highlight"));
}

/** Remove the marks from the canvas. */
export function showNoMarks() {
  if (!page.highlight) return;
  page.highlight = undefined;
  page.dispatchEvent(new Event("highlight"));
}
