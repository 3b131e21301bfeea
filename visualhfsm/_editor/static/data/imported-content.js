/**
 * The content of the automata that documents import: they are drawn and followed like others, and edited in their file.
 *
 * @import {Automaton} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 */

import {page} from "./page.js";
import {store} from "./store.js";

/**
 * The shown imports of each tab: the imports that were requested, the answer, and the number of their last change.
 *
 * @type {Map<number, {asked: string, content: Automaton[], number?: number}>}
 */
const imported = new Map();
/** Settled when all that was requested is shown. @type {Promise<unknown>} */
let shown = Promise.resolve();

/** Request the imports of the shown document, now and whenever they may have changed. */
export function showImports() {
  store.addEventListener("document", ({detail}) => detail.tab === page.tab && lookAtImports(detail.tab));
  store.addEventListener("closed", ({detail}) => imported.delete(detail.tab));
  store.addEventListener("problems", ({detail}) => {
    const known = imported.get(detail.tab);
    if (!known || known.number === detail.imports) return;
    known.number = detail.imports;
    if (detail.tab === page.tab) lookAtImports(page.tab, true);
  });
  page.addEventListener("tab", () => lookAtImports(page.tab, true)); // the other file may have been changed there
  store.addEventListener("connection", () => store.online && lookAtImports(page.tab, true)); // not asked while offline
}

/** Resolves when all imports are shown. */
export const importsShown = () => shown;

/** @param {number} tab */
function lookAtImports(tab, again = false) {
  shown = Promise.all([shown, request(tab, again)]);
}

/** @param {number} tab @param {boolean} again */
async function request(tab, again) {
  const document = store.documents.get(tab);
  const asked = importsOf(document);
  const known = imported.get(tab);
  if (!document || (!asked && !known) || (known?.asked === asked && !again)) return;
  imported.set(tab, {asked, content: known?.content ?? [], number: known?.number});
  const content = asked ? await store.request("imported", {tab}).catch(() => []) : [];
  if (imported.get(tab)?.asked !== asked) return; // the imports have changed meanwhile
  imported.set(tab, {asked, content, number: imported.get(tab)?.number});
  store.showContent(tab, content);
}

/** The imports of a document as a text, to detect changes. @param {OpenDocument | undefined} document */
const importsOf = (document) =>
  [...(document?.own.values() ?? [])]
    .flatMap(({id, imported: from}) => (from ? `${id} ${from.automaton} ${from.file}` : []))
    .join("\n");
