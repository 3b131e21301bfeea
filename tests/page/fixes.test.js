/** What is offered to fix a problem, and what it sends. */

import assert from "node:assert/strict";
import {register} from "node:module";
import test from "node:test";

import {STATIC} from "./page.js";

globalThis.addEventListener ??= () => {};

/** Templates of which only the values are looked at. */
const LIT =
  "data:text/javascript,export const nothing = null; export const html = (_, ...values) => ({values}); export const svg = html;";
const HOOK = `export const resolve = (name, context, next) =>
  name === "lit" ? {url: ${JSON.stringify(LIT)}, shortCircuit: true} : next(name, context);`;
register(`data:text/javascript,${encodeURIComponent(HOOK)}`);
const {fixButtons} = await import(new URL("code/fixes.js", STATIC).href);

const WRITE = "Write straight quotes, hyphens and spaces";
const TAKE = "Take the default of count from the variables";
const bad = "x – “a”";
const state = {
  id: 1,
  code: "log(“a”)",
  entry: 'log("a”)',
  exit: 'log("a – b") +',
  arguments: [{name: "far", child: 0, value: bad}],
};
const automaton = {
  id: 1,
  states: [state],
  transitions: [{id: 1, trigger: bad, guard: bad, code: bad}],
  inputs: [{name: "count", default: "0"}],
  outputs: [
    {name: "found", default: "‘no’"},
    {name: "counter", default: "0"},
  ],
  variables: "count: int = 0\ncounter == 1",
};
const document = {
  automata: new Map([[1, automaton]]),
  fields: {parameters: [{name: "speed", default: "−1"}], properties: [{name: "p", expression: "in(a) –"}]},
  problems: [],
};

/** The names of the fixes of an error. @param {object} place @param {object} [problem] */
const offered = (place, problem) =>
  fixButtons(document, [{severity: "error", code: "E520", message: "", line: 1, column: 1, place, ...problem}]).map(
    ({values}) => values.at(-1).join(""),
  );

const inState = {kind: "state", automaton: 1, id: 1};
const inTransition = {kind: "transition", automaton: 1, id: 1};
const inAutomaton = {kind: "automaton", automaton: 1};

test("pasted code can be straightened wherever there is code, and values and expressions", () => {
  assert.deepEqual(offered({...inState, part: "code"}, {column: 5}), [WRITE]);
  assert.deepEqual(offered({...inState, part: "entry"}, {column: 5}), [WRITE]);
  assert.deepEqual(offered({...inState, part: "argument", name: "far"}, {column: 3}), [WRITE]);
  for (const part of ["trigger", "guard", "fired"])
    assert.deepEqual(offered({...inTransition, part}, {column: 3}), [WRITE]);
  assert.deepEqual(offered({...inAutomaton, part: "outputs"}), [WRITE]);
  assert.deepEqual(offered({kind: "document", part: "parameters", name: "default"}), [WRITE]);
  assert.deepEqual(offered({kind: "document", part: "properties", name: "expression"}), [WRITE]);
});

test("what is no mistake of a word processor is not straightened", () => {
  assert.deepEqual(offered({...inState, part: "exit"}, {column: 14}), []);
  assert.deepEqual(offered({...inState, part: "code"}, {column: 5, severity: "warning"}), []);
  assert.deepEqual(offered({...inState, part: "code"}, {column: 5, file: "other.xml"}), []);
  assert.deepEqual(offered({...inState, part: "exit"}, {column: 14, message: "invalid character '€' (U+20AC)"}), []);
});

test("Python names the character where it does not give its place", () => {
  assert.deepEqual(offered({...inState, part: "exit"}, {message: "invalid character '‘' (U+2018)"}), [WRITE]);
});

test("an input or output that the variables set takes its default from there", () => {
  assert.deepEqual(offered({...inAutomaton, part: "inputs"}), [TAKE]);
  assert.deepEqual(offered({...inAutomaton, part: "outputs", index: 1}), []);
});

test("another file can be chosen for an import that fails", () => {
  assert.deepEqual(offered({...inAutomaton, part: "import"}), ["Choose the file…"]);
  assert.deepEqual(offered({...inAutomaton, part: "import"}, {severity: "note"}), []);
});

test("a name that nothing defines is declared as a variable, unless it is in no automaton", () => {
  const problem = {severity: "warning", code: "W520", length: 3};
  assert.deepEqual(offered({...inState, part: "code"}, problem), ["Declare the variable log"]);
  assert.deepEqual(offered({kind: "document", part: "properties"}, problem), []);
});
