/**
 * What notes and frames cover: pure functions of their places and sizes in pixels.
 *
 * @import {Annotation, Automaton} from "../data/protocol.js"
 * @import {Box} from "./geometry.js"
 * @typedef {{states: Iterable<number>, transitions: Iterable<number>, annotations: Iterable<number>}} Selection
 */

import {neededHeight} from "./annotation-text.js";
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

/** Areas that were calculated. @type {WeakMap<Annotation, Box>} */
const areas = new WeakMap();

/**
 * The rectangle that it takes, whatever its file says: a note grows with its text.
 *
 * @param {Annotation} annotation
 * @returns {Box}
 */
export function areaOf(annotation) {
  let known = areas.get(annotation);
  if (!known) {
    const {x, y, width, height} = annotation;
    const [left, top] = [within(x, -FARTHEST), within(y, -FARTHEST)];
    const area = {left, top, right: left + within(width, SMALLEST), bottom: top + within(height, SMALLEST)};
    areas.set(annotation, (known = grown(annotation, area)));
  }
  return known;
}

/**
 * A rectangle in which all of a text has room: that of a note grows downwards.
 *
 * @param {Annotation} annotation @param {Box} box
 * @param {string} [text] that is written meanwhile
 * @returns {Box}
 */
export function grown(annotation, box, text = annotation.text) {
  if (isFrame(annotation)) return box;
  return {...box, bottom: Math.max(box.bottom, box.top + neededHeight(text, box.right - box.left))};
}

/**
 * A selection with what lies in its frames: states by their middles, annotations as a whole.
 *
 * @param {Automaton} automaton @param {Selection} selection
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
