/**
 * What the user asks of trials: the words of the button, and the request that it sends.
 *
 * @import {OpenDocument} from "visualhfsm/data/store.js"
 * @import {PlanFacts, TrialsPush, FailureView} from "./messages.js"
 * @typedef {"sim" | "fake" | "none"} Robot
 * @typedef {{runs?: number, state?: string, robot?: Robot, limit?: number}} Draft what was changed and is not sent yet
 */

import {rootOf} from "visualhfsm/data/outline.js";
import {decimal, n, t} from "visualhfsm/kit/texts.js";

export const MOST_RUNS = 1_000_000;
const MOST_MORE = 1000; // that are added at once
const MOST_STATES = 300;
const MOST_LEVELS = 12;

/**
 * What the button does: trials are never run twice, and those of an older version are replaced only on purpose.
 *
 * @param {TrialsPush} trials @param {Draft} draft
 */
export function verbOf(trials, draft) {
  const done = trials.view?.share.trials ?? 0;
  const runs = draft.runs ?? trials.plan?.runs ?? 0;
  if (!done) return t("Run");
  if (isOlder(trials, draft)) return t("Run from the start");
  return done < runs ? t("Go on") : n("Run {count} more", "Run {count} more", more(runs));
}

/**
 * The fields of the request. A plan has what else one might choose.
 *
 * @param {TrialsPush} trials @param {PlanFacts} plan @param {Draft} draft
 */
export function requestOf(trials, plan, draft) {
  const {state = plan.state, robot = /** @type {Robot} */ (plan.robot), limit = plan.limit} = draft;
  const done = trials.view?.share.trials ?? 0;
  const again = done > 0 && isOlder(trials, draft);
  let runs = draft.runs ?? plan.runs;
  if (done >= runs && !again) runs = Math.min(MOST_RUNS, runs + more(runs));
  return plan.file ? {runs, again} : {runs, again, state, robot, limit};
}

/** Whether the outcomes are of something else than what would run now. @param {TrialsPush} trials @param {Draft} draft */
function isOlder({outdated, plan}, {state, robot, limit}) {
  return (
    outdated ||
    (state !== undefined && state !== plan?.state) ||
    (robot !== undefined && robot !== plan?.robot) ||
    (limit !== undefined && limit !== plan?.limit)
  );
}

/** How many are added when all are done. @param {number} runs */
const more = (runs) => Math.min(runs, MOST_MORE);

/** How long the others take, in words. @param {number} seconds */
export function duration(seconds) {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  return seconds < 5400 ? `${Math.round(seconds / 60)} min` : `${decimal(seconds / 3600, 1)} h`;
}

/** The paths of the states of a document. @param {OpenDocument | undefined} document @returns {string[]} */
export const statePaths = (document) => [...statesByPath(document).keys()];

/** The first state of each path of a document. @param {OpenDocument | undefined} document */
function statesByPath(document) {
  /** @type {Map<string, {automaton: number, id: number}>} */
  const found = new Map();
  /** @param {import("visualhfsm/data/protocol.js").Automaton | undefined} automaton @param {string} above @param {number} level */
  const visit = (automaton, above, level) => {
    for (const {id, name, children} of automaton?.states ?? []) {
      if (found.size >= MOST_STATES || level > MOST_LEVELS) return;
      if (automaton && !found.has(above + name)) found.set(above + name, {automaton: automaton.id, id});
      for (const child of children) visit(document?.automata.get(child), `${above}${name}/`, level + 1);
    }
  };
  visit(document && rootOf(document), "", 0);
  return found;
}

/**
 * Marks for the states in which failed trials ended: how many, and whether nowhere more did.
 *
 * @param {OpenDocument | undefined} document @param {readonly FailureView[]} ways
 */
export function endings(document, ways) {
  const states = statesByPath(document);
  /** @type {Map<number, Map<string, import("visualhfsm/canvas/live-marks.js").Live>>} */
  const found = new Map();
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const {states: paths, count} of ways)
    for (const path of paths.split(", ")) counts.set(path, (counts.get(path) ?? 0) + count);
  const most = Math.max(...counts.values());
  for (const [path, ended] of counts) {
    const state = states.get(path);
    if (!state) continue;
    const marks = found.get(state.automaton) ?? new Map();
    found.set(state.automaton, marks.set(`s${state.id}`, {ended, most: ended === most}));
  }
  return found;
}
