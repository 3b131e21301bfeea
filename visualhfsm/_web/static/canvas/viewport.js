/**
 * The visible part of the drawing, and its scale.
 *
 * @import {Box, Point} from "./geometry.js"
 */

/** Below each of these scales, fewer details are drawn: see canvas.css. */
export const FAR = 0.55;
export const VERY_FAR = 0.28;
export const TINY = 0.15;

const SMALLEST = 0.02;
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
    const scale = Math.min(LARGEST, Math.max(SMALLEST, this.scale * factor));
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

  /**
   * The part of the window in which a box is largest, beside or above what is covered, and the scale for it.
   *
   * @param {Box} box
   */
  #room({left, right, top, bottom}) {
    const {width, height} = this.size();
    const {covered} = this;
    const rooms = [
      {width: width - covered.width, height},
      {width, height: height - covered.height},
    ].map((room) => ({
      ...room,
      scale: Math.min(
        (room.width - 2 * FIT.side) / Math.max(1, right - left),
        (room.height - FIT.top - FIT.bottom) / Math.max(1, bottom - top),
        FIT_LARGEST,
      ),
    }));
    return rooms[1].scale > rooms[0].scale ? rooms[1] : rooms[0];
  }

  /** The scale at which all of a box is shown. @param {Box} [box] */
  scaleFor(box) {
    return box ? this.#room(box).scale : 1;
  }

  /** Show all of a box, in the middle of what is not covered. @param {Box} [box] */
  fit(box, largest = Infinity) {
    const whole = this.size();
    if (!whole.width || !whole.height) return;
    if (!box) {
      Object.assign(this, {x: whole.width / 2, y: whole.height / 2, scale: 1});
    } else {
      const {width, height, scale} = this.#room(box);
      this.scale = Math.max(SMALLEST, Math.min(scale, largest));
      this.x = width / 2 - ((box.left + box.right) / 2) * this.scale;
      this.y = (FIT.top + height - FIT.bottom) / 2 - ((box.top + box.bottom) / 2) * this.scale;
    }
    this.changed();
  }

  /** Move only as far as needed to see a point, with some pixels around it. @param {Point} point */
  reveal(point, margin = 70) {
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
