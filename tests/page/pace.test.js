import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {Pace} = await import(new URL("robot3d/pace.js", STATIC).href);

const FRAMES = 8;

/** Note some frames that take equally long; returns what the last one changes. */
const draw = (pace, took, frames = FRAMES) => Array.from({length: frames}, () => pace.note(took)).at(-1);

test("a view is drawn in full while its frames are short", () => {
  const pace = new Pace();
  assert.equal(draw(pace, 12), false);
  assert.deepEqual([pace.simple, pace.wait], [false, 0]);
});

test("one long frame alone changes nothing", () => {
  const pace = new Pace();
  pace.note(500);
  assert.equal(draw(pace, 12, FRAMES - 1), false);
  assert.equal(pace.simple, false);
});

test("a view whose frames take over 30 ms is drawn simply, and leaves the page most of the time", () => {
  const pace = new Pace();
  assert.equal(draw(pace, 31), true);
  assert.equal(pace.simple, true);
  draw(pace, 24);
  assert.ok(24 / (24 + pace.wait) < 0.15 && pace.wait < 200);
  draw(pace, 300);
  assert.equal(pace.wait, 400);
});

test("a view that has become fast is drawn in full again, but not over and over", () => {
  const pace = new Pace();
  const changes = [31, 5, 31, 5, 31, 5].map((took) => draw(pace, took));
  assert.deepEqual(changes, [true, true, true, true, true, false]);
  assert.equal(pace.simple, true);
});

test("without a GPU a view is drawn simply from the first frame, and stays so", () => {
  const pace = new Pace(true);
  assert.deepEqual([pace.simple, pace.wait > 100], [true, true]);
  assert.equal(draw(pace, 2), false);
  assert.deepEqual([pace.simple, pace.wait], [true, 12]);
});
