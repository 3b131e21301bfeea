/** What tests passed, in words and as marks. */

import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {covered, highlightOf, summary} = await import(`${STATIC}trials/covered.js`);

const PASSED = [
  {automaton: 1, kind: "state", id: 1, count: 3, failed: false},
  {automaton: 1, kind: "transition", id: 1, count: 2, failed: false},
  {automaton: 2, kind: "state", id: 7, count: 0, failed: true},
];

test("states and transitions of the same number are marked apart, by automaton", () => {
  const marks = highlightOf(PASSED);
  assert.deepEqual(
    [...marks].map(([automaton, found]) => [automaton, [...found.keys()]]),
    [
      [1, ["s1", "t1"]],
      [2, ["s7"]],
    ],
  );
  assert.deepEqual(marks.get(2).get("s7"), {passed: 0, failed: true});
});

test("how much was passed is that of the document as it is now", () => {
  const automata = new Map([[1, {id: 1, states: [{id: 1}, {id: 2}], transitions: [{id: 1}, {id: 3}, {id: 4}]}]]);
  assert.equal(covered({automata}, PASSED), "1 of 2 states, 1 of 3 transitions passed");
});

test("how tests went is said in a line", () => {
  /** @param {string[]} outcomes */
  const said = (...outcomes) => summary(outcomes.map((outcome) => ({outcome})));
  assert.equal(said(), "No tests");
  assert.equal(said(""), "1 test, not run yet");
  assert.equal(said("", ""), "2 tests, not run yet");
  assert.equal(said("passed", "failed", "skipped", "", "passed"), "2 passed, 1 failed, 1 skipped, 1 not run");
});
