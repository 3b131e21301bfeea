/**
 * What is asked before a run: whether to end the one before it, and whether to run beside components that others have
 * started on the same robot: the server refuses that until the user has accepted these, once for each.
 */

import {confirm} from "../kit/dialog.js";
import {isEnabled, perform} from "../kit/registry.js";
import {started} from "../data/component-status.js";
import {RequestError, store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {planned} from "../run/breakpoints.js";

/**
 * @import {Answers, Requests} from "../data/protocol.js"
 * @import {Choice} from "../kit/dialog.js"
 */

const MOST_ARGUMENTS = 80;
const LONGEST_CONDITION = 900; // characters that fit in an argument of the command line

/** The components of others beside which the user runs. @type {Set<string>} */
const accepted = new Set();

/**
 * Whether a tab may run: while its component does, the user is asked, who may reload it where that `serves` as well.
 *
 * @param {number} tab @param {import("../kit/registry.js").Context} context @param {boolean} serves
 */
export async function mayRun(tab, context, serves) {
  const {component = "", status = "ended"} = started.of(tab) ?? {};
  if (["ended", "stopping"].includes(status)) return true;
  const reloads = serves && isEnabled("reload", context);
  const choice = await confirm({
    title: t("{component} runs", {component}),
    text: reloads
      ? t("Run it again from its beginning, or let it go on in the document as it is now?")
      : t("End it, and run it again from its beginning?"),
    choices: [
      ["again", t("Run again")],
      .../** @type {Choice[]} */ (reloads ? [["reload", t("Reload"), "primary"]] : []),
    ],
  });
  if (choice === "reload") perform("reload", context);
  return choice === "again";
}

/**
 * Start a component with the breakpoints that are planned for it.
 *
 * @param {Requests["start"]} request
 */
export const startWithBreakpoints = (request) =>
  startBeside({...request, arguments: [...(request.arguments ?? []), ...breakpointArguments(request.tab)]});

/** The arguments that start a component with its breakpoints. @returns {string[]} @param {number} tab */
function breakpointArguments(tab) {
  planned.takeLate(tab);
  const fitting = planned
    .of(tab)
    .filter(({condition}) => condition.length < LONGEST_CONDITION)
    .slice(0, MOST_ARGUMENTS / 2);
  return fitting.flatMap(({automaton, state, transition, condition}) => [
    "--breakpoint",
    `${automaton}.${state || `t${transition}`}${condition && `:${condition}`}`,
  ]);
}

/**
 * Start a component; ask first whether to run beside those of others.
 *
 * @param {Requests["start"]} request
 * @returns {Promise<Answers["start"] | null>} null if the user decides against it; rejected with a RequestError
 */
async function startBeside(request) {
  for (const name of accepted) if (!started.elsewhere.includes(name)) accepted.delete(name);
  try {
    return await store.request("start", {...request, beside: [...accepted]});
  } catch (error) {
    if (!(error instanceof RequestError && error.kind === "shared")) throw error;
    const others = started.elsewhere; // those that the server has named, and those that are accepted
    const choice = await confirm({
      title: t("Others use this robot"),
      text: error.message,
      choices: [["beside", t("Run beside it")]],
    });
    if (choice !== "beside") return null;
    for (const name of others) accepted.add(name);
    return startBeside(request);
  }
}
