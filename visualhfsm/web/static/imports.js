/** Shows what a document imports: drawn, followed and read like everything else, and changed where it comes from. */

import {page} from "./page.js";
import {store} from "./store.js";

/** @typedef {import("./store.js").Automaton} Automaton */

/** What is shown of each tab: for which imports it was asked, and what came. @type {Map<number, {asked: string, content: Automaton[]}>} */
const shown = new Map();

/** Ask for what the shown document imports, now and whenever that may be something else. */
export function showImports() {
  store.addEventListener("document", ({detail}) => detail.tab === page.tab && look(detail.tab));
  store.addEventListener("closed", ({detail}) => shown.delete(detail.tab));
  page.addEventListener("tab", () => look(page.tab, true)); // the other file may have been changed there
}

async function look(tab, anew = false) {
  const document = store.documents.get(tab);
  const asked = importsOf(document);
  const known = shown.get(tab);
  if (!document || (!asked && !known) || (known?.asked === asked && !anew)) return;
  shown.set(tab, {asked, content: known?.content ?? []});
  const content = asked ? await store.request("imported", {tab}).catch(() => []) : [];
  if (shown.get(tab)?.asked !== asked) return; // it is another one meanwhile
  shown.set(tab, {asked, content});
  store.showContent(tab, content);
}

/** The imports of a document in a text, which changes when they do. */
const importsOf = (document) => [...(document?.own.values() ?? [])].filter(({imported}) => imported).map(({id, imported}) => `${id} ${imported.automaton} ${imported.file}`).join("\n");
