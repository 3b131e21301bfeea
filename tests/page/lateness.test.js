import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {Lateness} = await import(new URL("monitor/lateness.js", STATIC).href);

/** Let an automaton run for some seconds with so many cycles a second, of which a part is too long. */
function run(lateness, {from = 0, seconds, cycles, overruns}) {
  for (let time = 0; time <= seconds; time += 0.1)
    lateness.take({
      time: from + time,
      automata: [{id: 1, cycles: Math.round(time * cycles), overruns: Math.round(time * overruns)}],
    });
}

test("an automaton whose cycles mostly take longer than its period is late", () => {
  const lateness = new Lateness();
  assert.ok(!lateness.has(1));
  run(lateness, {seconds: 2, cycles: 4, overruns: 4});
  assert.ok(lateness.has(1));
  assert.ok(!lateness.has(2));
});

test("a few long cycles make none late", () => {
  const lateness = new Lateness();
  run(lateness, {seconds: 0.5, cycles: 4, overruns: 4});
  assert.ok(!lateness.has(1));
  run(lateness, {from: 10, seconds: 3, cycles: 10, overruns: 2});
  assert.ok(!lateness.has(1));
});

test("what was late some seconds ago does not count", () => {
  const lateness = new Lateness();
  run(lateness, {seconds: 3, cycles: 4, overruns: 4});
  run(lateness, {from: 6.5, seconds: 3, cycles: 10, overruns: 0});
  assert.ok(!lateness.has(1));
});
