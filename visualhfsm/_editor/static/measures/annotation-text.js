/**
 * What is written on notes and frames, in pixels of the drawing: a note is as high as its text needs, and the title of
 * a frame is in its upper left corner.
 *
 * @import {Box} from "./geometry.js"
 */

import {wider} from "./geometry.js";
import {BOLD, shortened, width, wrapped} from "./text.js";

export const SIZE = 13; // of letters
export const LINE = 18;
export const PADDING = 10;
const TITLE_AT = 7; // the top of the letters of a title, from the top of its frame
const DESCENT = 0.3; // of a line below its foot, as a part of the size of its letters
const MOST_LINES = 200; // for which a note grows
const BORDER = 3; // pixels on each side of a frame's border where nothing else is written
const STEP = 0.9; // from a size of titles to the next smaller one
const READABLE = 10.6; // pixels of the window; a title with smaller letters is rather shortened
const FEW = 7; // a title is not shortened to fewer letters, roughly, as long as it can be smaller

/** The height of some lines. @param {number} count */
const heightOf = (count) => count * LINE - (LINE - SIZE) + 2 * PADDING;

/** The height that the text of a note needs. @param {string} text @param {number} wide */
export const neededHeight = (text, wide) =>
  heightOf(Math.min(MOST_LINES, wrapped(text, SIZE, wide - 2 * PADDING).length));

/**
 * The lines of a note; of a text that is too long even for a note that has grown, the first ones.
 *
 * @param {string} text @param {Box} box
 * @param {number} [size] of letters
 */
export function linesOf(text, {left, right, top, bottom}, size = SIZE) {
  const room = right - left - 2 * PADDING;
  const lines = wrapped(text, size, room);
  const fitting = Math.max(1, Math.floor((bottom - top - heightOf(0)) / LINE / (size / SIZE)));
  if (lines.length <= fitting) return lines;
  return [...lines.slice(0, fitting - 1), shortened(`${lines[fitting - 1]} …`, size, room)];
}

/** The title of a frame in one line. @param {string} text */
const titleOf = (text) => text.replace(/\s+/g, " ").trim();

/**
 * The size of the letters of titles at a scale of the window: titles keep their size where the drawing gets smaller.
 * There are few sizes, so that titles rarely change while the scale does.
 *
 * @param {number} scale
 */
export const titleSize = (scale) => SIZE / STEP ** Math.max(0, Math.round(Math.log(scale) / Math.log(STEP)));

/**
 * A title as it fits into its frame: whole, in letters as large as wanted or smaller, or else shortened.
 *
 * @param {string} text @param {Box} frame
 * @param {number} wanted size of its letters
 * @param {(box: Box) => Box[]} [inTheWay] what is in a part of the drawing
 * @returns {{line: string, size: number, foot: number}} the foot of the line from the top of the frame
 */
export function fitTitle(text, {left, right, top, bottom}, wanted, inTheWay = () => []) {
  const title = titleOf(text);
  const smallest = (READABLE / SIZE) * wanted;
  /** @type {ReturnType<typeof fitTitle> | undefined} */
  let cut;
  for (let size = wanted; size > SIZE * 1.01; size *= STEP) {
    const foot = TITLE_AT + size;
    const box = {left: left + PADDING, right: right - PADDING, top, bottom: top + foot + DESCENT * size};
    const whole = width(title, BOLD * size);
    box.right = Math.min(box.right, box.left + whole);
    const room = Math.min(...inTheWay(box).map((each) => each.left - PADDING), right - PADDING) - box.left;
    if (box.bottom > bottom) continue;
    if (whole <= room) return {line: title, size, foot};
    if (room > (FEW * size) / 2) cut ??= {line: shortened(title, BOLD * size, room), size, foot};
    if (cut && size < smallest) return cut;
  }
  const room = right - left - 2 * PADDING;
  return cut ?? {line: shortened(title, BOLD * SIZE, room), size: SIZE, foot: TITLE_AT + SIZE};
}

/** The box around a title. @param {string} text @param {Box} frame @returns {Box} */
function titleBox(text, frame) {
  const {line, foot} = fitTitle(text, frame, SIZE);
  const {left, top} = frame;
  const right = left + 2 * PADDING + width(line, BOLD * SIZE);
  return {left, right, top, bottom: top + foot + DESCENT * SIZE + BORDER};
}

/**
 * Where an annotation leaves no room for other words: all of a note, the title and the border of a frame.
 *
 * @param {string} text @param {Box} box @param {boolean} isFrame
 * @returns {Box[]}
 */
export function occupied(text, box, isFrame) {
  if (!isFrame) return [box];
  const {left, right, top, bottom} = box;
  const sides = [
    {left, right, top, bottom: top},
    {left, right, top: bottom, bottom},
    {left, right: left, top, bottom},
    {left: right, right, top, bottom},
  ].map((side) => wider(side, BORDER));
  return titleOf(text) ? [titleBox(text, box), ...sides] : sides;
}
