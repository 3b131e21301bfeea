/** The problems of a document, by what they are about. */

/** @type {WeakMap<object[], Map<string, object>>} */
const known = new WeakMap();
const RANK = {error: 2, warning: 1};

/**
 * The worst problem of a state or transition, undefined without one.
 *
 * @param {import("./store.js").Problem[]} problems
 * @param {"state" | "transition"} kind
 */
export function problemOf(problems, automaton, kind, id) {
  let index = known.get(problems);
  if (!index) known.set(problems, (index = indexed(problems)));
  return index.get(`${automaton}/${kind}/${id}`);
}

/**
 * The worst problem of an automaton as such, of its period or of what it imports.
 *
 * @param {import("./store.js").Problem[]} problems
 */
export const problemOfAutomaton = (problems, automaton) => problemOf(problems, automaton, "automaton", "");

/** Whether two problems, or their lack, look the same. */
export const sameProblem = (one, other) =>
  one === other || (one?.severity === other?.severity && one?.message === other?.message);

/** How many problems of a severity there are. */
export const countOf = (problems, severity) => problems.filter((each) => each.severity === severity).length;

function indexed(problems) {
  const index = new Map();
  for (const problem of problems) {
    const {kind, automaton, id} = problem.place ?? {};
    if (!automaton || !RANK[problem.severity]) continue;
    const key = `${automaton}/${kind}/${id || ""}`;
    if (RANK[problem.severity] > (RANK[index.get(key)?.severity] ?? 0)) index.set(key, problem);
  }
  return index;
}
