/**
 * The tree of the automata of a document, and the order of the transitions of a state.
 *
 * @import {Automaton, State, Transition} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 */

import {t} from "../kit/texts.js";

/**
 * The automaton that no state owns, or the first of an invalid document.
 *
 * @param {OpenDocument} document
 * @returns {Automaton | undefined}
 */
export function rootOf(document) {
  for (const automaton of document.automata.values()) if (automaton.father === 0) return automaton;
  return document.automata.values().next().value;
}

/** The state that owns an automaton, or undefined. @param {OpenDocument} document @param {Automaton} automaton */
export function ownerOf(document, automaton) {
  return document.automata.get(automaton.father)?.states.find((state) => state.children.includes(automaton.id));
}

/**
 * The name of an automaton: that of the state that owns it, for the root that of the component.
 *
 * @param {OpenDocument} document @param {Automaton} automaton
 */
export function titleOf(document, automaton, component = "root") {
  if (automaton.father === 0) return component;
  return ownerOf(document, automaton)?.name || t("automaton {id}", {id: automaton.id});
}

/** The automata from the root to one. @param {OpenDocument} document @param {Automaton} automaton */
export function pathTo(document, automaton) {
  /** @type {Automaton[]} */
  const found = [];
  /** @type {Automaton | undefined} */
  let each = automaton;
  while (each && !found.includes(each)) {
    found.unshift(each);
    each = document.automata.get(each.father);
  }
  return found;
}

/** Whether any automaton of a state comes from another file. @param {OpenDocument} document @param {State} state */
export const isImporting = (document, state) =>
  state.children.some((id) => Boolean(document.automata.get(id)?.imported));

/** Automata that no state owns, in an invalid document. @param {OpenDocument} document */
export function lostIn(document) {
  const owned = new Set();
  for (const {states} of document.automata.values())
    for (const {children} of states) children.forEach((id) => owned.add(id));
  const root = rootOf(document);
  return [...document.automata.values()].filter((each) => each !== root && !owned.has(each.id));
}

/**
 * The type of a new transition out of a state: when everything below has finished, where that can be and no transition
 * waits for it yet.
 *
 * @param {OpenDocument} document @param {Automaton} automaton @param {number} origin
 * @returns {"finished" | "condition"}
 */
export function triggerFrom(document, automaton, origin) {
  const children = automaton.states.find(({id}) => id === origin)?.children ?? [];
  const end = children.length > 0 && children.every((id) => document.automata.get(id)?.states.some(({final}) => final));
  const isTaken = automaton.transitions.some(
    (each) => each.origin === origin && each.type === "finished" && !each.guard.trim(),
  );
  return end && !isTaken ? "finished" : "condition";
}

/** Transitions in the order of evaluation: by priority, then as in the document. @param {Transition[]} transitions */
export function outgoing(transitions) {
  /** @param {Transition} transition */
  const rank = ({priority}) => (/^\s*\d{1,9}\s*$/.test(priority) ? Number(priority) : Infinity);
  return transitions
    .map((transition, index) => ({transition, rank: rank(transition), index}))
    .sort((a, b) => (a.rank === b.rank ? a.index - b.index : a.rank - b.rank))
    .map((each) => each.transition);
}

/** What is written first of a transition: one that fires when all has finished has a guard alone. @param {string} type */
export const firstPart = (type) => (type === "finished" ? "guard" : "trigger");
