/** What the button of the panel *Trials* says and asks for. */

import assert from "node:assert/strict";
import {existsSync} from "node:fs";
import {test} from "node:test";

import {PLUGINS, knowNames} from "./page.js";

const ASKING = new URL("trials/src/visualhfsm_trials/static/asking.js", PLUGINS);
if (!existsSync(ASKING)) process.exit(); // a tree without plug-ins
knowNames();
const {duration, endings, requestOf, statePaths, verbOf} = await import(ASKING.href);

const PLAN = {file: "", runs: 100, limit: 60, robot: "sim", state: ""};

/** @param {number} done */
const trials = (done, outdated = false, plan = PLAN) => ({plan, outdated, view: {share: {trials: done}}});

/** @param {ReturnType<typeof trials>} of */
const asked = (of, draft = {}) => [verbOf(of, draft), requestOf(of, of.plan, draft)];

test("the first trials run as the plan says", () => {
  const chosen = {state: "", robot: "sim", limit: 60};
  assert.deepEqual(asked({...trials(0), view: null}), ["Run", {runs: 100, again: false, ...chosen}]);
});

test("trials that were stopped go on, and when all are done there are more", () => {
  const plan = {...PLAN, file: "walk.trials.toml"};
  assert.deepEqual(asked(trials(40, false, plan)), ["Go on", {runs: 100, again: false}]);
  assert.deepEqual(asked(trials(100, false, plan)), ["Run 100 more", {runs: 200, again: false}]);
  assert.deepEqual(asked(trials(100, false, plan), {runs: 300}), ["Go on", {runs: 300, again: false}]);
});

test("trials of an older version begin again only when the button says so", () => {
  const [verb, {again, runs}] = asked(trials(100, true));
  assert.deepEqual([verb, again, runs], ["Run from the start", true, 100]);
});

test("another goal, robot or limit makes them another series", () => {
  for (const draft of [{state: "done"}, {robot: "none"}, {limit: 5}]) {
    const [verb, request] = asked(trials(100), draft);
    assert.equal(verb, "Run from the start");
    assert.deepEqual({...request, ...draft, again: true}, request);
  }
  assert.equal(verbOf(trials(40), {limit: 60}), "Go on");
});

test("there are never more than a million", () => {
  const {runs} = requestOf(trials(1_000_000), {...PLAN, runs: 999_999}, {});
  assert.equal(runs, 1_000_000);
});

test("the time left is said in a unit that one can imagine", () => {
  assert.deepEqual([0.2, 45, 600, 9000].map(duration), ["1 s", "45 s", "10 min", "2.5 h"]);
});

test("states have paths, also in automata that contain themselves", () => {
  const automata = new Map([
    [
      1,
      {
        id: 1,
        father: 0,
        states: [
          {name: "walk", children: [2]},
          {name: "stop", children: []},
        ],
      },
    ],
    [2, {id: 2, father: 1, states: [{name: "left", children: [2]}]}],
  ]);
  const found = statePaths({automata});
  assert.deepEqual(found.slice(0, 2), ["walk", "walk/left"]);
  assert.ok(found.includes("stop"));
  assert.ok(found.length < 300);
  assert.deepEqual(statePaths(undefined), []);
});

test("states in which failed trials ended are marked, below the one above them", () => {
  const automata = new Map([
    [
      1,
      {
        id: 1,
        father: 0,
        states: [
          {id: 1, name: "look", children: [2]},
          {id: 2, name: "kick", children: []},
        ],
      },
    ],
    [2, {id: 2, father: 1, states: [{id: 1, name: "left", children: []}]}],
  ]);
  const ways = [
    {states: "look/left", count: 3},
    {states: "kick", count: 2},
    {states: "look/left, gone", count: 1},
    {states: "", count: 1},
  ];
  assert.deepEqual(
    [...endings({automata}, ways)].map(([automaton, marks]) => [automaton, [...marks]]),
    [
      [2, [["s1", {ended: 4, most: true}]]],
      [1, [["s2", {ended: 2, most: false}]]],
    ],
  );
});
