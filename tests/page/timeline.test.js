import assert from "node:assert/strict";
import {beforeEach, test} from "node:test";

import {Socket, STATIC} from "./page.js";

const {FAILING, nameOf, seen, stepOf, wasActive} = await import(new URL("run/lanes.js", STATIC).href);
const {monitor} = await import(new URL("run/monitor.js", STATIC).href);
const {StateChanges} = await import(new URL("run/state-changes.js", STATIC).href);
const {scrubbing} = await import(new URL("run/scrubbing.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

const now = (id, state, fields = {}) => ({id, state, ghost: false, enteredAt: 0, lastTransition: 0, ...fields});
const span = (state, start, end, ghost = false) => ({state, ghost, start, end});
const settled = () => new Promise((resolve) => setImmediate(resolve));

/** @type {Socket} */
let socket;

beforeEach(async () => {
  store.connect();
  socket = Socket.made.at(-1);
  if (socket.readyState !== Socket.OPEN) {
    socket.open();
    socket.push({re: socket.sent[0].id, ok: {}});
    await settled();
  }
});

test("a span lasts as long as its state is the current one", () => {
  const past = new StateChanges();
  past.add({time: 1, automata: [now(1, 5)]});
  past.add({time: 2, automata: [now(1, 5)]});
  past.add({time: 3, automata: [now(1, 6, {enteredAt: 2.5, lastTransition: 9})]});
  assert.deepEqual(past.spans.get(1), [span(5, 1, 3), span(6, 3, 3)]);
  assert.deepEqual(past.changes, [{time: 2.5, automaton: 1, origin: 5, destination: 6, transition: 9}]);
  assert.deepEqual([past.start, past.end], [1, 3]);
});

test("what fails is a span until it changes, and goes on from what the server kept", () => {
  const knee = [{part: "LKneePitch", kind: "stuck", amount: 0}];
  const both = [...knee, {part: "Camera", kind: "late", amount: 0.5}];
  const past = new StateChanges({
    start: 0,
    end: 2,
    changes: [],
    spans: [],
    numbers: [],
    failures: [{faults: knee, start: 1, end: 2}],
  });
  past.add({time: 3, automata: []}, knee);
  past.add({time: 4, automata: []}, both);
  past.add({time: 5, automata: []}, []);
  past.add({time: 6, automata: []}, []);
  const shown = past.failures.map(({faults, start, end}) => [nameOf(FAILING, {faults}), start, end]);
  assert.deepEqual(shown, [
    ["LKneePitch stuck", 1, 4],
    ["LKneePitch stuck, Camera late 0.5", 4, 5],
  ]);
});

test("a state that is entered again begins another span, one that becomes a ghost changes nothing", () => {
  const past = new StateChanges();
  past.add({time: 1, automata: [now(1, 5, {enteredAt: 1})]});
  past.add({time: 2, automata: [now(1, 5, {enteredAt: 2, lastTransition: 3})]});
  past.add({time: 3, automata: [now(1, 5, {enteredAt: 2, ghost: true})]});
  assert.deepEqual(past.spans.get(1), [span(5, 1, 2), span(5, 2, 3), span(5, 3, 3, true)]);
  assert.equal(past.changes.length, 1);
});

test("what the server kept goes on with what comes, and nothing older is taken", () => {
  const past = new StateChanges({
    start: 0,
    end: 4,
    changes: [[2, 1, 5, 6, 9]],
    spans: [[1, 6, false, 2, 4]],
    numbers: ["x"],
  });
  past.add({time: 3, automata: [now(1, 7)]});
  past.add({time: 5, automata: [now(1, 6, {enteredAt: 2})]});
  assert.deepEqual(past.spans.get(1), [span(6, 2, 5)]);
  assert.deepEqual([...past.numbers], ["x"]);
  past.add({time: 6, automata: [now(1, 5, {enteredAt: 5.5})]});
  assert.deepEqual(
    past.changes.map(({time}) => time),
    [2, 5.5],
  );
  assert.equal(past.latest(1, 6)?.time, 5.5);
  assert.equal(past.latest(1, 3)?.time, 2);
  assert.equal(past.latest(2, 6), undefined);
});

test("of a long run the oldest spans and changes are forgotten, and what is now stays", () => {
  const past = new StateChanges();
  past.add({time: 0, automata: [now(3, 7)]});
  for (let time = 1; time <= 20_050; time += 1)
    past.add({time, automata: [now(1, time % 2, {enteredAt: time}), now(2, 1)]});
  const kept = past.spans.get(1).length + past.spans.get(2).length;
  assert.ok(kept <= 20_000 && kept > 15_000, `${kept} spans`);
  assert.ok(past.changes.length <= 20_000);
  assert.deepEqual(past.spans.get(2), [span(1, 1, 20_050)]);
  assert.deepEqual(past.spans.get(3), [span(7, 0, 0)]);
  assert.equal(past.spans.get(1).at(-1).end, 20_050);
});

test("only spans that are seen are drawn", () => {
  const spans = [span(1, 0, 1), span(2, 1, 2), span(3, 2, 3), span(4, 3, 4)];
  const shown = (start, end) => seen(spans, {start, end}).map(({state}) => state);
  assert.deepEqual(shown(1.5, 2.5), [2, 3]);
  assert.deepEqual(shown(-5, 9), [1, 2, 3, 4]);
  assert.deepEqual(shown(5, 9), []);
  assert.deepEqual(seen([], {start: 0, end: 1}), []);
});

test("an automaton has a lane while it was active in the shown time", () => {
  const DONE = 9;
  const spans = [span(1, 0, 100), span(2, 100, 160), span(2, 160, 400, true), span(3, 400, 500), span(DONE, 500, 900)];
  const active = (start, end) => wasActive(spans, {start, end}, (state) => state === DONE);
  assert.ok(active(0, 60), "from the beginning");
  assert.ok(active(150, 210), "for a part of the time");
  assert.ok(!active(200, 260), "suspended");
  assert.ok(active(380, 440), "again");
  assert.ok(!active(600, 660), "finished");
  assert.ok(active(0, 900), "in the whole run");
  assert.ok(!wasActive([], {start: 0, end: 60}, () => false), "never entered");
});

test("the times below the lanes are round", () => {
  assert.deepEqual(
    [0.3, 0.5, 3, 7, 45, 0].map(stepOf).map((step) => Number(step.toPrecision(3))),
    [0.5, 0.5, 5, 10, 50, 0.001],
  );
});

test("a moment of the past is asked for, the latest only, and the end of a run is what happens now", async () => {
  monitor.followed.past = new StateChanges({start: 0, end: 10, changes: [[4, 1, 1, 2, 3]], spans: [], numbers: []});
  const at = (time) => ({component: {time}});
  scrubbing.to(3);
  scrubbing.to(5);
  scrubbing.to(-2);
  assert.equal(scrubbing.time, 0);
  const [first, ...others] = socket.sent.filter(({op}) => op === "moment");
  assert.deepEqual([first.time, others], [3, []]);
  socket.push({re: first.id, ok: at(3)});
  await settled();
  const second = socket.sent.at(-1);
  assert.equal(second.time, 0);
  socket.push({re: second.id, ok: at(0)});
  await settled();
  assert.deepEqual(monitor.looking, at(0));
  scrubbing.toChange(1);
  assert.equal(socket.sent.at(-1).time, 4);
  scrubbing.to(9.9);
  assert.equal(monitor.looking, undefined);
  socket.push({re: socket.sent.at(-1).id, ok: at(4)});
  await settled();
  assert.equal(monitor.looking, undefined);
});

test("a step within what one moment lasts is a step, too", async () => {
  monitor.followed.past = new StateChanges({start: 0, end: 10, changes: [[4, 1, 1, 2, 3]], spans: [], numbers: []});
  const show = async (/** @type {number} */ time, /** @type {number} */ found) => {
    scrubbing.to(time);
    socket.push({re: socket.sent.at(-1).id, ok: {component: {time: found}}});
    await settled();
  };
  await show(2, 1.95);
  await show(scrubbing.time + 0.1, 1.95);
  assert.equal(scrubbing.time, 2.1);
  await show(4, 3.9);
  scrubbing.toChange(1);
  assert.equal(monitor.looking, undefined, "after the change at 4 there is none until the end");
});

test("the robot of the past is that of the moment that is looked at, and none while it is the present", () => {
  const robot = (yaw, torso) => ({
    joints: {HeadYaw: yaw},
    pan: null,
    tilt: null,
    health: {torsoTilt: 0.2},
    torso,
    objects: {Ball: [1, yaw, 0, 0, 0, 0, 1]},
  });
  const then = [1, 2, 0.3, 0, 0, 0, 1];
  monitor.followed.newest = {at: 9, component: {time: 9, automata: []}, robot: robot(0.9, null)};
  assert.equal(monitor.body, undefined);
  monitor.lookAt({at: 1, component: {time: 1, automata: []}, robot: robot(0.1, then)});
  assert.deepEqual(monitor.body, {
    joints: {HeadYaw: 0.1},
    tilt: 0.2,
    torso: then,
    objects: {Ball: [1, 0.1, 0, 0, 0, 0, 1]},
  });
  monitor.lookAt(undefined);
  assert.equal(monitor.body, undefined);
  monitor.followed.newest = undefined;
});

test("the robot of a dry run is that of the dry run, also now", () => {
  const robot = {joints: {HeadYaw: 0.5}, pan: 0.5, tilt: 0, health: null, torso: null, objects: {}};
  monitor.followed.newest = {at: 9, component: {time: 9, speed: 1, automata: []}, robot};
  assert.ok(monitor.isDryRun);
  assert.deepEqual(monitor.body, {joints: {HeadYaw: 0.5}, tilt: null, torso: null, objects: {}});
  monitor.followed.newest = undefined;
  assert.ok(!monitor.isDryRun);
});
