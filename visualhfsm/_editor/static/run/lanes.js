/** Draws the states of automata over time, a lane each. */

import {required} from "../kit/existence.js";
import {spokenSeconds} from "../kit/texts.js";
import {shortened} from "../measures/text.js";
import {spokenFailures} from "./failures.js";
import {monitor} from "./monitor.js";

const NEAR = 6; // px beside the left edge where a time is written, too
const NAMED = 34; // px, the least width of a span with a name
const SIZE = 11;
const FONT = `${SIZE}px Inter, system-ui, 'DejaVu Sans', sans-serif`;

/**
 * @import {Span} from "./state-changes.js"
 * @typedef {{id: number, name: string}} Lane
 * @typedef {{empty: string, muted: string, plain: string[], parent: string[], failing: string[]}} Palette of a state's
 *   `plain` and `parent`, and of what was `failing`, the ground, the line and the letters
 * @typedef {{start: number, end: number}} Range component times at the left and right edge, s
 */

/** The id of the lane of what failed; others are those of automata. */
export const FAILING = 0;

/** @param {number} id of a lane */
export const spansOf = (id) => (id === FAILING ? monitor.past.failures : (monitor.past.spans.get(id) ?? []));

/** What a span is about, in words. @param {number} id of its lane @param {Span} span */
export const nameOf = (id, {state, faults}) => (faults ? spokenFailures(faults) : monitor.stateName(id, state));

/**
 * Draw lanes from top to bottom.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {{lanes: Lane[], range: Range, laneHeight: number, gap: number, axis: number}} options `axis` is the height of
 *   the times below
 */
export function drawLanes(canvas, {lanes, range, laneHeight, gap, axis}) {
  const {clientWidth: width, clientHeight: height} = canvas;
  const ratio = devicePixelRatio;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = required(canvas.getContext("2d"), "canvas");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  const colors = palette();
  const scale = width / Math.max(1e-3, range.end - range.start);
  /** @param {number} time */
  const x = (time) => (time - range.start) * scale;
  pen.font = FONT;
  pen.textBaseline = "middle";
  lanes.forEach(({id}, index) => {
    const top = index * (laneHeight + gap);
    pen.fillStyle = colors.empty;
    pen.fillRect(0, top, width, laneHeight);
    for (const span of seen(spansOf(id), range))
      drawSpan(pen, colors, span, {id, left: x(span.start), right: x(span.end), top, laneHeight, width});
  });
  drawAxis(pen, colors, {range, x, width, top: height - axis + 2});
  return x;
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {Palette} colors
 * @param {Span} span
 * @param {{id: number, left: number, right: number, top: number, laneHeight: number, width: number}} where
 */
function drawSpan(pen, colors, span, {id, left, right, top, laneHeight, width}) {
  const {state, ghost, faults} = span;
  const [from, to] = [Math.max(0, left), Math.min(width, right)];
  const isParent = monitor.automaton(id)?.states.some((each) => each.id === state && each.children.length > 0);
  const [fill, line, ink] = faults ? colors.failing : isParent ? colors.parent : colors.plain;
  pen.globalAlpha = ghost ? 0.35 : 1;
  pen.fillStyle = fill;
  pen.fillRect(from, top, Math.max(1, to - from), laneHeight);
  if (to - from > 3) {
    pen.fillStyle = line;
    pen.fillRect(from, top, left >= 0 ? 2 : 0, laneHeight);
    if (ghost) {
      pen.strokeStyle = line;
      pen.setLineDash([4, 3]);
      pen.strokeRect(from + 1, top + 0.5, to - from - 2, laneHeight - 1);
      pen.setLineDash([]);
    }
  }
  pen.globalAlpha = ghost ? 0.75 : 1;
  if (to - from > NAMED) {
    pen.fillStyle = ink;
    pen.fillText(shortened(nameOf(id, span), SIZE, to - from - 9), from + 6, top + laneHeight / 2 + 0.5);
  }
  pen.globalAlpha = 1;
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {Palette} colors
 * @param {{range: Range, x: (time: number) => number, width: number, top: number}} where
 */
function drawAxis(pen, colors, {range, x, width, top}) {
  const step = stepOf((range.end - range.start) / (width / 100));
  pen.fillStyle = colors.muted;
  pen.textBaseline = "top";
  const near = ((range.end - range.start) / width) * NEAR; // the first cycle is not at 0 s to the hundredth
  for (let time = Math.ceil((range.start - near) / step) * step; time <= range.end; time += step) {
    const at = Math.max(0, x(time));
    pen.fillRect(at, top - 4, 1, 4);
    const text = spokenSeconds(time, step < 1 ? 1 : 0);
    const wide = pen.measureText(text).width;
    pen.fillText(text, Math.max(0, Math.min(width - wide, at - wide / 2)), top + 2); // clear of the tick
  }
}

/**
 * The visible spans.
 *
 * @param {Span[]} spans
 * @param {Range} range
 * @returns {Span[]}
 */
export function seen(spans, {start, end}) {
  let [low, high] = [0, spans.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (spans[middle].end < start) low = middle + 1;
    else high = middle;
  }
  const found = [];
  for (let index = low; index < spans.length && spans[index].start <= end; index += 1) found.push(spans[index]);
  return found;
}

/**
 * Whether an automaton did something in a part of the run: one that is suspended, or has finished, does not.
 *
 * @param {Span[]} spans
 * @param {Range} range
 * @param {(state: number) => boolean} isFinal
 */
export const wasActive = (spans, range, isFinal) =>
  seen(spans, range).some(({state, ghost}) => !ghost && !isFinal(state));

/** @param {number} wanted */
export function stepOf(wanted) {
  const power = 10 ** Math.floor(Math.log10(Math.max(wanted, 1e-3)));
  return [1, 2, 5, 10].map((each) => each * power).find((each) => each >= wanted) ?? 10 * power;
}

/** @type {Palette | undefined} */
let known;
let theme = "";

/** The colors of the style, read again when that changes. */
function palette() {
  const now = document.documentElement.dataset.theme ?? "";
  if (known && theme === now) return known;
  theme = now;
  const style = getComputedStyle(document.documentElement);
  /** @param {string} name */
  const color = (name) => style.getPropertyValue(name).trim();
  known = {
    empty: color("--ground"),
    muted: color("--muted"),
    plain: [color("--plain"), color("--plain-line"), color("--plain-ink")],
    parent: [color("--parent"), color("--parent-line"), color("--parent-ink")],
    failing: [color("--error-soft"), color("--error"), color("--error")],
  };
  return known;
}
