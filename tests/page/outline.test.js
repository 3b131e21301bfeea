/** The type of a new transition. */

import assert from "node:assert/strict";
import test from "node:test";

import {STATIC} from "./page.js";

const {triggerFrom} = await import(new URL("data/outline.js", STATIC).href);

/** A document whose root has a state 1 with automata; each has a final state or not. @param {boolean[]} finals */
function documentOf(finals, transitions = []) {
  const children = finals.map((_, index) => index + 2);
  const root = {
    id: 1,
    father: 0,
    states: [
      {id: 1, name: "one", children},
      {id: 2, name: "two", children: []},
    ],
    transitions,
  };
  const below = finals.map((final, index) => [index + 2, {id: index + 2, father: 1, states: [{id: 1, final}]}]);
  return {document: {automata: new Map([[1, root], ...below])}, root};
}

const trigger = (finals, transitions = []) => {
  const {document, root} = documentOf(finals, transitions);
  return triggerFrom(document, root, 1);
};

test("a transition out of a state waits for its end if everything below can end", () => {
  assert.equal(trigger([true]), "finished");
  assert.equal(trigger([true, true]), "finished");
  assert.equal(trigger([true, false]), "condition");
  assert.equal(trigger([]), "condition");
});

test("one transition that always fires at the end is enough", () => {
  const taken = {origin: 1, destination: 2, type: "finished", guard: ""};
  assert.equal(trigger([true], [taken]), "condition");
  assert.equal(trigger([true], [{...taken, guard: "n > 3"}]), "finished");
  assert.equal(trigger([true], [{...taken, origin: 2}]), "finished");
});
