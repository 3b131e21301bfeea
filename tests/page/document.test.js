import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {lostIn, outgoing, ownerOf, pathTo, rootOf, titleOf} = await import(new URL("data/outline.js", STATIC).href);
const {problemOf, problemOfAutomaton, sameProblem} = await import(new URL("data/problems.js", STATIC).href);

const automaton = (id, father, ...states) => ({
  id,
  father,
  states: states.map(([number, name, ...children]) => ({id: number, name, children})),
});
const documentOf = (...automata) => ({automata: new Map(automata.map((each) => [each.id, each]))});

const root = automaton(1, 0, [1, "walk", 2], [2, "", 3]);
const walk = automaton(2, 1, [1, "step"]);
const nameless = automaton(3, 1);
const sound = documentOf(root, walk, nameless);

test("automata are named as the states that own them, the root as the component", () => {
  assert.equal(rootOf(sound), root);
  assert.equal(ownerOf(sound, walk), root.states[0]);
  assert.equal(titleOf(sound, walk), "walk");
  assert.equal(titleOf(sound, nameless), "automaton 3");
  assert.equal(titleOf(sound, root, "dance"), "dance");
  assert.deepEqual(pathTo(sound, walk), [root, walk]);
  assert.deepEqual(lostIn(sound), []);
});

test("a document that is not sound has a root, ends every path, and shows what hangs on nothing", () => {
  const one = automaton(4, 5, [1, "a"]);
  const two = automaton(5, 4, [1, "b"]);
  const broken = documentOf(one, two);
  assert.equal(rootOf(broken), one);
  assert.deepEqual(pathTo(broken, one), [two, one]);
  assert.deepEqual(lostIn(documentOf(root, automaton(9, 1))), [automaton(9, 1)]);
});

test("transitions are tried by priority, then as in the document", () => {
  const transitions = ["", "2", "1", "x", " 1 "].map((priority, index) => ({id: index + 1, priority}));
  assert.deepEqual(
    outgoing(transitions).map(({id}) => id),
    [3, 5, 2, 1, 4],
  );
});

test("of several problems of a thing the worst is shown, the first of its kind", () => {
  const place = {kind: "state", automaton: 1, id: 2};
  const problems = [
    {severity: "note", message: "n", place},
    {severity: "warning", message: "w", place},
    {severity: "error", message: "first", place},
    {severity: "error", message: "second", place},
    {severity: "warning", message: "period", place: {kind: "automaton", automaton: 1}},
    {severity: "error", message: "nowhere"},
  ];
  assert.equal(problemOf(problems, 1, "state", 2).message, "first");
  assert.equal(problemOf(problems, 1, "transition", 2), undefined);
  assert.equal(problemOfAutomaton(problems, 1).message, "period");
  assert.ok(sameProblem(undefined, undefined));
  assert.ok(sameProblem({severity: "error", message: "m", code: 1}, {severity: "error", message: "m", code: 2}));
  assert.ok(!sameProblem({severity: "error", message: "m"}, undefined));
});
