/**
 * Fit texts into the drawing. No font is measured: Python and the page break a text into the same lines on every machine,
 * by the widths of the letters of the widest font that a picture names.
 */

import {RADIUS} from "./geometry.js";
import {LETTER_WIDTHS} from "./letter-widths.js";

const WIDTHS = new Map(
  Object.entries(LETTER_WIDTHS).flatMap(([wide, letters]) =>
    Array.from(letters, (letter) => /** @type {[string, number]} */ ([letter, Number(wide) / 1000])),
  ),
);
const WIDE = 1; // of all other characters, some of which are narrower: ideographs fill a square
const WITHOUT_WIDTH = /[\p{Mn}\p{Me}\p{Cf}]/u; // accents, and what joins characters
/** How many times as wide as other letters bold ones are. */
export const BOLD = 1.14;
const SIZES = [13, 12, 11, 10];
/**
 * Sizes and numbers of lines, the best first: a single line may be a little smaller than several.
 *
 * @type {[number, number][]}
 */
const FITS = [
  [13, 1],
  [12, 1],
  ...SIZES.flatMap((size) => [1, 2, 3].map((count) => /** @type {[number, number]} */ ([size, count]))),
];
const LINE = 1.16;
const MARGIN = 5; // between a name and its state's rim
const RING_MARGIN = 10;
const STEP = 10; // by which a name may stand out further
const ELLIPSIS = "…";

/** @type {Map<string, {lines: string[], size: number}>} */
const fits = new Map();
const REMEMBERED = 20_000;

/** Width of a character, as a part of the size. @param {string} character */
function widthOf(character) {
  let known = WIDTHS.get(character);
  if (known === undefined) {
    const [base] = character.normalize("NFD");
    known = WITHOUT_WIDTH.test(character) ? 0 : (WIDTHS.get(base) ?? WIDE);
    if (WIDTHS.size < REMEMBERED) WIDTHS.set(character, known);
  }
  return known;
}

/** Width of a text in pixels. @param {string} text @param {number} size */
export function width(text, size) {
  let sum = 0;
  for (const each of text) sum += widthOf(each);
  return sum * size;
}

/**
 * A text that is no wider than some pixels, shortened at its end.
 *
 * @param {string} text @param {number} size @param {number} wanted
 */
export function shortened(text, size, wanted) {
  if (width(text, size) <= wanted) return text;
  return text.slice(0, fitting(text, size, wanted, width(ELLIPSIS, size))).trimEnd() + ELLIPSIS;
}

/**
 * The lines in which a name stands in a state's circle, and the size of its letters.
 *
 * It is broken at spaces, hyphens, underscores, before capitals and ideographs. Letters that are larger than usual may stand
 * out of the circle: no further than needed, since arrows and handles are there.
 *
 * @param {string} name
 * @param {number} [smallest] size of letters
 * @param {number} [spill] width of what may stand out
 */
export function fitCircle(name, hasRing = false, smallest = 0, spill = 0) {
  const key = `${hasRing} ${smallest} ${spill} ${name}`;
  let known = fits.get(key);
  if (!known) {
    known = fit(name, RADIUS - (hasRing ? RING_MARGIN : MARGIN), smallest, spill);
    if (fits.size > REMEMBERED) fits.clear();
    fits.set(key, known);
  }
  return known;
}

/** @param {string} name @param {number} radius @param {number} smallest @param {number} spill */
function fit(name, radius, smallest, spill) {
  const text = name.trim().replace(/\s+/g, " ");
  if (!text) return {lines: [], size: SIZES[0]};
  const words = text.split(/(?<=[\s_-])|(?<=[\p{Ll}\d])(?=\p{Lu})|(?=[\u3400-\u9fff])/u);
  /** @type {Room} */
  const circle = (line, count, size) => chord(line, count, size, radius);
  for (const [usual, count] of FITS) {
    if (usual < smallest && usual < SIZES[0]) continue;
    const size = Math.max(usual, smallest);
    const lines = broken(words, size, count, circle);
    if (lines) return {lines, size};
  }
  const size = Math.max(SIZES[SIZES.length - 1], smallest);
  const spills = smallest > SIZES[0] && spill > 2 * radius;
  const room = spills ? () => spill : circle;
  for (let wide = 2 * RADIUS; spills && wide < spill + STEP; wide += STEP) {
    const lines = broken(words, size, 2, () => Math.min(wide, spill));
    if (lines) return {lines, size};
  }
  const most = spills ? 2 : ([3, 2].find((count) => chord(0, count, size, radius) > 2 * size) ?? 1);
  const lines = inLines(words, size, most, room, most);
  return {lines: lines.map((line, index) => shortened(line, size, room(index, most, size))), size};
}

/** @typedef {(line: number, count: number, size: number) => number} Room the width of one of several lines */

/** @param {string[]} words @param {number} size @param {number} count @param {Room} room */
function broken(words, size, count, room) {
  const lines = inLines(words, size, count, room);
  const isIn =
    lines.length <= count && lines.every((line, index) => width(line, size) <= room(index, lines.length, size));
  return isIn ? lines : undefined;
}

/**
 * Words in as few lines as the room of several allows; the last one that there may be has all the rest.
 *
 * @param {string[]} words @param {number} size @param {number} count @param {Room} room
 */
function inLines(words, size, count, room, most = Infinity) {
  const lines = [""];
  for (const word of words) {
    const last = lines.length - 1;
    const longer = lines[last] + word;
    if (lines[last] && lines.length < most && width(longer.trim(), size) > room(last, count, size)) lines.push(word);
    else lines[last] = longer;
  }
  return lines.map((line) => line.trim());
}

/**
 * The width of a line that fits in the circle.
 *
 * @param {number} index @param {number} count @param {number} size @param {number} radius
 */
function chord(index, count, size, radius) {
  const height = size * LINE;
  const top = Math.abs((index - count / 2) * height);
  const bottom = Math.abs((index + 1 - count / 2) * height);
  const far = Math.max(top, bottom) - size * 0.2;
  return 2 * Math.sqrt(Math.max(0, radius ** 2 - far ** 2));
}

/** Distance between two lines. @param {number} size */
export const lineHeight = (size) => size * LINE;

/**
 * A text in lines no wider than some pixels, broken at spaces, or within a word that is wider. Its own line ends and the
 * spaces before a line are kept.
 *
 * @param {string} text @param {number} size @param {number} room
 */
export function wrapped(text, size, room) {
  /** @type {string[]} */
  const lines = [];
  for (const paragraph of text.replaceAll("\r\n", "\n").split("\n")) {
    let line = "\u00a0".repeat(/^ */.exec(paragraph)?.[0].length ?? 0);
    let hasWord = false;
    for (const word of paragraph.split(/\s+/).filter(Boolean)) {
      let longer = hasWord ? `${line} ${word}` : line + word;
      if (hasWord && width(longer, size) > room) {
        lines.push(line);
        longer = word;
      }
      while (width(longer, size) > room) {
        const taken = fitting(longer, size, room) || Array.from(longer)[0].length;
        if (taken === longer.length) break;
        lines.push(longer.slice(0, taken));
        longer = longer.slice(taken);
      }
      line = longer;
      hasWord = true;
    }
    lines.push(line);
  }
  return lines;
}

/**
 * How much of a text fits, in units of JavaScript, where some pixels are used already.
 *
 * @param {string} text @param {number} size @param {number} room
 */
function fitting(text, size, room, used = 0) {
  let taken = 0;
  for (const each of text) {
    used += widthOf(each) * size;
    if (used > room) break;
    taken += each.length;
  }
  return taken;
}
