/**
 * What a click fixes of a problem, in the code and in the list of problems.
 *
 * @import {Correction, Misspelt, Place, Problem} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{name: string, apply: () => void}} Fix
 */

import {apply} from "../data/commands.js";
import {t} from "../kit/texts.js";
import {declare, loadIdentities, typeOf} from "./known-interfaces.js";
import {keyOf} from "./places.js";

/** The problem of an attribute of `self` that nothing declares. */
const UNKNOWN_ATTRIBUTE = "W524";
/** The problems of a variable that an automaton above has: code reads it, or assigns it. */
const READ_ABOVE = "W535";
const ASSIGNED_ABOVE = "W542";

/** Ask for what the fixes of some problems need to know; return whether that was anything. @param {Problem[]} problems */
export async function learnFixes(problems) {
  const asks = problems.some(({code}) => code === UNKNOWN_ATTRIBUTE);
  if (asks) await loadIdentities();
  return asks;
}

/**
 * The fixes of a problem with a name, in a document with these problems.
 *
 * @param {Problem} problem
 * @param {string} name
 * @param {number} automaton
 * @param {Problem[]} problems
 * @returns {Fix[]}
 */
export function fixesFor(problem, name, automaton, problems) {
  if (problem.file) return []; // it is changed there
  return [...correctionsOf(problem, problems), ...declarationsOf(problem, name, automaton)];
}

/** What writes the name that is meant: here, and wherever it is misspelt like this. @param {Problem} problem @param {Problem[]} problems @returns {Fix[]} */
function correctionsOf(problem, problems) {
  const {misspelt} = problem;
  if (!misspelt) return [];
  const {name, meant} = misspelt;
  const here = correctionAt(problem, misspelt);
  const others = problems
    .filter((each) => !each.file && each.misspelt?.name === name && each.misspelt.meant === meant)
    .map((each) => correctionAt(each, misspelt))
    .filter((each) => !isSame(each, here));
  /** @param {Correction[]} at */
  const correct = (at) => () => void apply("correctName", {name, meant, at});
  const fixes = [{name: t("Write {meant}", {meant}), apply: correct([here])}];
  const count = others.length + 1;
  if (count > 1)
    fixes.push({name: t("Write {meant} in all {count} places", {meant, count}), apply: correct([here, ...others])});
  return fixes;
}

/** @param {Problem} problem @param {Misspelt} misspelt @returns {Correction} */
function correctionAt({place, line = 0, column = 0}, {field = ""}) {
  return {place: place ?? {kind: "document"}, ...(line ? {line, column} : {field})};
}

/** @param {Correction} one @param {Correction} other */
const isSame = (one, other) =>
  keyOf(one.place) === keyOf(other.place) && one.line === other.line && one.column === other.column;

/** @param {Problem} problem @param {string} name @param {number} automaton @returns {Fix[]} */
function declarationsOf({code}, name, automaton) {
  if (!name) return [];
  const type = code === UNKNOWN_ATTRIBUTE ? typeOf(name) : undefined;
  if (type) return [{name: t("Declare {name} ({type})", {name, type}), apply: () => void declare(name, type)}];
  const about = {automaton, name};
  const shared = {name: t("Write self.{name} in both", {name}), apply: () => void apply("shareVariable", about)};
  if (code === READ_ABOVE)
    return [{name: t("Pass {name} as an input", {name}), apply: () => void apply("passVariable", about)}, shared];
  if (code === ASSIGNED_ABOVE)
    return [{name: t("Hand {name} up as an output", {name}), apply: () => void apply("handUpVariable", about)}, shared];
  return [];
}

/** The fixes of a problem of a document, whose name its code has. @param {OpenDocument} document @param {Problem} problem */
export function fixesOf(document, problem) {
  const {place, line = 0, column = 1, length = 0} = problem;
  const text = place && !problem.file ? textAt(document, place) : "";
  const rest = text.split("\n")[line - 1]?.slice(Math.max(0, column - 1)) ?? "";
  const name = rest.slice(0, Math.max(length, /^\w+/.exec(rest)?.[0].length ?? 0));
  return fixesFor(problem, name, place?.automaton ?? 0, document.problems);
}

/** The code at a place; empty for other places. @param {OpenDocument} document @param {Place} place */
function textAt(document, {kind, automaton = 0, id, part = ""}) {
  const shown = document.automata.get(automaton);
  const found =
    kind === "state"
      ? shown?.states.find((each) => each.id === id)
      : kind === "transition"
        ? shown?.transitions.find((each) => each.id === id)
        : shown;
  const text = /** @type {Record<string, unknown> | undefined} */ (/** @type {unknown} */ (found))?.[part];
  return typeof text === "string" ? text : "";
}
