/**
 * The robots that the server has described, each requested once.
 *
 * @import {Described} from "./robot-drawing.js"
 */

import {store} from "../data/store.js";
import {t} from "../kit/texts.js";

/** Those that are known, or on their way, by the hash of their description. @type {Map<string, Promise<Described>>} */
const known = new Map();

/**
 * A robot as it is drawn; rejected when the server does not have it any more.
 *
 * @param {string} hash
 * @returns {Promise<Described>}
 */
export function bodyOf(hash) {
  const before = known.get(hash);
  if (before) return before;
  const asked = ask(hash);
  known.set(hash, asked);
  asked.catch(() => known.delete(hash)); // a later moment asks again
  return asked;
}

/** @param {string} hash */
async function ask(hash) {
  const found = await store.request("body", {hash});
  if (!found) throw new Error(t("The editor does not know this robot any more."));
  return found;
}
