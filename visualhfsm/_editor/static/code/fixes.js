/**
 * What a click fixes of a problem, in the code and in the list of problems.
 *
 * @import {Correction, Misspelt, Problem} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{name: string, apply: () => void}} Fix
 */

import {html} from "lit";
import {apply} from "../data/commands.js";
import {coded, t} from "../kit/texts.js";
import {declare, loadIdentities, typeOf} from "./known-interfaces.js";
import {keyOf} from "./places.js";

/** The problem of an attribute of `self` that nothing declares. */
const UNKNOWN_ATTRIBUTE = "W524";
/** The problem of a name that nothing defines. */
const UNDEFINED = "W520";
/** The problems of a variable that an automaton above has: code reads it, or assigns it. */
const READ_ABOVE = "W535";
const ASSIGNED_ABOVE = "W542";
/** The parts of a document with code: the place of a problem there is exactly where it is wrong. */
const CODE = new Set(["argument", "code", "entry", "exit", "fired", "functions", "guard", "trigger", "variables"]);
/** What word processors and PDFs write instead of quotes, hyphens and spaces. */
const TYPOGRAPHIC =
  /[\u00a0\u00ab\u00ad\u00b4\u00bb\u2000-\u201f\u2026-\u2033\u2039\u203a\u205f\u2060\u2212\u3000\ufeff]/;

/** What follows the name of a variable that a line sets. */
const SETS = /^\s*(:[^=]*)?=(?!=)/;

/** Ask for what the fixes of some problems need to know; return whether that was anything. @param {Problem[]} problems */
export async function learnFixes(problems) {
  const asks = problems.some(({code}) => code === UNKNOWN_ATTRIBUTE);
  if (asks) await loadIdentities();
  return asks;
}

/**
 * The fixes of a problem of the shown document.
 *
 * @param {Problem} problem
 * @param {string} text at its place
 * @param {OpenDocument} document
 * @returns {Fix[]}
 */
export function fixesFor(problem, text, document) {
  if (problem.file) return []; // it is changed there
  const {line = 0, column = 1, length = 0} = problem;
  const rest = text.split("\n")[line - 1]?.slice(Math.max(0, column - 1)) ?? "";
  const name = rest.slice(0, Math.max(length, /^\w+/.exec(rest)?.[0].length ?? 0));
  return [
    ...correctionsOf(problem, document.problems),
    ...declarationsOf(problem, name, document),
    ...elementFixes(problem, document),
    ...straightened(problem, text, rest),
  ];
}

/** What writes the name that is meant: here, and wherever it is misspelt like this. @param {Problem} problem @param {Problem[]} problems @returns {Fix[]} */
function correctionsOf(problem, problems) {
  const {misspelt} = problem;
  if (!misspelt) return [];
  const {name, meant} = misspelt;
  const here = correctionAt(problem, misspelt);
  const others = problems
    .filter((each) => !each.file && each.misspelt?.name === name && each.misspelt.meant === meant)
    .map((each) => correctionAt(each, misspelt))
    .filter((each) => !isSame(each, here));
  /** @param {Correction[]} at */
  const correct = (at) => () => void apply("correctName", {name, meant, at});
  const fixes = [{name: t("Write {meant}", {meant}), apply: correct([here])}];
  const count = others.length + 1;
  if (count > 1)
    fixes.push({name: t("Write {meant} in all {count} places", {meant, count}), apply: correct([here, ...others])});
  return fixes;
}

/** @param {Problem} problem @param {Misspelt} misspelt @returns {Correction} */
function correctionAt({place, line = 0, column = 0}, {field = ""}) {
  return {place: place ?? {kind: "document"}, ...(line ? {line, column} : {field})};
}

/** @param {Correction} one @param {Correction} other */
const isSame = (one, other) =>
  keyOf(one.place) === keyOf(other.place) && one.line === other.line && one.column === other.column;

/** @param {Problem} problem @param {string} name @param {OpenDocument} document @returns {Fix[]} */
function declarationsOf({code, place}, name, {automata}) {
  if (!name) return [];
  const {automaton = 0} = place ?? {};
  if (code === UNDEFINED && automaton) {
    const before = automata.get(automaton)?.variables.trimEnd();
    const text = `${before ? `${before}\n` : ""}${name} = 0`;
    const take = () => void apply("setText", {place: {kind: "automaton", automaton, part: "variables"}, text});
    return [{name: t("Declare the variable {name}", {name}), apply: take}];
  }
  const type = code === UNKNOWN_ATTRIBUTE ? typeOf(name) : undefined;
  if (type) return [{name: t("Declare {name} ({type})", {name, type}), apply: () => void declare(name, type)}];
  const about = {automaton, name};
  const shared = {name: t("Write self.{name} in both", {name}), apply: () => void apply("shareVariable", about)};
  if (code === READ_ABOVE)
    return [{name: t("Pass {name} as an input", {name}), apply: () => void apply("passVariable", about)}, shared];
  if (code === ASSIGNED_ABOVE)
    return [{name: t("Hand {name} up as an output", {name}), apply: () => void apply("handUpVariable", about)}, shared];
  return [];
}

/** Another file for an import that fails; the default of an input or output that the variables set. @param {Problem} problem @param {OpenDocument} document @returns {Fix[]} */
function elementFixes({severity, place}, {automata}) {
  const {automaton = 0, part: list = "", index = 0} = place ?? {};
  if (severity !== "error") return [];
  const choose = async () => (await import("../data/files.js")).chooseImport(automaton);
  if (list === "import") return [{name: t("Choose the file…"), apply: () => void choose()}];
  if (list !== "inputs" && list !== "outputs") return [];
  const {[list]: {[index]: {name = ""} = {}} = [], variables = ""} = automata.get(automaton) ?? {};
  const isSet = (/** @type {string} */ line) => line.startsWith(name) && SETS.test(line.slice(name.length));
  if (!name || !variables.split("\n").some(isSet)) return [];
  const take = () => void apply("takeDefault", {automaton, list, name});
  return [{name: t("Take the default of {name} from the variables", {name}), apply: take}];
}

/** Characters of a word processor. @param {Problem} problem @param {string} text @param {string} rest @returns {Fix[]} */
function straightened({severity, message, place, line = 0}, text, rest) {
  const isCode = CODE.has(place?.part ?? "");
  const named = /'(.)' \(U\+/.exec(message)?.[1] ?? "";
  const refused = isCode ? named + rest.slice(0, 1) + (/^["']/.test(rest) ? text.split("\n")[line - 1] : "") : text;
  if (!place || severity !== "error" || !TYPOGRAPHIC.test(refused)) return [];
  const at = isCode ? place : {...place, name: place.name || "default"};
  return [
    {name: t("Write straight quotes, hyphens and spaces"), apply: () => void apply("straightenText", {place: at})},
  ];
}

/** The fixes of problems as buttons. @param {OpenDocument | null | undefined} document @param {Problem[]} problems */
export const fixButtons = (document, problems) =>
  problems
    .flatMap((each) => (document ? fixesFor(each, textAt(document, each), document) : []))
    .map((each) => html`<button type="button" class="play fix" @click=${each.apply}>${coded(each.name)}</button>`);

/** The code, or the field of an entry, that a problem is about; else empty. @param {OpenDocument} document @param {Problem} problem */
function textAt(document, {place}) {
  const {kind, automaton = 0, id, part = "", index = 0, name, child = 0} = place ?? {};
  const shown = document.automata.get(automaton);
  const state = kind === "state" ? shown?.states.find((each) => each.id === id) : undefined;
  const transition = kind === "transition" ? shown?.transitions.find((each) => each.id === id) : undefined;
  const argument = state?.arguments.find((each) => each.name === name && each.child === child);
  /** @type {Record<string, unknown>} */
  const found = {...(state ?? transition ?? (shown || document.fields)), argument: argument?.value};
  const text = found[part === "fired" ? "code" : part];
  const written = Array.isArray(text) ? text[index]?.[name || "default"] : CODE.has(part) ? text : "";
  return typeof written === "string" ? written : "";
}
