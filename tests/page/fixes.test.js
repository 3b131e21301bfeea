/** What is offered to fix a problem, and what it sends. What fixes it is found by the server. */

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
const {fixButtons, learnFixes} = await import(new URL("code/fixes.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

const command = {command: "addEntry", list: "libraries", fields: {name: "math"}};
const place = {kind: "state", automaton: 1, id: 1, part: "code"};
const [first, second] = [1, 2].map((line) => ({code: "W520", severity: "warning", place, line, column: 7}));
const other = {code: "W521", severity: "warning", place, line: 1, column: 1};

/** The requests that were sent. @type {[op: string, fields: object][]} */
const sent = [];
store.show(
  {
    answer: (op, fields) => {
      sent.push([op, fields]);
      const problems = [first, second].map((each) => ({...each, fixes: [0]}));
      return op === "fixes" ? {fixes: [{name: "Import math", command}], problems} : null;
    },
    frames: {},
  },
  [],
);

/** The names of the fixes of a problem. @param {object} document @param {object} problem */
const offered = (document, problem) => fixButtons(document, [problem]).map(({values}) => values.at(-1).join(""));

test("the fixes of a list of problems are asked for once, and shown when they are known", async () => {
  const document = {tab: 1, problems: [first, second, other]};
  assert.deepEqual(offered(document, first), []);
  const drawn = new Promise((resolve) => store.addEventListener("fixes", resolve, {once: true}));
  await learnFixes(document);
  await drawn;
  assert.deepEqual(sent, [["fixes", {tab: 1}]]);
  assert.deepEqual(offered(document, first), ["Import math"]);
  assert.deepEqual(offered(document, second), ["Import math"]);
  assert.deepEqual(offered(document, other), []);
  fixButtons(document, [second])[0].values[0]();
  await new Promise(setImmediate);
  assert.deepEqual(sent.at(-1), ["do", {tab: 1, command}]);
});

test("until new fixes are known, those of the same problems before stay", () => {
  const document = {tab: 1, problems: [{...first}]};
  assert.deepEqual(offered(document, document.problems[0]), ["Import math"]);
});

test("what is wrong in another file is fixed there", async () => {
  const problem = {...first, file: "other.xml"};
  const document = {tab: 2, problems: [problem]};
  await learnFixes(document);
  assert.deepEqual(offered(document, problem), []);
});

test("another file can be chosen for an import that fails", () => {
  const problem = {code: "E550", severity: "error", place: {kind: "automaton", automaton: 1, part: "import"}};
  const document = {tab: 3, problems: [problem]};
  assert.deepEqual(offered(document, problem), ["Choose the file…"]);
  assert.deepEqual(offered(document, {...problem, severity: "note"}), []);
});
