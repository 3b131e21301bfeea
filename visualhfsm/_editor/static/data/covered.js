/**
 * What tests passed in a document.
 *
 * @import {Live} from "../canvas/live-marks.js"
 * @import {Automaton, Passed, PassedCode, Place, TestView, Transition} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 * @typedef {{place: Place, line: number, what: string, failed: boolean}} Gap something that was not passed, or not
 *   wholly: what, and where to look; a line of 0 is the element as a whole
 */

import {n, t} from "../kit/texts.js";

/**
 * The marks of what was passed, for the canvas.
 *
 * @param {readonly Passed[]} passed
 * @returns {Map<number, Map<string, Live>>}
 */
export function highlightOf(passed) {
  /** @type {Map<number, Map<string, Live>>} */
  const found = new Map();
  for (const {automaton, kind, id, count, failed} of passed) {
    let marks = found.get(automaton);
    if (!marks) found.set(automaton, (marks = new Map()));
    marks.set(`${kind === "state" ? "s" : "t"}${id}`, {passed: count, failed});
  }
  return found;
}

/**
 * How much of a document was passed, in words.
 *
 * @param {OpenDocument} document @param {readonly Passed[]} passed @param {readonly PassedCode[]} code
 */
export function covered(document, passed, code) {
  const keys = new Set(passed.filter(({count}) => count).map(({automaton, kind, id}) => `${automaton} ${kind} ${id}`));
  let [states, allStates, transitions, allTransitions] = [0, 0, 0, 0];
  for (const automaton of document.automata.values()) {
    for (const {id} of automaton.states) states += Number(keys.has(`${automaton.id} state ${id}`));
    for (const {id} of automaton.transitions) transitions += Number(keys.has(`${automaton.id} transition ${id}`));
    allStates += automaton.states.length;
    allTransitions += automaton.transitions.length;
  }
  const counts = {states, allStates, transitions, allTransitions};
  return code.length
    ? t(
        "{states} of {allStates} states, {transitions} of {allTransitions} transitions, {lines} of {allLines} lines passed",
        {...counts, ...sumOf(code)},
      )
    : t("{states} of {allStates} states, {transitions} of {allTransitions} transitions passed", counts);
}

/**
 * What tests have not passed of a document, in its order.
 *
 * @param {OpenDocument} document @param {readonly Passed[]} passed @param {readonly PassedCode[]} code
 * @returns {Gap[]}
 */
export function gapsIn(document, passed, code) {
  const known = new Map(passed.map((each) => [`${each.automaton} ${each.kind} ${each.id}`, each]));
  /** @type {Map<string, PassedCode[]>} */
  const pieces = new Map();
  for (const each of code) {
    const {automaton, kind, id = 0} = each.place;
    const key = `${automaton} ${kind} ${id}`;
    pieces.set(key, [...(pieces.get(key) ?? []), each]);
  }
  /** @type {Gap[]} */
  const gaps = [];
  for (const automaton of document.automata.values()) {
    gaps.push(...linesOf(pieces.get(`${automaton.id} automaton 0`)));
    for (const state of automaton.states) {
      const key = `${automaton.id} state ${state.id}`;
      if (known.get(key)?.count) gaps.push(...linesOf(pieces.get(key)));
      else gaps.push(gapAt({kind: "state", automaton: automaton.id, id: state.id}, t("never entered")));
    }
    for (const transition of automaton.transitions) {
      const key = `${automaton.id} transition ${transition.id}`;
      if (known.get(key)?.count) gaps.push(...linesOf(pieces.get(key)));
      else gaps.push(neverFired(automaton, transition, known.get(key)));
    }
  }
  return gaps;
}

/** @param {Place} place @param {string} what @returns {Gap} */
const gapAt = (place, what) => ({place, line: place.part ? 1 : 0, what, failed: false});

/** @param {Automaton} automaton @param {Transition} transition @param {Passed} [passed] */
function neverFired(automaton, {id, type, guard}, passed) {
  /** @type {Place} */
  const place = {kind: "transition", automaton: automaton.id, id};
  const part = type === "condition" ? "trigger" : guard.trim() ? "guard" : "";
  if (!part) return gapAt(place, t("never fired"));
  const isCondition = type === "condition";
  const count = passed?.asked ?? 0;
  let why;
  if (!count)
    why = isCondition
      ? t("never fired: its condition was never evaluated")
      : t("never fired: its guard was never evaluated");
  else if (passed?.held)
    why = isCondition ? t("never fired: though its condition was true") : t("never fired: though its guard was true");
  else
    why = isCondition
      ? n(
          "never fired: its condition was evaluated once, and was never true",
          "never fired: its condition was evaluated {count} times, and was never true",
          count,
        )
      : n(
          "never fired: its guard was evaluated once, and was never true",
          "never fired: its guard was evaluated {count} times, and was never true",
          count,
        );
  return gapAt({...place, part}, why);
}

/**
 * The lines of one element, in all its code, unless tests passed all of them.
 *
 * @param {readonly PassedCode[]} [pieces]
 * @returns {Gap[]}
 */
function linesOf(pieces = []) {
  const broken = pieces.find(({failed}) => failed.length);
  const first = broken ?? pieces.find(({missed}) => missed.length);
  if (!first) return [];
  const what = broken
    ? t("{lines} of {allLines} lines passed; a test failed in its code", sumOf(pieces))
    : t("{lines} of {allLines} lines passed", sumOf(pieces));
  return [{place: first.place, line: (broken ? first.failed : first.missed)[0], what, failed: Boolean(broken)}];
}

/** @param {readonly PassedCode[]} pieces */
function sumOf(pieces) {
  const passed = pieces.reduce((sum, each) => sum + each.passed.length, 0);
  const all = pieces.reduce((sum, each) => sum + each.missed.length + each.failed.length, passed);
  return {lines: passed, allLines: all};
}

/** What tests passed of a piece of code, as a sentence. @param {PassedCode} code */
export function linesInWords(code) {
  const [missed, failed] = [lineNumbers(code.missed), lineNumbers(code.failed)];
  const {lines, allLines} = sumOf([code]);
  const values = {lines, missed, failed};
  if (missed && failed)
    return n(
      "Tests passed {lines} of {count} line, not {missed}, and failed in {failed}",
      "Tests passed {lines} of {count} lines, not {missed}, and failed in {failed}",
      allLines,
      values,
    );
  if (missed)
    return n(
      "Tests passed {lines} of {count} line, not {missed}",
      "Tests passed {lines} of {count} lines, not {missed}",
      allLines,
      values,
    );
  if (failed)
    return n(
      "Tests passed {lines} of {count} line, and failed in {failed}",
      "Tests passed {lines} of {count} lines, and failed in {failed}",
      allLines,
      values,
    );
  return n("Tests passed {lines} of {count} line", "Tests passed {lines} of {count} lines", allLines, values);
}

const POLYNOMIAL = 0xedb88320; // of CRC-32, as in zlib

/** The number by which a piece of code is known again, as in `visualhfsm/_processes/test_results.py`. @param {string} text */
export function versionOf(text) {
  let rest = ~0;
  for (const byte of new TextEncoder().encode(text)) {
    rest ^= byte;
    for (let bit = 0; bit < 8; bit += 1) rest = (rest >>> 1) ^ (rest & 1 && POLYNOMIAL);
  }
  return ~rest >>> 0;
}

const MOST_NUMBERS = 12;

/** The numbers of lines, in words; nothing for none. @param {readonly number[]} lines */
function lineNumbers(lines) {
  if (!lines.length) return "";
  const shown = lines.slice(0, MOST_NUMBERS).join(", ");
  return lines.length > MOST_NUMBERS
    ? t("lines {lines} and {more} more", {lines: shown, more: lines.length - MOST_NUMBERS})
    : n("line {lines}", "lines {lines}", lines.length, {lines: shown});
}

/** How tests went, in words. @param {readonly TestView[]} tests */
export function summary(tests) {
  const ran = tests.filter(({outcome}) => outcome);
  if (!tests.length) return t("No tests");
  if (!ran.length) return n("{count} test, not run yet", "{count} tests, not run yet", tests.length);
  const count = (/** @type {string} */ wanted) => tests.filter(({outcome}) => outcome === wanted).length;
  const [passed, failed, skipped, left] = ["passed", "failed", "skipped", ""].map(count);
  const parts = [
    passed && n("{count} passed", "{count} passed", passed),
    failed && n("{count} failed", "{count} failed", failed),
    skipped && n("{count} skipped", "{count} skipped", skipped),
    left && n("{count} not run", "{count} not run", left),
  ];
  return parts.filter(Boolean).join(", ");
}
