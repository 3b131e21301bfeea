/**
 * Places in a document: of a problem, a search result or a field of a panel.
 *
 * @import {Annotation, Automaton, Place, Problem} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 */

import {ownerOf, pathTo, titleOf} from "./outline.js";
import {placed} from "./problems.js";
import {t} from "../kit/texts.js";

const LISTS = new Set([
  ...["parameters", "inputs", "outputs", "events", "properties", "survives", "libraries", "interfaces", "ros"],
]);
/** @type {Record<string, string>} */
const WORDS = {
  entry: t("entry code"),
  code: t("code"),
  exit: t("exit code"),
  argument: t("argument"),
  result: t("result"),
  trigger: t("trigger"),
  guard: t("guard"),
  fired: t("code"),
  priority: t("priority"),
  variables: t("variables"),
  functions: t("functions"),
  period: t("period"),
  import: t("import"),
  name: t("name"),
  description: t("description"),
  onError: t("after an error"),
  onRefused: t("after a refused command"),
  world: t("world"),
  language: t("language"),
  inputs: t("input"),
  outputs: t("output"),
  parameters: t("parameter"),
  events: t("event"),
  properties: t("property"),
  survives: t("failure"),
  libraries: t("library"),
  interfaces: t("interface"),
  ros: t("topic"),
  text: t("text"),
};

/** A part of an element in words. @param {string} part */
export const wordOf = (part) => WORDS[part] ?? part;

/** A key that is the same for equal places. @param {Place} place */
export function keyOf({kind, automaton = 0, id = 0, part = "", index = 0, name = "", child = 0}) {
  return JSON.stringify([kind, automaton, id, part, index, name, child]);
}

/**
 * Whether two places are the same piece of text; an argument's child may be left out.
 *
 * @param {Place} one @param {Place} other
 */
export function samePlace(one, other) {
  return keyOf({...one, child: 0}) === keyOf({...other, child: 0});
}

/** The place of a problem. @param {Problem} problem @returns {Place} */
export const placeOf = (problem) => problem.place ?? {kind: "document"};

/** The problems at a piece of text. @param {Place} place @param {Problem[]} problems */
export function problemsAt(problems, place) {
  return placed(problems).filter((problem) => samePlace(placeOf(problem), place));
}

/** The problems of an element, in all its parts. @param {Problem[]} problems @param {Place} place */
export const problemsOf = (problems, {kind, automaton, id}) =>
  placed(problems).filter(({place: at}) => at?.kind === kind && at.automaton === automaton && at.id === id);

/**
 * The command that sets the text at a place; the server checks the words of the place.
 *
 * @param {Place} place @param {string} text
 * @returns {any}
 */
export function commandFor(place, text) {
  const {kind, automaton, id, part = "", index, name = ""} = place;
  switch (kind) {
    case "state":
      if (part === "name") return {command: "renameState", automaton, state: id, name: text};
      return {command: "setText", place, text};
    case "transition":
      if (part === "name") return {command: "renameTransition", automaton, transition: id, name: text};
      if (part === "priority") return {command: "setPriority", automaton, transition: id, priority: text};
      return {command: "setText", place, text};
    case "annotation":
      return {command: "setAnnotationText", automaton, annotation: id, text};
    case "automaton":
      if (part === "period") return {command: "setPeriod", automaton, period: text};
      if (LISTS.has(part)) return {command: "changeEntry", list: part, automaton, index, fields: {[name]: text}};
      return {command: "setText", place, text};
    default:
      if (LISTS.has(part)) return {command: "changeEntry", list: part, index, fields: {[name]: text}};
      return {command: "setComponentText", part, text};
  }
}

/**
 * A place in words, from the whole to the part, such as `["robot", "patrol", "wander", "exit code"]`: the automata
 * down to the one that it is in, so that copies can be distinguished.
 *
 * @param {OpenDocument} document @param {Place} place
 */
export function wordsFor(document, place) {
  const {kind, automaton, id, part = "", index = 0, name = ""} = place;
  /** @type {string[]} */
  const found = [];
  const shown = automaton ? document.automata.get(automaton) : undefined;
  if (automaton)
    found.push(
      ...(shown
        ? pathTo(document, shown).map((each) => wordFor(document, each))
        : [t("automaton {id}", {id: automaton})]),
    );
  if (kind === "state") found.push(nameOf(shown?.states, id) ?? t("state {id}", {id}));
  if (kind === "transition") found.push(nameOf(shown?.transitions, id) ?? t("transition {id}", {id}));
  if (kind === "annotation") found.push(firstLine(shown?.annotations.find((each) => each.id === id)));
  if (kind === "document") found.push(t("behavior"));
  const lists = /** @type {Record<string, {name: string}[] | undefined>} */ (
    kind === "automaton" ? {inputs: shown?.inputs, outputs: shown?.outputs} : document.fields
  );
  if (LISTS.has(part))
    found.push(`${WORDS[part]} ${lists[part]?.[index]?.name || index + 1}`, ...(name && name !== "name" ? [name] : []));
  else if (part === "argument") found.push(t("argument {name}", {name}));
  else if (part === "result") found.push(t("result {name}", {name}));
  else if (part) found.push(wordOf(part));
  return found;
}

/**
 * The name of an automaton, with its number if its state has several.
 *
 * @param {OpenDocument} document @param {Automaton} automaton
 */
function wordFor(document, automaton) {
  const children = ownerOf(document, automaton)?.children ?? [];
  const title = titleOf(document, automaton, document.fields.name);
  return children.length > 1 ? `${title} (${children.indexOf(automaton.id) + 1})` : title;
}

/** The first line of a note or frame. @param {Annotation | undefined} annotation */
const firstLine = (annotation) => annotation?.text.trim().split("\n")[0] || t("note");

/** @param {{id: number, name: string}[] | undefined} items @param {number | undefined} id */
const nameOf = (items, id) => items?.find((each) => each.id === id)?.name || undefined;
