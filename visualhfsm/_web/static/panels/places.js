/**
 * Places in a document: of a problem, a search result or a field of a panel.
 *
 * @import {Automaton, Place, Problem} from "../protocol.js"
 * @import {OpenDocument} from "../store.js"
 */

import {ownerOf, pathTo, titleOf} from "../outline.js";

const LISTS = new Set(["parameters", "inputs", "events", "properties", "libraries", "interfaces", "ros"]);
/** @type {Record<string, string>} */
const WORDS = {
  entry: "entry code",
  code: "code",
  exit: "exit code",
  argument: "argument",
  trigger: "trigger",
  guard: "guard",
  fired: "code",
  priority: "priority",
  variables: "variables",
  functions: "functions",
  period: "period",
  import: "import",
  name: "name",
  description: "description",
  onError: "after an error",
  onRefused: "after a refused command",
  world: "world",
  language: "language",
  inputs: "input",
  parameters: "parameter",
  events: "event",
  properties: "property",
  libraries: "library",
  interfaces: "interface",
  ros: "topic",
};

/** A key that is the same for equal places. @param {Place} place */
export function keyOf({kind, automaton = 0, id = 0, part = "", index = 0, name = "", child = 0}) {
  return JSON.stringify([kind, automaton, id, part, index, name, child]);
}

/**
 * Whether two places are the same piece of text; an argument's child may be left out.
 *
 * @param {Place} one
 * @param {Place} other
 */
export function samePlace(one, other) {
  return keyOf({...one, child: 0}) === keyOf({...other, child: 0});
}

/** The place of a problem. @param {Problem} problem @returns {Place} */
export const placeOf = (problem) => problem.place ?? {kind: "document"};

/** The problems at a piece of text. @param {Place} place @param {Problem[]} problems */
export function problemsAt(problems, place) {
  return problems.filter((problem) => samePlace(placeOf(problem), place));
}

/**
 * The command that sets the text at a place; the server checks the words of the place.
 *
 * @param {Place} place
 * @param {string} text
 * @returns {any}
 */
export function commandFor(place, text) {
  const {kind, automaton, id, part = "", index, name = "", child = 0} = place;
  switch (kind) {
    case "state":
      if (part === "name") return {command: "renameState", automaton, state: id, name: text};
      if (part === "argument") return {command: "setArgument", automaton, state: id, name, child, value: text};
      return {command: "setStateCode", automaton, state: id, part, text};
    case "transition":
      if (part === "name") return {command: "renameTransition", automaton, transition: id, name: text};
      if (part === "priority") return {command: "setPriority", automaton, transition: id, priority: text};
      return {command: "setTransitionCode", automaton, transition: id, part, text};
    case "automaton":
      if (part === "period") return {command: "setPeriod", automaton, period: text};
      if (part === "inputs") return {command: "changeEntry", list: part, automaton, index, fields: {[name]: text}};
      return {command: "setAutomatonCode", automaton, part, text};
    default:
      if (LISTS.has(part)) return {command: "changeEntry", list: part, index, fields: {[name]: text}};
      return {command: "setComponentText", part, text};
  }
}

/**
 * A place in words, from the whole to the part, such as `["robot", "patrol", "wander", "exit code"]`: the automata
 * down to the one that it is in, so that copies can be distinguished.
 *
 * @param {OpenDocument} document
 * @param {Place} place
 */
export function wordsFor(document, place) {
  const {kind, automaton, id, part = "", index = 0, name = ""} = place;
  /** @type {string[]} */
  const found = [];
  const shown = automaton ? document.automata.get(automaton) : undefined;
  if (automaton)
    found.push(
      ...(shown ? pathTo(document, shown).map((each) => wordFor(document, each)) : [`automaton ${automaton}`]),
    );
  if (kind === "state") found.push(nameOf(shown?.states, id, "state"));
  if (kind === "transition") found.push(nameOf(shown?.transitions, id, "transition"));
  if (kind === "document") found.push("component");
  const lists = /** @type {Record<string, {name: string}[] | undefined>} */ (
    kind === "automaton" ? {inputs: shown?.inputs} : document.fields
  );
  if (LISTS.has(part))
    found.push(`${WORDS[part]} ${lists[part]?.[index]?.name || index + 1}`, ...(name && name !== "name" ? [name] : []));
  else if (part === "argument") found.push(`argument ${name}`);
  else if (part) found.push(WORDS[part] ?? part);
  return found;
}

/**
 * The name of an automaton, with its number if its state has several.
 *
 * @param {OpenDocument} document
 * @param {Automaton} automaton
 */
function wordFor(document, automaton) {
  const children = ownerOf(document, automaton)?.children ?? [];
  const title = titleOf(document, automaton, document.fields.name);
  return children.length > 1 ? `${title} (${children.indexOf(automaton.id) + 1})` : title;
}

/** @param {{id: number, name: string}[] | undefined} items @param {number | undefined} id @param {string} kind */
const nameOf = (items, id, kind) => items?.find((each) => each.id === id)?.name || `${kind} ${id}`;
