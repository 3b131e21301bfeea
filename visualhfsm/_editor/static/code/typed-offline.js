/**
 * What was typed while the editor was offline, when it was started again: the page is loaded again then, and puts it into
 * the documents that it had been typed into, once these are as they were.
 *
 * @import {Command, Place} from "../data/protocol.js"
 * @import {Send} from "./draft.js"
 * @typedef {{tab: number, text: string, base?: string, lost: string[], send: Send}} Piece `lost` are texts that the
 *   document may have already
 * @typedef {{path: string, title: string, text: string, lost: string[], command: Command, base?: string}} Typed
 */

import {notify, notifyError} from "../kit/notices.js";
import {windowStorage} from "../kit/location.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";

const KEPT = "visualhfsm.typed";

/** The texts that were kept. @returns {Typed[]} */
const read = () => JSON.parse(windowStorage.getItem(KEPT) ?? "[]");
/** @param {Typed[]} texts */
const write = (texts) =>
  texts.length ? windowStorage.setItem(KEPT, JSON.stringify(texts)) : windowStorage.removeItem(KEPT);

/** The open documents; of an editor that was started again they are others. */
let {tabs: open} = store.workspace;
const remember = () => {
  if (store.online) open = store.workspace.tabs;
};
store.addEventListener("connection", remember);
store.addEventListener("workspace", remember);

/** Keep pieces of text for the page that is about to be loaded. @param {Piece[]} pieces */
export function keepTyped(pieces) {
  const kept = read();
  for (const {tab, text, base, lost, send} of pieces) {
    const {path = "", title = ""} = open.find((each) => each.tab === tab) ?? {};
    // Nothing is sent any more: what would have been is kept.
    store.do = (_, command, from) => {
      kept.push({path, title, text, lost, command, base: from});
      return new Promise(() => {});
    };
    send(tab, text, base);
  }
  write(kept);
}

/** Put the kept texts back, each when its document is there. @param {(text: string) => void} giveUp on one that no document takes */
export function putTypedBack(giveUp) {
  /** The tabs of documents before the user decided on what was not saved; 0 for none. @type {Map<Typed, number>} */
  const before = new Map();
  const stop = new AbortController();
  let left = read();

  /** @param {Typed} typed @param {number} tab */
  const put = async ({title, text, lost, command, base}, tab) => {
    const present = textAt(tab, command);
    try {
      const done = await store.do(tab, command, present !== undefined && lost.includes(present) ? present : base);
      notify(t("What you typed while the editor was offline is in {title} again.", {title}));
      if (done.conflict) notify(t("Somebody else changed the same words: the text now contains both versions."));
    } catch (error) {
      notifyError(error);
      giveUp(text);
    }
  };
  const look = () => {
    if (!store.online) return; // it is not known yet what is open
    const {tabs, recoverable} = store.workspace;
    left = left.filter((typed) => {
      const {path, title, text} = typed;
      const tab = tabs.findLast((each) => each.path === path && (path || each.title === title))?.tab ?? 0;
      const isUndecided = recoverable.some((each) => each.path === path && (path || each.name === title));
      if (isUndecided && !before.has(typed)) before.set(typed, tab);
      if (isUndecided || (tab && !store.documents.has(tab))) return true;
      if (!tab || before.get(typed) === tab)
        giveUp(text); // it is not open, or the user wants it as it was saved
      else put(typed, tab);
      return false;
    });
    write(left);
    if (!left.length) stop.abort();
  };
  for (const kind of /** @type {const} */ (["connection", "workspace", "document"]))
    store.addEventListener(kind, look, {signal: stop.signal});
  look();
}

/** The text that a command would replace, if it is that of a state or a transition. @param {number} tab @param {any} command */
function textAt(tab, {place}) {
  const {kind, automaton, id, part} = /** @type {Place} */ (place ?? {});
  const elements = /** @type {any} */ (store.documents.get(tab)?.automata.get(automaton ?? 0))?.[`${kind}s`] ?? [];
  return elements.find((/** @type {{id: number}} */ each) => each.id === id)?.[part ?? ""];
}
