/**
 * Runs beside components that others have started on the same robot: the server refuses them until the user has accepted
 * these, once for each.
 */

import {confirm} from "../kit/dialog.js";
import {started} from "../data/started.js";
import {RequestError, store} from "../data/store.js";
import {t} from "../kit/texts.js";

/**
 * @import {Answers} from "../data/messages.js"
 * @import {Requests} from "../data/protocol.js"
 */

/** The components of others beside which the user runs. @type {Set<string>} */
const accepted = new Set();

/**
 * Start a component; ask first whether to run beside those of others.
 *
 * @param {Requests["start"]} request
 * @returns {Promise<Answers["start"] | null>} null if the user decides against it; rejected with a RequestError
 */
export async function startBeside(request) {
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
