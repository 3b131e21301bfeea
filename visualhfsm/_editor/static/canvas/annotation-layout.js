/**
 * Notes and frames in an automatic layout: frames stay around what they hold, notes beside the states that they were
 * nearest to, and nothing covers them.
 *
 * @import {graphlib} from "dagre"
 * @import {Annotation, Automaton} from "../data/protocol.js"
 * @import {Box} from "../measures/geometry.js"
 * @typedef {[id: number, x: number, y: number, width: number, height: number]} Area
 */

import {areaOf, isFrame} from "../measures/areas.js";
import {contains, distance} from "../measures/geometry.js";

/** Room in a frame beside what it holds, and above it for its title. */
const SIDE = 24;
const ABOVE = 44;

/** @param {Box} box */
const middleOf = ({left, top, right, bottom}) => ({x: (left + right) / 2, y: (top + bottom) / 2});
/** @param {Box} box */
const sizeOf = ({left, top, right, bottom}) => ({width: right - left, height: bottom - top});
/** @param {Annotation} annotation */
const nodeOf = ({id}) => `a${id}`;

/**
 * Add the annotations to a graph of states; returns a function that reads their places, once the graph is laid out.
 *
 * @param {graphlib.Graph} graph
 * @param {Automaton} automaton that has a state
 * @returns {() => Area[]}
 */
export function addAnnotations(graph, {states, annotations}) {
  const frames = annotations.filter(isFrame).sort((one, other) => surface(one) - surface(other));
  /** The smallest frame around a box, besides itself. @param {Box} box @param {Annotation} [itself] */
  const frameOf = (box, itself) => frames.find((each) => each !== itself && contains(areaOf(each), box));
  for (const annotation of annotations) graph.setNode(nodeOf(annotation), sizeOf(areaOf(annotation)));
  for (const {id, x, y} of states) {
    const frame = frameOf({left: x, top: y, right: x, bottom: y});
    if (frame) graph.setParent(String(id), nodeOf(frame));
  }
  for (const annotation of annotations) {
    const frame = frameOf(areaOf(annotation), annotation);
    if (frame) graph.setParent(nodeOf(annotation), nodeOf(frame));
  }
  const isFull = (/** @type {Annotation} */ each) => (graph.children(nodeOf(each)) ?? []).length > 0;
  for (const annotation of annotations) {
    if (isFull(annotation)) continue;
    const middle = middleOf(areaOf(annotation));
    const nearest = states.reduce((best, each) => (distance(each, middle) < distance(best, middle) ? each : best));
    graph.setEdge(String(nearest.id), nodeOf(annotation), {weight: 0.1}, nodeOf(annotation));
  }
  return () =>
    annotations.map((annotation) => {
      const {x, y, width, height} = graph.node(nodeOf(annotation));
      const [left, top] = [Math.round(x - width / 2), Math.round(y - height / 2)];
      if (!isFull(annotation)) return [annotation.id, left, top, width, height];
      return [annotation.id, left - SIDE, top - ABOVE, Math.round(width) + 2 * SIDE, Math.round(height) + ABOVE + SIDE];
    });
}

/** @param {Annotation} frame */
function surface(frame) {
  const {width, height} = sizeOf(areaOf(frame));
  return width * height;
}
