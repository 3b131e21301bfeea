/**
 * What tests passed in a document.
 *
 * @import {Live} from "../canvas/live-marks.js"
 * @import {Passed, TestView} from "../protocol.js"
 * @import {OpenDocument} from "../store.js"
 */

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
 * @param {OpenDocument} document @param {readonly Passed[]} passed
 */
export function covered(document, passed) {
  const keys = new Set(passed.map(({automaton, kind, id}) => `${automaton} ${kind} ${id}`));
  let [states, allStates, transitions, allTransitions] = [0, 0, 0, 0];
  for (const automaton of document.automata.values()) {
    for (const {id} of automaton.states) states += Number(keys.has(`${automaton.id} state ${id}`));
    for (const {id} of automaton.transitions) transitions += Number(keys.has(`${automaton.id} transition ${id}`));
    allStates += automaton.states.length;
    allTransitions += automaton.transitions.length;
  }
  return `${states} of ${allStates} states, ${transitions} of ${allTransitions} transitions passed`;
}

/** How tests went, in words. @param {readonly TestView[]} tests */
export function summary(tests) {
  const ran = tests.filter(({outcome}) => outcome);
  if (!tests.length) return "No tests";
  if (!ran.length) return `${tests.length} ${tests.length === 1 ? "test" : "tests"}, not run yet`;
  const count = (/** @type {string} */ wanted) => tests.filter(({outcome}) => outcome === wanted).length;
  const parts = [count("passed") && `${count("passed")} passed`, count("failed") && `${count("failed")} failed`];
  if (count("skipped")) parts.push(`${count("skipped")} skipped`);
  if (count("")) parts.push(`${count("")} not run`);
  return parts.filter(Boolean).join(", ");
}
