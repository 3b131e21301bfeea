/** What tests passed, in words and as marks. */

import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {covered, gapsIn, highlightOf, linesInWords, summary, versionOf} = await import(`${STATIC}data/covered.js`);

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
  assert.equal(covered({automata}, PASSED, []), "1 of 2 states, 1 of 3 transitions passed");
  assert.equal(
    covered({automata}, PASSED, [{passed: [1], missed: [2], failed: [4]}]),
    "1 of 2 states, 1 of 3 transitions, 1 of 3 lines passed",
  );
  const asked = {automaton: 1, kind: "transition", id: 3, count: 0, asked: 4, held: 0};
  assert.equal(covered({automata}, [...PASSED, asked], []), "1 of 2 states, 1 of 3 transitions passed");
});

test("what was not passed is listed in the order of the document, with its reason and its place", () => {
  const transition = (id, type, guard = "") => ({id, type, guard});
  const states = [{id: 1}, {id: 2}];
  const transitions = [
    transition(1, "condition"),
    transition(3, "condition"),
    transition(4, "condition"),
    transition(5, "event", "ready"),
    transition(6, "time"),
  ];
  const passed = [
    ...PASSED,
    {automaton: 1, kind: "transition", id: 3, count: 0, asked: 4, held: 0},
    {automaton: 1, kind: "transition", id: 5, count: 0, asked: 1, held: 0},
  ];
  const at = (kind, id, part) => ({kind, automaton: 1, id, part});
  const code = [
    {place: {kind: "automaton", automaton: 1, part: "functions"}, passed: [2], missed: [3], failed: []},
    {place: at("state", 1, "entry"), passed: [1, 2], missed: [], failed: []},
    {place: at("state", 1, "code"), passed: [1, 2, 3, 5, 6], missed: [4, 7], failed: []},
    {place: at("transition", 1, "trigger"), passed: [1], missed: [], failed: []},
    {place: at("transition", 1, "fired"), passed: [1], missed: [2], failed: [3]},
  ];
  const found = gapsIn({automata: new Map([[1, {id: 1, states, transitions}]])}, passed, code);
  assert.deepEqual(
    found.map(({place, line, what}) => [place.kind, place.id, place.part, line, what]),
    [
      ["automaton", undefined, "functions", 3, "1 of 2 lines passed"],
      ["state", 1, "code", 4, "7 of 9 lines passed"],
      ["state", 2, undefined, 0, "never entered"],
      ["transition", 1, "fired", 3, "2 of 4 lines passed; a test failed in its code"],
      ["transition", 3, "trigger", 1, "never fired: its condition was evaluated 4 times, and was never true"],
      ["transition", 4, "trigger", 1, "never fired: its condition was never evaluated"],
      ["transition", 5, "guard", 1, "never fired: its guard was evaluated once, and was never true"],
      ["transition", 6, undefined, 0, "never fired"],
    ],
  );
  assert.deepEqual(
    found.filter(({failed}) => failed).map(({place}) => place.part),
    ["fired"],
  );
});

test("the lines of a piece of code are said in a sentence", () => {
  assert.equal(linesInWords({passed: [1, 2], missed: [], failed: []}), "Tests passed 2 of 2 lines");
  assert.equal(
    linesInWords({passed: [1], missed: [2, 4], failed: [3]}),
    "Tests passed 1 of 4 lines, not lines 2, 4, and failed in line 3",
  );
  assert.equal(linesInWords({passed: [1], missed: [], failed: []}), "Tests passed 1 of 1 line");
  assert.equal(linesInWords({passed: [], missed: [], failed: [1]}), "Tests passed 0 of 1 line, and failed in line 1");
  const many = Array.from({length: 14}, (_, index) => index + 1);
  assert.match(linesInWords({passed: [], missed: many, failed: []}), /0 of 14 lines, not lines 1, .*, 12 and 2 more$/);
});

test("a piece of code is known again by the number that the server computes", () => {
  assert.equal(versionOf(""), 0);
  assert.equal(versionOf("123456789"), 0xcbf43926);
  assert.equal(versionOf("naïve = '→ 😀'\n"), 0x8f362096);
});

test("how tests went is said in a line", () => {
  /** @param {string[]} outcomes */
  const said = (...outcomes) => summary(outcomes.map((outcome) => ({outcome})));
  assert.equal(said(), "No tests");
  assert.equal(said(""), "1 test, not run yet");
  assert.equal(said("", ""), "2 tests, not run yet");
  assert.equal(said("passed", "failed", "skipped", "", "passed"), "2 passed, 1 failed, 1 skipped, 1 not run");
});
