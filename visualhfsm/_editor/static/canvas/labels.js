/**
 * Put names beside their handles so that none covers another name, a handle, a state, a note or the title of a frame, no
 * arc crosses it, and no other handle is nearer.
 *
 * Each name tries some places around its handle, the best first, and takes the first that is free: at its full length,
 * or else shortened.
 *
 * @import {Arc, Box, Point} from "../measures/geometry.js"
 */

/**
 * A label, with the sizes that it may have, the largest first.
 *
 * @template K
 * @template {Size} S
 * @typedef {{key: K, handle: Point, normal: Point, sizes: S[]}} Label
 */

/** @typedef {{width: number, height: number}} Size */

import {boxOf, contains, pointsOf, RADIUS, wider} from "../measures/geometry.js";

const CELL = 96;
const ROW = 65536; // cells in a row
const MOST_CELLS = 1024; // a box that touches more is looked at each time
/** @type {never[]} */
const NONE = [];
const GAP = 5;
/** Boxes that together are about a state's circle. */
const CIRCLE = [
  [2 * RADIUS + 4, RADIUS],
  [RADIUS, 2 * RADIUS + 4],
  [1.6 * RADIUS, 1.6 * RADIUS],
];
const CORNERS = 4; // of a handle, across which a label may stand
const STEP = 12; // pixels between two points of an arc
const CROSSED = 72; // a point of an arc in a label, or a handle nearer to it, is as bad as so many covered square pixels
const MANY = 400; // arcs; of more, none is avoided
const LANDSCAPE = 1.5; // width to height of the room of long labels, unless the states take a wider one
const BESIDE = 40; // pixels beside the outermost states where long labels may stand
export const HANDLE = 9; // radius

/** A set of boxes that knows quickly whether another one overlaps any of them. */
class Boxes {
  /** The boxes in each cell of the plane, each with the round in which it was last looked at. */
  #cells = /** @type {Map<number, (Box & {round: number})[]>} */ (new Map());
  /** Those that are too large for cells. @type {(Box & {round: number})[]} */
  #large = [];
  #round = 0;

  /** @param {Box} box */
  add({left, right, top, bottom}) {
    const box = {left, right, top, bottom, round: 0};
    if (((right - left) / CELL + 1) * ((bottom - top) / CELL + 1) > MOST_CELLS) {
      this.#large.push(box);
      return;
    }
    for (let x = Math.floor(left / CELL); x <= right / CELL; x++)
      for (let y = Math.floor(top / CELL); y <= bottom / CELL; y++) {
        const known = this.#cells.get(x * ROW + y);
        if (known) known.push(box);
        else this.#cells.set(x * ROW + y, [box]);
      }
  }

  /** The covered area of a box in square pixels. @param {Box} box */
  covered({left, right, top, bottom}) {
    const round = ++this.#round;
    let area = 0;
    /** @param {(Box & {round: number})[]} others */
    const look = (others) => {
      for (const other of others) {
        if (other.round === round) continue;
        other.round = round;
        const width = Math.min(right, other.right) - Math.max(left, other.left);
        const height = Math.min(bottom, other.bottom) - Math.max(top, other.top);
        if (width > 0 && height > 0) area += width * height;
      }
    };
    look(this.#large);
    for (let x = Math.floor(left / CELL); x <= right / CELL; x++)
      for (let y = Math.floor(top / CELL); y <= bottom / CELL; y++) look(this.#cells.get(x * ROW + y) ?? NONE);
    return area;
  }
}

/** A set of points that knows quickly how many of them are in a box. */
class Points {
  /** The points in each cell of the plane. @type {Map<number, Point[]>} */
  #cells = new Map();

  /** @param {Point} point */
  add(point) {
    const key = Math.floor(point.x / CELL) * ROW + Math.floor(point.y / CELL);
    const known = this.#cells.get(key);
    if (known) known.push(point);
    else this.#cells.set(key, [point]);
  }

  /** @param {Box} box */
  within({left, right, top, bottom}) {
    let count = 0;
    for (let x = Math.floor(left / CELL); x <= right / CELL; x++)
      for (let y = Math.floor(top / CELL); y <= bottom / CELL; y++)
        for (const point of this.#cells.get(x * ROW + y) ?? NONE)
          if (point.x > left && point.x < right && point.y > top && point.y < bottom) count += 1;
    return count;
  }
}

/**
 * Choose the middle and the size of each label.
 *
 * @template K
 * @template {Size} S
 * @param {Label<K, S>[]} labels @param {Point[]} states
 * @param {{arcs?: Arc[], room?: Box, occupied?: Iterable<Box>}} [around] what else is there: arcs, and boxes with words;
 *   and the room for labels at their full length
 * @returns {Map<K, {middle: Point, size: S}>}
 */
export function placeLabels(labels, states, {arcs = [], room = roomOf(states), occupied = []} = {}) {
  const taken = new Boxes();
  const crossed = new Points();
  const handles = new Points();
  for (const {handle} of labels) handles.add(handle);
  for (const box of occupied) taken.add(box);
  for (const place of states) for (const [width, height] of CIRCLE) taken.add(around(place, width, height));
  for (const {handle} of labels) taken.add(around(handle, HANDLE * 2, HANDLE * 2));
  if (arcs.length <= MANY) for (const each of arcs) for (const point of pointsOf(each, STEP)) crossed.add(point);
  /** @type {Map<K, {middle: Point, size: S}>} */
  const found = new Map();
  for (const {key, handle, normal, sizes} of labels) {
    const smallest = sizes[sizes.length - 1];
    if (!smallest?.width) continue;
    const sides = directions(normal);
    let best = {middle: beside({handle, ...smallest}, normal), size: smallest};
    let least = Infinity;
    for (const size of sizes) {
      const isSmallest = size === smallest;
      const usual = 2 * sides.length + CORNERS;
      for (let index = 0; index < usual + (isSmallest ? sides.length : 0); index++) {
        const middle = placeOf(index, {handle, ...size}, sides);
        const box = around(middle, size.width, size.height);
        if (!isSmallest && !contains(room, box)) continue;
        let cover = taken.covered(box);
        if (cover < least) cover += CROSSED * (crossed.within(box) + handles.within(wider(box, beyond(box, handle))));
        // Further away only where that is free.
        if (cover < least && (!cover || (isSmallest && index < usual))) [best, least] = [{middle, size}, cover];
        if (!least) break;
      }
      if (!least) break;
    }
    taken.add(around(best.middle, best.size.width, best.size.height));
    found.set(key, best);
  }
  return found;
}

/**
 * Where long labels may stand, so that a drawing with them is no larger than it would be on a screen without them.
 *
 * @param {Point[]} states
 * @returns {Box}
 */
export function roomOf(states) {
  const {left, right, top, bottom} = boxOf(states);
  const far = RADIUS + BESIDE;
  const missing = Math.max(0, (bottom - top + 2 * far) * LANDSCAPE - (right - left + 2 * far)) / 2;
  return {left: left - far - missing, right: right + far + missing, top: -Infinity, bottom: Infinity};
}

/**
 * The middle of a label that stands in some direction of its handle.
 *
 * @param {Size & {handle: Point}} label @param {Point} direction
 */
export function beside(label, direction, far = 0) {
  const {handle, width, height} = label;
  const [ax, ay] = [Math.abs(direction.x), Math.abs(direction.y)];
  // As far as the label's box needs so that it just does not touch the handle.
  const room = HANDLE + GAP;
  const reach =
    Math.min(ax > 1e-6 ? (width / 2 + room) / ax : Infinity, ay > 1e-6 ? (height / 2 + room) / ay : Infinity) + far;
  return {x: handle.x + direction.x * reach, y: handle.y + direction.y * reach};
}

/**
 * One of the middles that a label may have, the best first: on the sides of its handle, across its corners, and on its
 * sides further away.
 *
 * @param {number} index @param {Size & {handle: Point}} label @param {Point[]} sides
 */
function placeOf(index, label, sides) {
  const {handle, width, height} = label;
  const corner = index - sides.length;
  if (corner < 0) return beside(label, sides[index]);
  if (corner >= CORNERS) {
    const further = corner - CORNERS;
    return beside(label, sides[further % sides.length], (1 + Math.floor(further / sides.length)) * height);
  }
  const [across, down] = [width / 2 + HANDLE + GAP, height / 2 + GAP];
  return {x: handle.x + (corner < 2 ? across : -across), y: handle.y + (corner % 2 ? down : -down)};
}

/** @param {Point} normal */
function directions(normal) {
  return [
    normal,
    {x: 0, y: Math.sign(normal.y) || -1},
    {x: Math.sign(normal.x) || 1, y: 0},
    {x: 0, y: -Math.sign(normal.y) || 1},
    {x: -Math.sign(normal.x) || -1, y: 0},
    {x: 0.7, y: -0.7},
    {x: -0.7, y: -0.7},
    {x: 0.7, y: 0.7},
    {x: -0.7, y: 0.7},
    {x: -normal.x, y: -normal.y},
  ];
}

/** How far a label lies from its handle: another one that is nearer would seem to have it. @param {Box} box @param {Point} handle */
const beyond = ({left, right, top, bottom}, {x, y}) => Math.max(left - x, x - right, top - y, y - bottom) - 1;

/** @param {Point} middle @param {number} width @param {number} height @returns {Box} */
function around({x, y}, width, height) {
  return {left: x - width / 2, right: x + width / 2, top: y - height / 2, bottom: y + height / 2};
}
