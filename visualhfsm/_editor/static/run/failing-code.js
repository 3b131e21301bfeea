/** The code of a state in which something went wrong. */

import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {monitor} from "./monitor.js";

/** @typedef {{automaton: number, state: number, location: string}} Failing where a component reports code */

/**
 * The place of a report in the document of the followed component; undefined if it is not known.
 *
 * @param {Failing} report
 */
export async function find({automaton, state, location}) {
  const {tab} = monitor;
  if (!tab || !location) return undefined;
  return (await store.request("locate", {tab, text: location, automaton, state}).catch(() => null)) ?? undefined;
}

/**
 * Show the code of a report: its line where that is known, else the code of the state.
 *
 * @param {Failing} report
 */
export async function show(report) {
  const {tab} = monitor;
  if (!tab) return;
  page.show(tab);
  const found = await find(report);
  if (page.tab !== tab) return;
  if (found) page.jump(found.place, {line: found.line});
  else page.jump({kind: "state", automaton: report.automaton, id: report.state, part: "code"});
}
