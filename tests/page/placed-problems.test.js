/** The places of problems in imported files. */

import assert from "node:assert/strict";
import test from "node:test";

import {STATIC} from "./page.js";

const {errorBelow, placed, problemOf} = await import(new URL("data/problems.js", STATIC).href);

const owner = {kind: "state", automaton: 1, id: 1};
const code = (automaton) => ({kind: "state", automaton, id: 2, part: "code"});
const problem = {
  code: "W520",
  severity: "warning",
  message: "`x` is not defined",
  line: 2,
  place: code(2),
  file: "parts/look.xml",
  where: "code of look, line 2",
  copies: [code(3)],
  owners: [owner],
};

test("a problem of this document has its place only", () => {
  const own = {code: "W520", severity: "warning", message: "m", line: 1, place: code(2)};
  assert.deepEqual(placed([own]), [own]);
});

test("a problem in an imported file is in each automaton from there, and is said of the states that own them", () => {
  const found = placed([problem]);
  assert.deepEqual(
    found.map(({place, line}) => [place, line]),
    [
      [code(2), 2],
      [code(3), 2],
      [owner, 0],
    ],
  );
  assert.equal(found[0].message, problem.message);
  assert.equal(
    problemOf([problem], 1, "state", 1).message,
    `In parts/look.xml, code of look, line 2: ${problem.message}`,
  );
  assert.equal(problemOf([problem], 3, "state", 2).message, problem.message);
});

test("a file that cannot be read is said of its owner alone, with the line of the file", () => {
  const broken = {
    code: "E500",
    severity: "error",
    message: "m",
    line: 3,
    place: owner,
    file: "look.xml",
    owners: [owner],
  };
  const found = placed([broken]);
  assert.deepEqual(
    found.map(({message, line}) => [message, line]),
    [["In look.xml, line 3: m", 0]],
  );
});

test("an error is said of all states above it, one of a run first; a warning is not", () => {
  const automata = new Map(
    [
      {
        id: 1,
        father: 0,
        states: [
          {id: 1, name: "top", children: [2]},
          {id: 2, name: "idle", children: []},
        ],
      },
      {id: 2, father: 1, states: [{id: 5, name: "middle", children: [3]}]},
      {id: 3, father: 2, states: [{id: 2, name: "low", children: []}]},
    ].map((each) => [each.id, each]),
  );
  const wrong = {code: "E520", severity: "error", message: "not valid Python", line: 1, place: code(2)};
  const failed = {code: "run", severity: "error", message: "ValueError", line: 1, place: code(3)};
  const document = {automata, problems: [wrong, {...failed, severity: "warning"}]};
  const said = (shown) => [
    errorBelow(shown, 1, 1)?.message,
    errorBelow(shown, 2, 5)?.message,
    errorBelow(shown, 3, 2)?.message,
  ];
  assert.deepEqual(said(document), ["In top: not valid Python", undefined, undefined]);
  assert.deepEqual(said({automata, problems: [wrong, failed]}), [
    "In low: ValueError",
    "In low: ValueError",
    undefined,
  ]);
});
