/** How the parts of the chosen robot can fail. */

import {chosenBody} from "../data/robot.js";
import {store} from "../data/store.js";

/** The ways to fail of each part. @type {Record<string, string[]>} */
let failures = {};
/** @type {string | undefined} */
let known;

/** Ask the server, once for each robot; failures that are not known are typed by hand. */
export async function loadFailures() {
  const body = chosenBody();
  if (body === known) return;
  known = body;
  failures = await store.request("failures", {body}).catch(() => ({}));
}

/** @param {string} field @param {{part?: string}} entry @returns {string[]} */
export function failureSuggestions(field, {part = ""}) {
  if (field === "part") return Object.keys(failures);
  return field === "kind" ? (failures[part.trim()] ?? []) : [];
}
