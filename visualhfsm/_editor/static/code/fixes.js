/**
 * What a click fixes of a problem, in the code and in the list of problems: what `visualhfsm._document.fixes` found.
 *
 * @import {Place, Problem} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{name: string, apply: () => void}} Fix
 * @typedef {{problems: Problem[], fixes: Map<string, Fix[]>, learnt: Promise<void>}} Known the fixes of these problems by
 *   their keys; as long as they are not `learnt`, those of the problems before
 */

import {html} from "lit";
import {ask} from "../data/commands.js";
import {store} from "../data/store.js";
import {coded, t} from "../kit/texts.js";

/** What is known of each tab. @type {Map<number, Known>} */
const known = new Map();

/** Ask for the fixes of a document's problems, once; the event `fixes` of the store follows. @param {OpenDocument} document */
export function learnFixes({tab, problems}) {
  const former = known.get(tab);
  if (former?.problems === problems) return former.learnt;
  /** @type {Known} */
  const next = {problems, fixes: former?.fixes ?? new Map(), learnt: Promise.resolve()};
  known.set(tab, next);
  if (problems.some(({place, file}) => place && !file) && !store.isRecorded(tab)) next.learnt = learn(tab, next);
  return next.learnt;
}

/** @param {number} tab @param {Known} about */
async function learn(tab, about) {
  const asked = store.request("fixes", {tab});
  const found = await asked.catch(() => null); // without an answer there is no fix
  const fixes = (found?.fixes ?? []).map(({name, command}) => ({name, apply: () => void ask("do", {tab, command})}));
  about.fixes = new Map(found?.problems.map((each) => [keyOf(each), each.fixes.map((index) => fixes[index])]));
  store.dispatchEvent(new CustomEvent("fixes", {detail: {tab}}));
}

/** @param {{code: string, place?: Place | null, line?: number, column?: number}} problem */
const keyOf = ({code, place, line = 0, column = 0}) => JSON.stringify([code, place, line, column]);

/** The fixes of a problem of an open document, as far as they are known. @param {Problem} problem @param {OpenDocument} document @returns {Fix[]} */
export function fixesFor(problem, document) {
  const {place, severity, file} = problem;
  if (file) return []; // it is changed there
  void learnFixes(document);
  const choose = async () => (await import("../data/files.js")).chooseImport(place?.automaton ?? 0);
  const isImport = place?.part === "import" && severity === "error";
  return [
    ...(known.get(document.tab)?.fixes.get(keyOf(problem)) ?? []),
    ...(isImport ? [{name: t("Choose the file…"), apply: () => void choose()}] : []),
  ];
}

/** The fixes of problems as buttons. @param {OpenDocument | null | undefined} document @param {Problem[]} problems */
export const fixButtons = (document, problems) =>
  problems
    .flatMap((each) => (document ? fixesFor(each, document) : []))
    .map((each) => html`<button type="button" class="play fix" @click=${each.apply}>${coded(each.name)}</button>`);
