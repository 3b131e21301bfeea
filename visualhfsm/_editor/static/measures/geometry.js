/**
 * The geometry of arcs: pure functions of points in pixels, y downwards.
 *
 * @typedef {{x: number, y: number}} Point
 * @typedef {{path: string, head: string, middle: Point, normal: Point, first: Point, start?: Point, end?: Point, box:
 *   Box}} Arc `path` from rim to rim, `head` the arrow's, `middle` the handle, `normal` the best side for a name,
 *   `first` the place of a number at the arc's beginning, `start` and `end` its ends at the rims.
 * @typedef {{left: number, top: number, right: number, bottom: number}} Box
 */

/** Radius of a state's circle. */
export const RADIUS = 40;

const HEAD_LENGTH = 10;
const HEAD_WIDTH = 4.5;
const FAN = 50; // pixels between arcs that the user has not placed
const TRIES = 9; // places that a handle may have where others are
/** Distance of a loop's handle from the middle of its state. */
export const LOOP = 90;
const LOOP_OPENING = 0.34; // radians between a loop's end and its axis
const FAR_FROM_RIM = 20; // pixels to a number at an arc's beginning: outside of the ring around a selected state
const STRAIGHT = 3; // pixels; an arc with a handle nearer to its chord is straight

/** @param {number} x @param {number} y */
const length = (x, y) => Math.hypot(x, y) || 1;
/** @param {number} value */
const round = (value) => Math.round(value * 10) / 10;
/** @param {number} x @param {number} y */
const at = (x, y) => `${round(x)},${round(y)}`;

/** @param {Point} a @param {Point} b @returns {Point} */
export const between = (a, b) => ({x: (a.x + b.x) / 2, y: (a.y + b.y) / 2});

/** @param {Point} a @param {Point} b @returns {number} */
export const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);

/** Whether a box lies in another one; no box lies anywhere. @param {Box} outer @param {Box | undefined} box */
export const contains = (outer, box) =>
  box !== undefined &&
  box.left >= outer.left &&
  box.right <= outer.right &&
  box.top >= outer.top &&
  box.bottom <= outer.bottom;

/** Whether two boxes have a point in common. @param {Box} one @param {Box} other */
export const touches = (one, other) =>
  one.left <= other.right && one.right >= other.left && one.top <= other.bottom && one.bottom >= other.top;

/** A box that is larger on each side. @param {Box} box @param {number} x @returns {Box} */
export const wider = ({left, right, top, bottom}, x, y = x) => ({
  left: left - x,
  right: right + x,
  top: top - y,
  bottom: bottom + y,
});

/**
 * The point on a circle around `center` in the direction of `target`.
 *
 * @param {Point} center @param {Point} target @param {number} radius
 */
function rim(center, target, radius) {
  const x = target.x - center.x;
  const y = target.y - center.y;
  const scale = radius / length(x, y);
  return {x: center.x + x * scale, y: center.y + y * scale};
}

/** The head of an arrow that arrives at `tip` from the direction of `from`. @param {Point} tip @param {Point} from */
function head(tip, from) {
  const x = tip.x - from.x;
  const y = tip.y - from.y;
  const size = length(x, y);
  const [ux, uy] = [x / size, y / size];
  const back = {x: tip.x - ux * HEAD_LENGTH, y: tip.y - uy * HEAD_LENGTH};
  const left = at(back.x - uy * HEAD_WIDTH, back.y + ux * HEAD_WIDTH);
  const right = at(back.x + uy * HEAD_WIDTH, back.y - ux * HEAD_WIDTH);
  return `M${at(tip.x, tip.y)}L${left}L${right}Z`;
}

/** The box around points. @param {Point[]} points @returns {Box} */
export function boxOf(points) {
  const xs = points.map((point) => point.x);
  const ys = points.map((point) => point.y);
  return {left: Math.min(...xs), top: Math.min(...ys), right: Math.max(...xs), bottom: Math.max(...ys)};
}

/**
 * An arc between two states through its handle.
 *
 * @param {Point | undefined} from the middle of the state where it begins, undefined when there is none
 * @param {Point | undefined} to @param {Point} handle @param {boolean} isLoop
 * @returns {Arc}
 */
export function arc(from, to, handle, isLoop = false) {
  if (from && to && (isLoop || distance(from, to) < 1)) return loop(from, handle);
  if (!from || !to) return stub(from, to, handle);
  const middle = between(from, to);
  const chord = length(to.x - from.x, to.y - from.y);
  const across = {x: -(to.y - from.y) / chord, y: (to.x - from.x) / chord};
  const offset = (handle.x - middle.x) * across.x + (handle.y - middle.y) * across.y;
  const along = Math.abs((handle.x - middle.x) * across.y - (handle.y - middle.y) * across.x);
  if (Math.abs(offset) < STRAIGHT && along < chord / 2 - RADIUS) {
    const start = rim(from, to, RADIUS);
    const tip = rim(to, from, RADIUS + 2);
    const end = rim(to, from, RADIUS + HEAD_LENGTH);
    const normal =
      Math.abs(across.y) < 0.2 ? {x: 1, y: 0} : {x: across.x * -Math.sign(across.y), y: -Math.abs(across.y)};
    return {
      path: `M${at(start.x, start.y)}L${at(end.x, end.y)}`,
      head: head(tip, from),
      middle: handle,
      normal,
      first: ahead(start, to, across, FAR_FROM_RIM),
      start,
      end: tip,
      box: boxOf([start, tip, handle]),
    };
  }
  // The control point that would make a curve between the middles pass through the handle gives the rims.
  const bend = {x: 2 * handle.x - middle.x, y: 2 * handle.y - middle.y};
  const start = rim(from, bend, RADIUS);
  const tip = rim(to, bend, RADIUS + 2);
  const end = rim(to, bend, RADIUS + HEAD_LENGTH - 1);
  const control = {x: 2 * handle.x - (start.x + end.x) / 2, y: 2 * handle.y - (start.y + end.y) / 2};
  const side = Math.sign(offset) || 1;
  return {
    path: `M${at(start.x, start.y)}Q${at(control.x, control.y)} ${at(end.x, end.y)}`,
    head: head(tip, end),
    middle: handle,
    normal: {x: across.x * side, y: across.y * side},
    first: ahead(start, control, {x: -across.x * side, y: -across.y * side}, FAR_FROM_RIM),
    start,
    end: tip,
    box: boxOf([start, tip, handle, between(handle, control)]),
  };
}

/** @param {Point} start @param {Point} target @param {Point} across @param {number} far */
function ahead(start, target, across, far) {
  const x = target.x - start.x;
  const y = target.y - start.y;
  const size = length(x, y);
  return {x: start.x + (x / size) * far + across.x * 9, y: start.y + (y / size) * far + across.y * 9};
}

/** @param {Point} center @param {Point} handle @returns {Arc} */
function loop(center, handle) {
  const axis = {x: handle.x - center.x, y: handle.y - center.y};
  const size = length(axis.x, axis.y);
  const normal = size < 2 ? {x: 0, y: -1} : {x: axis.x / size, y: axis.y / size};
  const angle = Math.atan2(normal.y, normal.x);
  /** @param {number} turn @param {number} radius */
  const on = (turn, radius) => ({
    x: center.x + Math.cos(angle + turn) * radius,
    y: center.y + Math.sin(angle + turn) * radius,
  });
  const start = on(-LOOP_OPENING, RADIUS);
  const tip = on(LOOP_OPENING, RADIUS + 2);
  const end = on(LOOP_OPENING, RADIUS + HEAD_LENGTH - 1);
  // The middle of a cubic is 1/8, 3/8, 3/8, 1/8 of its points; it must be the handle.
  const middle = {x: (8 * handle.x - start.x - end.x) / 6, y: (8 * handle.y - start.y - end.y) / 6};
  const width = RADIUS * 0.62;
  const first = {x: middle.x + normal.y * width, y: middle.y - normal.x * width};
  const second = {x: middle.x - normal.y * width, y: middle.y + normal.x * width};
  return {
    path: `M${at(start.x, start.y)}C${at(first.x, first.y)} ${at(second.x, second.y)} ${at(end.x, end.y)}`,
    head: head(tip, {x: tip.x * 2 - center.x, y: tip.y * 2 - center.y}),
    middle: handle,
    normal,
    first: on(0, RADIUS + FAR_FROM_RIM),
    start,
    end: tip,
    box: boxOf([start, tip, handle, first, second]),
  };
}

/**
 * A transition that lacks an end, in an invalid document.
 *
 * @param {Point | undefined} from @param {Point | undefined} to @param {Point} handle
 * @returns {Arc}
 */
function stub(from, to, handle) {
  const known = from ?? to;
  if (!known) return {path: "", head: "", middle: handle, normal: {x: 0, y: -1}, first: handle, box: boxOf([handle])};
  const edge = rim(known, handle, RADIUS + (to ? 2 : 0));
  const [start, tip] = from ? [edge, handle] : [handle, edge];
  return {
    path: `M${at(start.x, start.y)}L${at(tip.x, tip.y)}`,
    head: to ? head(tip, handle) : "",
    middle: handle,
    normal: {x: 0, y: -1},
    first: start,
    box: boxOf([start, tip]),
  };
}

/** Points of an arc, about `step` pixels apart. @param {Arc} arc @param {number} step @returns {Point[]} */
export function pointsOf({start, end, middle}, step) {
  if (!start || !end) return [];
  const control = {x: 2 * middle.x - (start.x + end.x) / 2, y: 2 * middle.y - (start.y + end.y) / 2};
  const count = Math.ceil((distance(start, middle) + distance(middle, end)) / step);
  return Array.from({length: count + 1}, (_, index) => {
    const part = index / count || 0;
    const [first, second, third] = [(1 - part) ** 2, 2 * part * (1 - part), part ** 2];
    return {
      x: first * start.x + second * control.x + third * end.x,
      y: first * start.y + second * control.y + third * end.y,
    };
  });
}

/**
 * The arc of a transition that is being drawn, from a state to a point or another state.
 *
 * @param {Point} from @param {Point} target @param {boolean} isState
 * @returns {Arc}
 */
export function drawnArc(from, target, isState) {
  if (isState && distance(from, target) < 1) return loop(from, {x: from.x, y: from.y - LOOP});
  if (isState) return arc(from, target, between(from, target));
  const start = rim(from, target, RADIUS);
  return {
    ...stub(undefined, undefined, target),
    path: `M${at(start.x, start.y)}L${at(target.x, target.y)}`,
    head: head(target, start),
  };
}

/**
 * Handles of transitions: each where the file has it, or else halfway, but none where another one is: then in a fan
 * between two states, around a state for loops.
 *
 * @template {{x: number, y: number, origin: number, destination: number}} T
 * @param {T[]} transitions
 * @param {Map<number, Point>} places of the states
 * @returns {Map<T, Point>} the handle of every transition
 */
export function handles(transitions, places) {
  /** @type {Map<T, Point>} */
  const found = new Map();
  /** @type {Set<string>} */
  const taken = new Set();
  /** Where to go on for one that is wanted where others are. @type {Map<string, number>} */
  const next = new Map();
  for (const transition of transitions) {
    const {origin, destination, x, y} = transition;
    const from = places.get(origin) ?? places.get(destination) ?? {x: 0, y: 0};
    const to = places.get(destination) ?? from;
    const isLoop = origin === destination || distance(from, to) < 1;
    const wanted = x || y ? {x, y} : isLoop ? {x: from.x, y: from.y - LOOP} : between(from, to);
    const [a, b] = origin < destination ? [from, to] : [to, from];
    const place = at(wanted.x, wanted.y);
    let number = next.get(place) ?? 0;
    const most = number + TRIES;
    let point;
    do point = isLoop ? around(from, wanted, number) : beside(a, b, wanted, number);
    while (taken.has(at(point.x, point.y)) && ++number < most);
    next.set(place, number + 1);
    taken.add(at(point.x, point.y));
    found.set(transition, point);
  }
  return found;
}

/** A point of a fan across the line between two others. @param {Point} a @param {Point} b @param {Point} first @param {number} number */
function beside(a, b, first, number) {
  const far = (FAN * Math.ceil(number / 2) * (number % 2 ? 1 : -1)) / length(b.x - a.x, b.y - a.y);
  return {x: first.x - (b.y - a.y) * far, y: first.y + (b.x - a.x) * far};
}

/** A point on circles around another one. @param {Point} center @param {Point} first @param {number} number */
function around(center, first, number) {
  const [turn, grown] = [(number * Math.PI) / 3, 1 + Math.floor(number / 6) / 2];
  const [x, y] = [(first.x - center.x) * grown, (first.y - center.y) * grown];
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  return {x: center.x + x * cos - y * sin, y: center.y + x * sin + y * cos};
}

/** The box around states with their rims and arcs. @param {Point[]} states @param {{box: Box}[]} arcs */
export function bounds(states, arcs) {
  const boxes = [
    ...states.map(({x, y}) => ({left: x - RADIUS, right: x + RADIUS, top: y - RADIUS, bottom: y + RADIUS})),
    ...arcs.map((each) => each.box),
  ];
  if (!boxes.length) return undefined;
  return boxes.reduce((a, b) => ({
    left: Math.min(a.left, b.left),
    top: Math.min(a.top, b.top),
    right: Math.max(a.right, b.right),
    bottom: Math.max(a.bottom, b.bottom),
  }));
}

/**
 * The nearest element in a direction; elements straight ahead are preferred.
 *
 * @template {{x: number, y: number}} T
 * @param {T[]} things @param {T} from @param {[number, number]} direction
 * @returns {T | undefined}
 */
export function neighbor(things, from, [dx, dy]) {
  /** @type {T | undefined} */
  let best;
  let least = Infinity;
  for (const each of things) {
    if (each === from) continue;
    const along = (each.x - from.x) * dx + (each.y - from.y) * dy;
    const aside = Math.abs((each.x - from.x) * dy - (each.y - from.y) * dx);
    if (along <= 1 || aside > along * 2.5) continue;
    const cost = along + aside * 1.5;
    if (cost < least) [best, least] = [each, cost];
  }
  return best;
}
