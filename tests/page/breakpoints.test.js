import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {store} = await import(new URL("data/store.js", STATIC).href);
const {Breakpoints, planned} = await import(new URL("run/breakpoints.js", STATIC).href);

/** Sets breakpoints a moment after it was asked to. */
class Monitor extends EventTarget {
  isKnown = true;
  steers = true;
  isOver = false;
  tab = 0; // none, so that nothing is kept for the next run
  breakpoints = new Breakpoints(this);
  sent = [];

  async steer(_action, {breakpoints}) {
    await new Promise((resolve) => setTimeout(resolve));
    this.sent.push(breakpoints.map(({state}) => state));
    return null;
  }
}

test("breakpoints that are set before the component answers are all kept", async () => {
  const {breakpoints, sent} = new Monitor();
  await Promise.all([breakpoints.set(0, 1, "state", 1, ""), breakpoints.set(0, 1, "state", 2, "")]);
  assert.deepEqual(sent, [[1], [1, 2]]);
  assert.deepEqual(
    breakpoints.all.map(({state}) => state),
    [1, 2],
  );
});

test("breakpoints from before a restart are added to those that are being set", async () => {
  const {breakpoints, sent} = new Monitor();
  await breakpoints.set(0, 1, "state", 1, "");
  breakpoints.keep();
  breakpoints.set(0, 1, "state", 2, "");
  await breakpoints.restore({has: () => true});
  assert.deepEqual(sent.slice(1), [[2], [2, 1]]);
});

test("a breakpoint that could not be set does not keep the next from being set", async () => {
  const monitor = new Monitor();
  const {breakpoints, sent} = monitor;
  const steer = monitor.steer.bind(monitor);
  monitor.steer = () => Promise.reject(new Error("internal"));
  const failed = breakpoints.set(0, 1, "state", 1, "");
  await assert.rejects(failed, /internal/);
  monitor.steer = steer;
  await breakpoints.set(0, 1, "state", 2, "");
  assert.deepEqual(sent, [[2]]);
});

test("what is set or removed between the start of a component and its first automata is so once they are known", async () => {
  const monitor = new Monitor();
  const {breakpoints, sent} = monitor;
  store.documents.set(0, {automata: new Map([[1, {states: [1, 2, 3].map((id) => ({id}))}]])});
  monitor.isKnown = false;
  await breakpoints.set(0, 1, "state", 1, "");
  planned.takeLate(0); // it is started with this one
  await breakpoints.set(0, 1, "state", 2, "");
  await breakpoints.set(0, 1, "state", 1, undefined); // it does not halt there any more
  monitor.isKnown = true;
  monitor.steers = false;
  breakpoints.catchUp(); // its window may not steer it yet
  monitor.steers = true;
  breakpoints.all = [{automaton: 1, state: 1, transition: 0, condition: ""}];
  breakpoints.catchUp();
  breakpoints.catchUp();
  await breakpoints.set(0, 1, "state", 4, "");
  assert.deepEqual(sent, [[1, 2], [2], [2, 4]]);
});
