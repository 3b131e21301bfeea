import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {Followed} = await import(new URL("run/followed.js", STATIC).href);

/** Let an automaton run for some seconds with so many cycles a second, of which a part is too long. */
function run(followed, {from = 0, seconds, cycles, overruns}) {
  for (let time = 0; time <= seconds; time += 0.1) {
    const counts = {cycles: Math.round(time * cycles), overruns: Math.round(time * overruns)};
    const automata = [{id: 1, state: 1, ghost: false, enteredAt: 0, lastTransition: 0, hangsFor: 0, ...counts}];
    followed.take({at: time, component: {startedAt: 5, time: from + time, status: 0, automata}, robot: {joints: {}}});
  }
}

function following() {
  return Object.assign(new Followed(), {component: "walk"});
}

test("an automaton whose cycles mostly take longer than its period is late", () => {
  const followed = following();
  assert.ok(!followed.isLate(1));
  run(followed, {seconds: 2, cycles: 4, overruns: 4});
  assert.ok(followed.isLate(1));
  assert.ok(!followed.isLate(2));
  assert.equal(followed.late.id, 1);
  followed.ended = {at: 2, message: "it was stopped"};
  assert.equal(followed.late, undefined);
});

test("a few long cycles make none late", () => {
  const followed = following();
  run(followed, {seconds: 0.5, cycles: 4, overruns: 4});
  assert.ok(!followed.isLate(1));
  run(followed, {from: 10, seconds: 3, cycles: 10, overruns: 2});
  assert.ok(!followed.isLate(1));
});

test("what was late some seconds ago does not count", () => {
  const followed = following();
  run(followed, {seconds: 3, cycles: 4, overruns: 4});
  run(followed, {from: 6.5, seconds: 3, cycles: 10, overruns: 0});
  assert.ok(!followed.isLate(1));
});
