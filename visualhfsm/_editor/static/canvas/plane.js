/**
 * Things in the plane, found by where they are: a grid of cells, each with the things whose boxes touch it.
 *
 * @import {Box} from "../measures/geometry.js"
 */

const CELL = 600; // pixels
const ROW = 65536; // cells
const MOST_CELLS = 64; // a thing that touches more is looked at in every search

/**
 * @template {object} Thing
 */
export class Plane {
  /** @type {Map<number, Set<Thing>>} */
  #cells = new Map();
  /** The box of each thing, and the cells that it touches; none for one that is looked at in every search.
   *
   * @type {Map<Thing, {box: Box, cells: number[]}>}
   */
  #places = new Map();
  /** @type {Set<Thing>} */
  #wide = new Set();

  /** Add a thing, or move it. @param {Thing} thing @param {Box} box */
  put(thing, box) {
    const former = this.#places.get(thing);
    const cells = cellsOf(box, MOST_CELLS) ?? [];
    if (former && cells.length && cells[0] === former.cells[0] && cells.at(-1) === former.cells.at(-1)) {
      former.box = box;
      return;
    }
    if (former) this.remove(thing);
    this.#places.set(thing, {box, cells});
    if (!cells.length) this.#wide.add(thing);
    for (const cell of cells) {
      const known = this.#cells.get(cell);
      if (known) known.add(thing);
      else this.#cells.set(cell, new Set([thing]));
    }
  }

  /** @param {Thing} thing */
  remove(thing) {
    for (const cell of this.#places.get(thing)?.cells ?? []) this.#cells.get(cell)?.delete(thing);
    this.#places.delete(thing);
    this.#wide.delete(thing);
  }

  clear() {
    this.#cells.clear();
    this.#places.clear();
    this.#wide.clear();
  }

  /**
   * The things that touch a box, each once.
   *
   * @param {Box} box
   * @param {number} [most] that are looked for
   * @returns {Set<Thing>}
   */
  within(box, most = Infinity) {
    /** @type {Set<Thing>} */
    const found = new Set();
    /** @param {Iterable<Thing>} things */
    const look = (things) => {
      for (const thing of things) {
        if (found.size >= most) return;
        const place = this.#places.get(thing);
        if (place && touches(place.box, box)) found.add(thing);
      }
    };
    look(this.#wide);
    const cells = cellsOf(box, this.#cells.size);
    if (!cells) look(this.#places.keys());
    else for (const cell of cells) look(this.#cells.get(cell) ?? []);
    return found;
  }
}

/** Whether two boxes have a point in common. @param {Box} one @param {Box} other */
export const touches = (one, other) =>
  one.left <= other.right && one.right >= other.left && one.top <= other.bottom && one.bottom >= other.top;

/** The cells that a box touches, or undefined if there are more than `most`. @param {Box} box @param {number} most */
function cellsOf({left, right, top, bottom}, most) {
  const [first, last] = [Math.floor(left / CELL), Math.floor(right / CELL)];
  const [high, low] = [Math.floor(top / CELL), Math.floor(bottom / CELL)];
  if (!((last - first + 1) * (low - high + 1) <= most)) return undefined; // nor for what is not a number
  const cells = [];
  for (let x = first; x <= last; x++) for (let y = high; y <= low; y++) cells.push(x * ROW + y);
  return cells;
}
