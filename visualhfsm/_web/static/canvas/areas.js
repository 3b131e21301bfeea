/**
 * What notes and frames cover: pure functions of their places and sizes in pixels.
 *
 * @import {Annotation, Automaton} from "../protocol.js"
 * @import {Box} from "./geometry.js"
 * @typedef {{states: Iterable<number>, transitions: Iterable<number>, annotations: Iterable<number>}} Selection
 */

import {contains} from "./geometry.js";

/** The colors that there are; the first is that of a note whose color is blank or unknown. */
export const COLORS = ["yellow", "blue", "green", "pink", "gray"];
/** The least width and height, in pixels of the drawing. */
export const SMALLEST = 24;

/** The farthest place on a canvas, in pixels. */
export const FARTHEST = 1e6;

/** A place or a size that a canvas has. @param {number} value @param {number} least */
export const within = (value, least) => Math.max(least, Math.min(FARTHEST, value));

/** @param {Annotation} annotation */
export const isFrame = ({kind}) => kind === "frame";

/** The color that it is drawn in. @param {Annotation} annotation */
export function colorOf(annotation) {
  const color = annotation.color.trim() || (isFrame(annotation) ? "gray" : "yellow");
  return COLORS.includes(color) ? color : COLORS[0];
}

/** The rectangle that it takes, whatever its file says. @param {Annotation} annotation @returns {Box} */
export function areaOf({x, y, width, height}) {
  const [left, top] = [within(x, -FARTHEST), within(y, -FARTHEST)];
  return {left, top, right: left + within(width, SMALLEST), bottom: top + within(height, SMALLEST)};
}

/**
 * A selection with what lies in its frames: states by their middles, annotations as a whole.
 *
 * @param {Automaton} automaton
 * @param {Selection} selection
 */
export function withContent({states, annotations}, selection) {
  const chosen = new Set(selection.annotations);
  const frames = annotations.filter((each) => chosen.has(each.id) && isFrame(each)).map(areaOf);
  /** @param {Box} box */
  const isInside = (box) => frames.some((frame) => contains(frame, box));
  const inside = states.filter(({x, y}) => isInside({left: x, right: x, top: y, bottom: y}));
  return {
    states: [...new Set([...selection.states, ...inside.map(({id}) => id)])],
    transitions: [...selection.transitions],
    annotations: annotations.filter((each) => chosen.has(each.id) || isInside(areaOf(each))).map(({id}) => id),
  };
}
