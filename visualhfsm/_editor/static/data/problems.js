/**
 * The problems of a document by their elements.
 *
 * @import {Place, Problem} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 */

import {ownerOf, titleOf} from "./outline.js";
import {t} from "../kit/texts.js";

/** Severities in words. @type {Record<string, string>} */
export const SEVERITIES = {error: t("error"), warning: t("warning"), note: t("note")};

/** The code of a problem that a run has shown. */
export const FAILED = "run";

/** @type {WeakMap<Problem[], Problem[]>} */
const spread = new WeakMap();

/**
 * The problems with all their places: what is wrong in an imported file is so in each automaton that is imported from
 * it, and is said of the states that own them.
 *
 * @param {Problem[]} problems
 * @returns {Problem[]}
 */
export function placed(problems) {
  let found = spread.get(problems);
  if (!found) spread.set(problems, (found = problems.flatMap(withCopies)));
  return found;
}

/** @param {Problem} problem @returns {Problem[]} */
function withCopies({copies = [], owners = [], ...problem}) {
  const {place} = problem;
  const said = problem.file ? {...problem, message: inFile(problem), line: 0} : problem;
  const isOwner = owners.some((each) => samePlace(each, place));
  return [
    ...(isOwner ? [] : [problem]),
    ...copies.map((each) => ({...problem, place: each})),
    ...owners.map((each) => ({...said, place: each})),
  ];
}

/** @param {Place} one @param {Place | null} [other] */
const samePlace = (one, other) =>
  one.kind === other?.kind && one.automaton === other.automaton && one.id === other.id && !other.part;

/** What is wrong, and where in its file. @param {Problem} problem */
function inFile({message, file = "", where = "", line = 0}) {
  if (where) return t("In {file}, {place}: {message}", {file, place: where, message});
  if (line) return t("In {file}, line {line}: {message}", {file, line, message});
  return t("In {file}: {message}", {file, message});
}

/** @type {WeakMap<Problem[], Map<string, Problem>>} */
const known = new WeakMap();
const RANK = {error: 2, warning: 1, note: 0};

/**
 * The worst problem of a state or transition, undefined if there is none.
 *
 * @param {Problem[]} problems @param {"state" | "transition" | "automaton"} kind @param {number} automaton
 * @param {number | ""} id
 * @returns {Problem | undefined}
 */
export function problemOf(problems, automaton, kind, id) {
  let index = known.get(problems);
  if (!index) known.set(problems, (index = indexed(problems)));
  return index.get(`${automaton}/${kind}/${id}`);
}

/** @type {WeakMap<Problem[], Map<string, Problem>>} */
const within = new WeakMap();

/**
 * The first error in the automata below a state, at best one that a run has shown; undefined if there is none.
 *
 * @param {OpenDocument} document @param {number} automaton @param {number} id
 * @returns {Problem | undefined}
 */
export function errorBelow(document, automaton, id) {
  let index = within.get(document.problems);
  if (!index) within.set(document.problems, (index = indexedAbove(document)));
  return index.get(`${automaton}/${id}`);
}

/** @param {OpenDocument} document */
function indexedAbove(document) {
  /** @type {Map<string, Problem>} */
  const index = new Map();
  const errors = placed(document.problems).filter((each) => each.severity === "error" && each.place?.automaton);
  for (const problem of [...errors.filter(({code}) => code === FAILED), ...errors]) {
    const at = document.automata.get(problem.place?.automaton ?? 0);
    const state = problem.place?.kind === "state" && at?.states.find((each) => each.id === problem.place?.id);
    for (let each = at; each?.father; each = document.automata.get(each.father)) {
      const key = `${each.father}/${ownerOf(document, each)?.id}`;
      if (index.has(key)) break; // and so all above
      const where = (state && state.name) || (at && titleOf(document, at));
      index.set(key, {...problem, message: t("In {file}: {message}", {file: where, message: problem.message})});
    }
  }
  return index;
}

/**
 * The worst problem of an automaton as such, of its period or of what it imports.
 *
 * @param {Problem[]} problems @param {number} automaton
 */
export const problemOfAutomaton = (problems, automaton) => problemOf(problems, automaton, "automaton", "");

/**
 * Whether two problems, or their lack, look the same.
 *
 * @param {Pick<Problem, "severity" | "message">} [one] @param {Pick<Problem, "severity" | "message">} [other]
 */
export const sameProblem = (one, other) =>
  one === other || (one?.severity === other?.severity && one?.message === other?.message);

/** @param {Problem[]} problems */
function indexed(problems) {
  /** @type {Map<string, Problem>} */
  const index = new Map();
  for (const problem of placed(problems)) {
    const {kind, automaton, id} = problem.place ?? {};
    if (!automaton || !RANK[problem.severity]) continue;
    const key = `${automaton}/${kind}/${id || ""}`;
    if (RANK[problem.severity] > RANK[index.get(key)?.severity ?? "note"]) index.set(key, problem);
  }
  return index;
}
