/** Go to a place of a document: show it on the canvas, and open the panel in which it is edited. */

import {page} from "../page.js";

/**
 * Show a place of the shown document.
 *
 * @param {import("./places.js").Place} place
 * @param {{line?: number, column?: number, focus?: boolean}} where line and column from 1; with `focus` the field
 *   gets the keyboard
 */
export function jump(place, {line = 1, column = 1, focus = true} = {}) {
  const {kind, automaton, id, part} = place;
  if (automaton && page.document?.automata.has(automaton)) {
    page.open(automaton, {states: kind === "state" ? [id] : [], transitions: kind === "transition" ? [id] : []});
    page.dispatchEvent(new Event("reveal"));
  }
  if (!part) return;
  const isOfData = kind === "document" || kind === "automaton";
  page.dispatchEvent(new CustomEvent(isOfData ? "data" : "edit", {detail: {...place, line, column, focus}}));
}

/** Give the keyboard back to the canvas. */
export function leaveToCanvas() {
  page.dispatchEvent(new Event("focus-canvas"));
}
