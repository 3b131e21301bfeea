/** Figures in words, rounded half up as in plugins/trials/src/visualhfsm_trials/_statistics.py: page and terminal say the same. */

import {language} from "visualhfsm/kit/texts.js";

const DIGITS = 4;
const LEAST = -6; // exponent from which on a number is written without one
const MOST = 12; // and to which
const PLAIN = {useGrouping: false, maximumFractionDigits: 20};

/** @param {number} part */
export const percent = (part) => `${(100 * part).toLocaleString(language, {maximumFractionDigits: 1})} %`;

/** @param {number} number */
export function short(number) {
  const rounded = Number(number.toPrecision(DIGITS));
  const [mantissa, exponent] = rounded.toExponential().split("e").map(Number);
  if (!rounded || (LEAST <= exponent && exponent < MOST)) return plain(rounded);
  return `${plain(mantissa)}e${exponent}`;
}

/** @param {number} number */
const plain = (number) => (number || 0).toLocaleString(language, PLAIN); // never -0
