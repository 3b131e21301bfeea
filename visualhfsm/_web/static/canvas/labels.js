/**
 * Put names beside their handles so that none covers another name, a handle or a state.
 *
 * Each name tries some places around its handle, the best first, and takes the first that is free.
 *
 * @import {Box, Point} from "./geometry.js"
 */

/**
 * @template K
 * @typedef {{key: K, handle: Point, normal: Point, width: number, height: number}} Label
 */

import {RADIUS} from "./geometry.js";

const CELL = 96;
const GAP = 5;
export const HANDLE = 9; // radius

/** A set of boxes that knows quickly whether another one overlaps any of them. */
class Boxes {
  /** @type {Map<number, Box[]>} */
  #cells = new Map();

  /** @param {Box} box */
  add(box) {
    this.#each(box, (key) => {
      const known = this.#cells.get(key);
      if (known) known.push(box);
      else this.#cells.set(key, [box]);
    });
  }

  /** The covered area of a box in square pixels. @param {Box} box */
  covered(box) {
    const seen = new Set();
    let area = 0;
    this.#each(box, (key) => {
      for (const other of this.#cells.get(key) ?? []) {
        if (seen.has(other)) continue;
        seen.add(other);
        const width = Math.min(box.right, other.right) - Math.max(box.left, other.left);
        const height = Math.min(box.bottom, other.bottom) - Math.max(box.top, other.top);
        if (width > 0 && height > 0) area += width * height;
      }
    });
    return area;
  }

  /** @param {Box} box @param {(key: number) => void} visit */
  #each(box, visit) {
    const [left, right] = [Math.floor(box.left / CELL), Math.floor(box.right / CELL)];
    const [top, bottom] = [Math.floor(box.top / CELL), Math.floor(box.bottom / CELL)];
    for (let x = left; x <= right; x++) for (let y = top; y <= bottom; y++) visit(x * 65536 + y);
  }
}

/**
 * Choose the middle of each label.
 *
 * @template K
 * @param {Label<K>[]} labels
 * @param {Point[]} states
 * @returns {Map<K, Point>}
 */
export function placeLabels(labels, states) {
  const taken = new Boxes();
  const side = RADIUS * 0.88;
  for (const {x, y} of states) taken.add({left: x - side, right: x + side, top: y - side, bottom: y + side});
  for (const {handle} of labels) taken.add(around(handle, HANDLE * 2, HANDLE * 2));
  /** @type {Map<K, Point>} */
  const found = new Map();
  for (const label of labels) {
    if (!label.width) continue;
    let best = beside(label, label.normal);
    let least = Infinity;
    for (const direction of directions(label.normal)) {
      for (const far of [0, label.height]) {
        const middle = beside(label, direction, far);
        const box = around(middle, label.width, label.height);
        const cover = taken.covered(box);
        if (cover < least) [best, least] = [middle, cover];
        if (!least) break;
      }
      if (!least) break;
    }
    taken.add(around(best, label.width, label.height));
    found.set(label.key, best);
  }
  return found;
}

/**
 * The middle of a label that stands in some direction of its handle.
 *
 * @param {Omit<Label<unknown>, "key">} label
 * @param {Point} direction
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

/** @param {Point} middle @param {number} width @param {number} height @returns {Box} */
function around({x, y}, width, height) {
  return {left: x - width / 2, right: x + width / 2, top: y - height / 2, bottom: y + height / 2};
}
