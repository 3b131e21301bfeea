/**
 * A layout that would be a long strip is folded into rows, as lines of a text; one that is high, into columns.
 *
 * @import {Transition} from "../data/protocol.js"
 * @import {Area} from "./annotation-layout.js"
 * @import {Point} from "../measures/geometry.js"
 * @typedef {[id: number, x: number, y: number]} Placed
 * @typedef {{states: Placed[], transitions: Placed[], annotations: Area[]}} Layout of states, handles and annotations
 * @typedef {{start: number, end: number}} Interval
 */

import {arc, between, distance, pointsOf, RADIUS} from "../measures/geometry.js";
import {Plane} from "./plane.js";

/** Pixels up to which a layout is never folded: a screen shows them, with the names of states and transitions. */
const LONGEST = {width: 3600, height: 2400};
const STRIP = 4; // a longer layout that is so many times as long as it is wide is folded
const SCREEN = 1.8; // width by height
const AROUND = RADIUS + 8; // pixels from the middle of a state to the edge of its room
const BETWEEN_ROWS = 130; // pixels, where the handles of arcs from row to row are
const GRID = 10;
const UNEVEN = 0.3; // of a row's length, by which a row may be longer or shorter if fewer arcs are cut then
const STEP = 50; // pixels between places that are tried for a handle

/**
 * Fold a layout if it would be a strip that no screen shows.
 *
 * @param {Layout} layout
 * @param {Transition[]} arcs those between different states, which have handles
 * @returns {Layout}
 */
export function fold(layout, arcs) {
  const along = extent(layout);
  const across = extent(transposed(layout));
  const width = along.end - along.start;
  const height = across.end - across.start;
  if (width > LONGEST.width && width > STRIP * height) return inRows(layout, arcs, {aspect: SCREEN, turns: true});
  if (height > LONGEST.height && height > STRIP * width)
    return transposed(inRows(transposed(layout), arcs, {aspect: 1 / SCREEN, turns: false}));
  return layout;
}

/** Exchange x and y. @param {Layout} layout @returns {Layout} */
function transposed({states, transitions, annotations}) {
  /** @param {Placed} placed @returns {Placed} */
  const turned = ([id, x, y]) => [id, y, x];
  return {
    states: states.map(turned),
    transitions: transitions.map(turned),
    annotations: annotations.map(([id, x, y, width, height]) => [id, y, x, height, width]),
  };
}

/** What states and annotations take from left to right. @param {Layout} layout @returns {Interval[]} */
const intervals = ({states, annotations}) => [
  ...states.map(([, x]) => ({start: x - AROUND, end: x + AROUND})),
  ...annotations.map(([, x, , width]) => ({start: x, end: x + width})),
];

/** @param {Layout} layout @returns {Interval} */
const extent = (layout) =>
  intervals(layout).reduce((one, other) => ({
    start: Math.min(one.start, other.start),
    end: Math.max(one.end, other.end),
  }));

/**
 * Cut a layout into rows below each other. If it `turns`, every second row runs from right to left, so that the way
 * from row to row is short.
 *
 * @param {Layout} layout @param {Transition[]} arcs @param {{aspect: number, turns: boolean}} options
 * @returns {Layout}
 */
function inRows(layout, arcs, {aspect, turns}) {
  const {states, transitions, annotations} = layout;
  const cuts = cutsOf(layout, arcs, aspect);
  /** @param {number} x */
  const rowOf = (x) => cuts.filter((cut) => cut < x).length;
  const rowOfState = new Map(states.map(([id, x]) => [id, rowOf(x)]));
  const ends = new Map(arcs.map(({id, origin, destination}) => [id, [origin, destination]]));
  /** The row of an arc, if it is only one. @param {number} id */
  const rowOfArc = (id) => {
    const [origin, destination] = (ends.get(id) ?? []).map((state) => rowOfState.get(state));
    return origin === destination ? origin : undefined;
  };
  /** @type {Layout[]} */
  const parts = Array.from({length: cuts.length + 1}, (_, row) => ({
    states: states.filter(([id]) => rowOfState.get(id) === row),
    transitions: transitions.filter(([id]) => rowOfArc(id) === row),
    annotations: annotations.filter(([, x]) => rowOf(x) === row),
  }));
  const extents = parts.map(extent);
  const lefts = leftsOf(extents, turns);
  let top = highest(parts[0]).start;
  const rows = parts.map((part, row) => {
    const {start, end} = extents[row];
    const high = highest(part);
    const down = rounded(top - high.start);
    top += high.end - high.start + BETWEEN_ROWS;
    const isBack = turns && isOdd(row);
    const [sign, shift] = isBack ? [-1, rounded(lefts[row] + end)] : [1, rounded(lefts[row] - start)];
    /** @param {Placed} placed @returns {Placed} */
    const moved = ([id, x, y]) => [id, sign * x + shift, y + down];
    return {
      states: part.states.map(moved),
      transitions: part.transitions.map(moved),
      annotations: part.annotations.map(
        ([id, x, y, width, height]) =>
          /** @type {Area} */ ([id, isBack ? shift - x - width : x + shift, y + down, width, height]),
      ),
    };
  });
  const placed = rows.flatMap((row) => row.states);
  const handles = rows.flatMap((row) => row.transitions);
  const others = arcs.filter(({id}) => rowOfArc(id) === undefined);
  return {
    states: placed,
    transitions: [...handles, ...handlesBetween(others, placed, handles)],
    annotations: rows.flatMap((row) => row.annotations),
  };
}

/** @param {number} row */
const isOdd = (row) => row % 2 === 1;

/**
 * Where the rows are: each begins below the end of the last one if they turn, or else below its beginning.
 *
 * @param {Interval[]} extents @param {boolean} turns
 */
function leftsOf(extents, turns) {
  /** @type {number[]} */
  const lefts = [0];
  for (const [row, {start, end}] of extents.slice(1).entries()) {
    const [left, length] = [lefts[row], extents[row].end - extents[row].start];
    lefts.push(turns && !isOdd(row) ? left + length - (end - start) : left);
  }
  const shift = extents[0].start - Math.min(...lefts);
  return lefts.map((left) => left + shift);
}

/** What a row takes from top to bottom, with its handles. @param {Layout} row @returns {Interval} */
function highest(row) {
  const {start, end} = extent(transposed(row));
  const ys = row.transitions.map(([, , y]) => y);
  return {start: Math.min(start, ...ys), end: Math.max(end, ...ys)};
}

/** @param {number} value */
const rounded = (value) => Math.round(value / GRID) * GRID;

/**
 * Where rows begin: between states and annotations, near equal lengths, where few arcs are cut.
 *
 * @param {Layout} layout @param {Transition[]} arcs
 * @param {number} aspect of the result
 */
function cutsOf(layout, arcs, aspect) {
  const {start, end} = extent(layout);
  const {start: top, end: bottom} = extent(transposed(layout));
  const count = Math.max(2, Math.round(Math.sqrt((end - start) / (aspect * (bottom - top + BETWEEN_ROWS)))));
  const row = (end - start) / count;
  const places = new Map(layout.states.map(([id, x]) => [id, x]));
  const spans = arcs.map(({origin, destination}) => {
    const [from, to] = [places.get(origin) ?? 0, places.get(destination) ?? 0];
    return {start: Math.min(from, to), end: Math.max(from, to)};
  });
  const gaps = gapsIn(intervals(layout)).map((x) => ({
    x,
    cut: spans.filter((each) => each.start < x && x < each.end).length,
  }));
  /** @type {number[]} */
  const cuts = [];
  while (cuts.length < count - 1) {
    const last = cuts.at(-1) ?? start;
    const wanted = last + (end - last) / (count - cuts.length);
    const near = gaps.filter(({x}) => x > last && Math.abs(x - wanted) <= UNEVEN * row);
    const possible = near.length ? near : gaps.filter(({x}) => x > wanted).slice(0, 1);
    if (!possible.length) break;
    const far = (/** @type {{x: number}} */ {x}) => Math.abs(x - wanted);
    cuts.push(possible.reduce((a, b) => (b.cut < a.cut || (b.cut === a.cut && far(b) < far(a)) ? b : a)).x);
  }
  return cuts;
}

/** The middles of what no interval takes. @param {Interval[]} taken */
function gapsIn(taken) {
  /** @type {number[]} */
  const gaps = [];
  let until = Infinity;
  for (const {start, end} of taken.sort((one, other) => one.start - other.start)) {
    if (start > until) gaps.push((until + start) / 2);
    until = until === Infinity ? end : Math.max(until, end);
  }
  return gaps;
}

/**
 * Handles of arcs between rows: where the arc passes no state and its handle is beside all others.
 *
 * @param {Transition[]} arcs @param {Placed[]} states
 * @param {Placed[]} handles that have their places
 * @returns {Placed[]}
 */
function handlesBetween(arcs, states, handles) {
  const places = new Map(states.map(([id, x, y]) => [id, {x, y}]));
  /** @type {Plane<Point>} */
  const middles = new Plane();
  for (const place of places.values()) put(middles, place);
  /** @type {Plane<Point>} */
  const knobs = new Plane();
  for (const [, x, y] of handles) put(knobs, {x, y});
  return arcs.map(({id, origin, destination}) => {
    const [from, to] = [places.get(origin), places.get(destination)];
    const knob = from && to ? freeHandle(from, to, middles, knobs) : {x: 0, y: 0};
    put(knobs, knob);
    return /** @type {Placed} */ ([id, Math.round(knob.x), Math.round(knob.y)]);
  });
}

/** @param {Plane<Point>} plane @param {Point} point */
const put = (plane, point) => plane.put(point, {left: point.x, right: point.x, top: point.y, bottom: point.y});

/** The points of a plane near another one. @param {Plane<Point>} plane @param {Point} point @param {number} far */
const near = (plane, {x, y}, far) => plane.within({left: x - far, right: x + far, top: y - far, bottom: y + far});

/** @param {Point} from @param {Point} to @param {Plane<Point>} states @param {Plane<Point>} knobs */
function freeHandle(from, to, states, knobs) {
  const middle = between(from, to);
  const chord = distance(from, to) || 1;
  const across = {x: (from.y - to.y) / chord, y: (to.x - from.x) / chord};
  let best = middle;
  let least = Infinity;
  for (let number = 0; number * STEP <= Math.max(chord, 8 * STEP); number++) {
    const far = Math.ceil(number / 2) * (number % 2 ? STEP : -STEP);
    const knob = {x: middle.x + across.x * far, y: middle.y + across.y * far};
    const met = new Set(pointsOf(arc(from, to, knob), RADIUS).flatMap((each) => [...near(states, each, AROUND)]));
    met.delete(from);
    met.delete(to);
    const cost = met.size + near(knobs, knob, STEP - 1).size;
    if (cost < least) [best, least] = [knob, cost];
    if (!least) break;
  }
  return best;
}
