/**
 * Names of tabs that are distinguished where there is little room.
 *
 * @import {TabState} from "./protocol.js"
 */

/** Letters at the end of a name that stay where the rest is cut. */
const USUAL = 5;
const LEAST = 4;
const MOST = 7;
/** Letters before them that are worth to be cut. */
const WORTH = 4;

/**
 * The folder of a document if another one has the same name, with as many folders above as distinguish them.
 *
 * @param {TabState} tab @param {TabState[]} tabs
 */
export function folderOf({tab, title, path}, tabs) {
  const others = tabs.filter((other) => other.title === title && other.tab !== tab).map((other) => other.path);
  if (!others.length) return "";
  const folders = path.split("/").slice(0, -1);
  /** @param {string} other @param {number} count */
  const isSame = (other, count) =>
    other
      .split("/")
      .slice(-1 - count, -1)
      .join() === folders.slice(-count).join();
  let count = 1;
  while (count < folders.length && others.some((other) => isSame(other, count))) count += 1;
  return folders.slice(-count).join("/");
}

/**
 * The beginning of a document's name, which is cut first, and its end, as long as it differs from those of the others.
 *
 * @param {TabState} tab @param {TabState[]} tabs
 * @returns {[string, string]}
 */
export function partsOf({tab, title}, tabs) {
  const shared = Math.max(0, ...tabs.filter((other) => other.tab !== tab).map((other) => sharedBy(title, other.title)));
  const long = shared ? Math.min(MOST, Math.max(LEAST, title.length - shared)) : USUAL;
  const letters = [...title];
  if (letters.length < long + WORTH) return ["", title];
  return [letters.slice(0, -long).join(""), letters.slice(-long).join("")];
}

/** The length of what two names have in common at their beginning. @param {string} one @param {string} other */
function sharedBy(one, other) {
  let count = 0;
  while (count < one.length && one[count] === other[count]) count += 1;
  return count;
}
