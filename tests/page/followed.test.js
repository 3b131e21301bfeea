import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {Followed} = await import(new URL("run/followed.js", STATIC).href);
const {OwnRuns} = await import(new URL("run/own-runs.js", STATIC).href);

const automaton = (id, fields = {}) => ({
  id,
  state: 1,
  ghost: false,
  enteredAt: 0,
  lastTransition: 0,
  hangsFor: 0,
  ...fields,
});
const moment = (startedAt, time, fields = {}) => ({
  at: time,
  component: {startedAt, time, status: 0, speed: 0, automata: [automaton(1)], ...fields},
  robot: {joints: {HeadYaw: 0.1}, health: null, torso: null, objects: {}},
});
const live = (run) => ({structure: {name: "walk", automata: [{id: 1, states: [], transitions: []}]}, run});

/** What follows a component. */
function following() {
  const followed = new Followed();
  followed.component = "walk";
  followed.writable = true;
  return followed;
}

test("the first moment, and the first of another run, are distinguished from those that follow", () => {
  const followed = following();
  assert.deepEqual(followed.take(moment(5, 1)), {first: true, restarted: false, changed: true});
  assert.deepEqual(followed.take(moment(5, 2)), {first: false, restarted: false, changed: false});
  assert.deepEqual(followed.take(moment(5, 3, {status: 1})), {first: false, restarted: false, changed: true});
  followed.since = 3;
  assert.ok(followed.isLost && !followed.steers);
  assert.deepEqual(followed.take(moment(5, 4, {status: 1})), {first: false, restarted: false, changed: true});
  assert.ok(!followed.isLost && followed.steers);
  followed.ended = {at: 4, message: "it was stopped"};
  assert.ok(followed.isOver);
  assert.deepEqual(followed.take(moment(6, 0)), {first: false, restarted: true, changed: true});
  assert.ok(!followed.isOver);
  assert.deepEqual([followed.past.start, followed.past.end], [0, 0]); // nothing of the former run
});

test("the moments of another run may come before its automata, or after them", () => {
  const followed = following();
  followed.begin({snapshot: moment(5, 1), timeline: undefined});
  assert.ok(followed.isAhead);
  assert.ok(!followed.learn(live(1)));
  assert.ok(!followed.isAhead);
  followed.take(moment(6, 0));
  assert.ok(followed.isAhead);
  assert.ok(followed.learn(live(2)));
  assert.ok(!followed.isAhead);
  assert.ok(followed.learn(live(3))); // a slow window gets only the newest moment
  followed.take(moment(7, 0));
  assert.ok(!followed.isAhead);
});

test("while a moment of the past is shown, nothing is steered and later moments wait", () => {
  const followed = following();
  followed.take(moment(5, 1));
  followed.looking = moment(5, 0.5, {automata: [automaton(1, {state: 7})]});
  followed.take(moment(5, 2, {automata: [automaton(1, {state: 8})]}));
  assert.equal(followed.now(1).state, 7);
  assert.ok(!followed.isLive && !followed.steers);
  assert.deepEqual(followed.body.joints, {HeadYaw: 0.1});
  followed.looking = undefined;
  assert.equal(followed.now(1).state, 8);
  assert.equal(followed.body, undefined); // the robot itself is shown
});

test("of the cycles that do not end, the longest counts, as long as the component runs", () => {
  const followed = following();
  const automata = [automaton(1, {hangsFor: 1}), automaton(2, {hangsFor: 3}), automaton(3)];
  followed.take(moment(5, 1, {automata}));
  assert.equal(followed.hanging.id, 2);
  followed.ended = {at: 2, message: ""};
  assert.equal(followed.hanging, undefined);
});

test("the automata of another run are noticed", () => {
  const followed = following();
  assert.ok(!followed.learn(live(1)));
  assert.ok(!followed.learn(live(1)));
  assert.ok(followed.learn(live(2)));
  assert.equal(followed.known.automaton(1).id, 1);
});

test("a run is steered where it was started, and where the user allows it, and no other run of it is", () => {
  const starts = new OwnRuns();
  assert.ok(!starts.maySteer("walk", 5));
  starts.running.add("walk");
  assert.ok(starts.running.has("walk") && starts.maySteer("walk", 5));
  starts.running.delete("walk");
  assert.ok(starts.maySteer("walk", 5));
  assert.ok(!starts.maySteer("walk", 6));
  starts.allow("walk", 6);
  assert.ok(starts.maySteer("walk", 6) && !starts.maySteer("dance", 6));
  starts.allow("walk", undefined);
  assert.ok(!starts.maySteer("walk", 6));
  starts.running.add("walk");
  starts.running.clear();
  assert.ok(!starts.maySteer("walk", 7));
});
