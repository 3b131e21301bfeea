/**
 * The visible part of the drawing, and its scale.
 *
 * @import {Box, Point} from "../measures/geometry.js"
 */

const FINGERS = globalThis.matchMedia?.("(pointer: coarse)").matches;
/** Pixels of the window that letters have at least; more where fingers cover them. */
const READABLE = FINGERS ? 11 : 10;
/** Sizes of letters in the drawing: each is readable down to another scale, the last one where no larger ones fit. */
const LETTERS = [10, 10.5, 12, 14.5, 17.5, 21, 25];
const NAMES = [...LETTERS, 30, 36, 44]; // of states
/** The smallest letters that are readable at a scale. @param {number} scale */
export const lettersAt = (scale, sizes = LETTERS) =>
  sizes.find((size) => size * scale >= READABLE) ?? sizes[sizes.length - 1];
/** The same of names of states. @param {number} scale */
export const nameLettersAt = (scale) => lettersAt(scale, NAMES);
/** Below each of these scales, fewer details are drawn: see canvas.css. */
export const FAR = READABLE / LETTERS[1]; // no second lines of labels
export const VERY_FAR = READABLE / LETTERS[LETTERS.length - 1]; // no text
export const NAMELESS = READABLE / NAMES[NAMES.length - 1]; // not even names of states
export const TINY = 0.15;
const LEGIBLE = 0.55;

const SMALLEST = 0.02; // to which one zooms; a larger drawing is fitted at a smaller one
const FIT_SMALLEST = 0.0001;
const LARGEST = 4;
/** Pixels of the window around what is fitted; a banner that comes takes some above, buttons some below. */
const FIT = {side: 36, top: 50, bottom: FINGERS ? 60 : 44};
const TIGHT = {side: 8, top: 8, bottom: FINGERS ? 60 : 8}; // around what keeps its scale
export const FIT_LARGEST = 1.25;

/** Calls `changed` after each change; `scale` pixels of the window are one of the drawing. */
export class Viewport {
  x = 0;
  y = 0;
  scale = 1;

  /** @param {() => {width: number, height: number}} size of the window @param {() => void} changed */
  constructor(size, changed) {
    this.size = size;
    this.changed = changed;
  }

  /** Convert a point of the window to the drawing. @param {number} x @param {number} y */
  toDrawing(x, y) {
    return {x: (x - this.x) / this.scale, y: (y - this.y) / this.scale};
  }

  /** Convert a point of the drawing to the window. @param {Point} point */
  toWindow({x, y}) {
    return {x: x * this.scale + this.x, y: y * this.scale + this.y};
  }

  /** The visible part of the drawing that no buttons cover. */
  get free() {
    const {bottom, ...others} = this.seen;
    return {...others, bottom: bottom - (TIGHT.bottom - 8) / this.scale};
  }

  /** The visible part of the drawing. */
  get seen() {
    const {width, height} = this.size();
    const start = this.toDrawing(0, 0);
    const end = this.toDrawing(width, height);
    return {left: start.x, top: start.y, right: end.x, bottom: end.y};
  }

  /**
   * Zoom so that the point of the drawing at (x, y) of the window stays there; by default its middle.
   *
   * @param {number} factor @param {number} x @param {number} y
   */
  zoom(factor, x = this.size().width / 2, y = this.size().height / 2) {
    const scale = Math.min(LARGEST, Math.max(Math.min(SMALLEST, this.scale), this.scale * factor));
    this.x = x - ((x - this.x) * scale) / this.scale;
    this.y = y - ((y - this.y) * scale) / this.scale;
    this.scale = scale;
    this.changed();
  }

  /** @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.x += dx;
    this.y += dy;
    this.changed();
  }

  /** The scale at which all of a box is shown. @param {Box | undefined} box */
  scaleFor(box) {
    return box ? placed(box, this.size()).scale : 1;
  }

  /** Show all of a box in the middle, at most at a scale. @param {Box | undefined} box @param {number} [largest] */
  fit(box, largest = FIT_LARGEST) {
    const {width, height} = this.size();
    if (!width || !height) return;
    Object.assign(this, box ? placed(box, {width, height}, largest) : {x: width / 2, y: height / 2, scale: 1});
    this.changed();
  }

  /** Show all of a box at a scale again, or at a smaller one if there is less room. @param {Box} box @param {number} scale */
  refit(box, scale) {
    const tight = placed(box, this.size(), scale, TIGHT);
    Object.assign(this, tight.scale < scale ? placed(box, this.size(), scale) : tight);
    this.changed();
  }

  /**
   * Move only as far as needed to see a point, with some pixels around it; if it is to be `legible`, show it in the
   * middle where text would be too small.
   *
   * @param {Point} point
   */
  reveal(point, {margin = 70, legible = false} = {}) {
    if (legible && this.scale < LEGIBLE) {
      this.scale = 1;
      this.center(point);
    }
    const {width, height} = this.size();
    const {x, y} = this.toWindow(point);
    const dx = x < margin ? margin - x : Math.min(0, width - margin - x);
    const dy = y < margin ? margin - y : Math.min(0, height - margin - y);
    if (dx || dy) this.pan(dx, dy);
  }

  /** The point of the drawing in the middle of the window. */
  get middle() {
    const {width, height} = this.size();
    return this.toDrawing(width / 2, height / 2);
  }

  /** Show a point in the middle. @param {Point} point */
  center(point) {
    const {width, height} = this.size();
    this.x = width / 2 - point.x * this.scale;
    this.y = height / 2 - point.y * this.scale;
    this.changed();
  }
}

/**
 * Place a box in the middle of a room, as large as possible.
 *
 * @param {Box} box @param {{width: number, height: number}} room
 */
function placed({left, right, top, bottom}, {width, height}, largest = FIT_LARGEST, around = FIT) {
  const [wide, high] = [Math.max(1, right - left), Math.max(1, bottom - top)];
  const most = Math.min((width - 2 * around.side) / wide, (height - around.top - around.bottom) / high);
  const scale = Math.max(FIT_SMALLEST, Math.min(most, largest));
  return {
    scale,
    x: width / 2 - ((left + right) / 2) * scale,
    y: Math.max(height / 2 - (high * scale) / 2, around.top) - top * scale,
  };
}
