/**
 * The visible part of the drawing, and its scale.
 *
 * @import {Box, Point} from "../measures/geometry.js"
 */

/** Below each of these scales, fewer details are drawn: see canvas.css. */
export const FAR = 0.55;
export const VERY_FAR = 0.28;
export const TINY = 0.15;

const SMALLEST = 0.02; // to which one zooms; a larger drawing is fitted at a smaller one
const FIT_SMALLEST = 0.0001;
const LARGEST = 4;
/** Pixels of the window around what is fitted; the tools are above. */
const FIT = {side: 36, top: 54, bottom: 28};
const FIT_LARGEST = 1.25;

/** Calls `changed` after each change; `scale` pixels of the window are one of the drawing. */
export class Viewport {
  x = 0;
  y = 0;
  scale = 1;
  /** The size of what covers the lower right corner of the window. */
  covered = {width: 0, height: 0};

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
   * @param {number} factor
   * @param {number} x
   * @param {number} y
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

  /** The part of the drawing that is covered. */
  get hidden() {
    const {width, height} = this.size();
    const {covered} = this;
    const start = this.toDrawing(width - covered.width, height - covered.height);
    const end = this.toDrawing(width, height);
    return {left: start.x, top: start.y, right: end.x, bottom: end.y};
  }

  /**
   * Where a box is largest: beside or above what is covered, or anywhere if only an empty corner of it is then covered.
   *
   * @param {Box} box
   * @param {(part: Box) => boolean} isEmpty
   */
  #room(box, isEmpty) {
    const {width, height} = this.size();
    const {covered} = this;
    const [whole, ...free] = [
      {width, height},
      {width: width - covered.width, height},
      {width, height: height - covered.height},
    ].map((room) => placed(box, room));
    const {x, y, scale} = whole;
    const right = box.right + width / scale;
    const bottom = box.bottom + height / scale;
    const corner = {
      left: (width - covered.width - x) / scale,
      top: (height - covered.height - y) / scale,
      right,
      bottom,
    };
    if (!covered.width || isEmpty(corner)) return whole;
    return free[1].scale > free[0].scale ? free[1] : free[0];
  }

  /**
   * The scale at which all of a box is shown.
   *
   * @param {Box | undefined} box
   * @param {(part: Box) => boolean} [isEmpty] whether nothing is drawn in a part of the drawing
   */
  scaleFor(box, isEmpty = () => false) {
    return box ? this.#room(box, isEmpty).scale : 1;
  }

  /**
   * Show all of a box, in the middle of what is not covered.
   *
   * @param {Box | undefined} box
   * @param {{largest?: number, isEmpty?: (part: Box) => boolean}} options `isEmpty` as above
   */
  fit(box, {largest = Infinity, isEmpty = () => false} = {}) {
    const {width, height} = this.size();
    if (!width || !height) return;
    if (!box) {
      Object.assign(this, {x: width / 2, y: height / 2, scale: 1});
    } else {
      const room = this.#room(box, isEmpty);
      const {x, y, scale} = room.scale > largest ? placed(box, room, largest) : room;
      Object.assign(this, {x, y, scale});
    }
    this.changed();
  }

  /**
   * Move only as far as needed to see a point, with some pixels around it; if it is to be `legible`, show it in the
   * middle where text would be too small.
   *
   * @param {Point} point
   */
  reveal(point, {margin = 70, legible = false} = {}) {
    if (legible && this.scale < FAR) {
      this.scale = 1;
      this.center(point);
    }
    const {width, height} = this.size();
    const {covered} = this;
    const {x, y} = this.toWindow(point);
    const far = {right: width - margin - x, bottom: height - margin - y};
    let dx = x < margin ? margin - x : Math.min(0, far.right);
    let dy = y < margin ? margin - y : Math.min(0, far.bottom);
    const [left, up] = [far.right - covered.width, far.bottom - covered.height];
    if (covered.width && left < 0 && up < 0) {
      if (left > up) dx = left;
      else dy = up;
    }
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
 * @param {Box} box
 * @param {{width: number, height: number}} room
 */
function placed({left, right, top, bottom}, {width, height}, largest = FIT_LARGEST) {
  const [wide, high] = [Math.max(1, right - left), Math.max(1, bottom - top)];
  const most = Math.min((width - 2 * FIT.side) / wide, (height - FIT.top - FIT.bottom) / high);
  const scale = Math.max(FIT_SMALLEST, Math.min(most, largest));
  return {
    width,
    height,
    scale,
    x: width / 2 - ((left + right) / 2) * scale,
    y: Math.max(height / 2 - (high * scale) / 2, FIT.top) - top * scale,
  };
}
