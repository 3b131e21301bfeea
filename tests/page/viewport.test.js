import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {FAR, lettersAt, VERY_FAR, Viewport} = await import(new URL("canvas/viewport.js", STATIC).href);

const made = (width = 800, height = 600) =>
  new Viewport(
    () => ({width, height}),
    () => {},
  );
const close = (one, other) => assert.ok(Math.abs(one - other) < 1e-6, `${one} is not ${other}`);

test("what lies under the pointer stays there while one zooms, within bounds", () => {
  const view = made();
  view.pan(30, -20);
  for (const factor of [1.3, 0.2, 100, 1e-9]) {
    const before = view.toDrawing(200, 150);
    view.zoom(factor, 200, 150);
    const after = view.toDrawing(200, 150);
    close(before.x, after.x);
    close(before.y, after.y);
  }
  assert.equal(view.scale, 0.02);
  view.zoom(1e9);
  assert.equal(view.scale, 4);
});

test("the window and the drawing are each other's reverse", () => {
  const view = made();
  Object.assign(view, {x: 12, y: -7, scale: 1.7});
  const {x, y} = view.toWindow(view.toDrawing(321, 123));
  close(x, 321);
  close(y, 123);
});

test("a drawing is fitted whole, in the middle, and a small one is not blown up", () => {
  const view = made();
  view.fit({left: -1000, top: 0, right: 3000, bottom: 500});
  const seen = view.seen;
  assert.ok(seen.left < -1000 && seen.right > 3000);
  close((seen.left + seen.right) / 2, 1000);
  view.fit({left: 0, top: 0, right: 10, bottom: 10});
  assert.equal(view.scale, 1.25);
  view.fit(undefined);
  assert.equal(view.scale, 1);
});

test("the longest drawing is fitted whole, and to zoom out from it does not zoom in", () => {
  const view = made();
  const box = {left: 0, top: 0, right: 400_000, bottom: 100};
  view.fit(box);
  assert.ok(view.seen.left < 0 && view.seen.right > box.right);
  const {scale} = view;
  view.zoom(0.8);
  assert.ok(view.scale <= scale);
});

test("a window that is not shown yet fits nothing", () => {
  const view = made(0, 0);
  view.fit({left: 0, top: 0, right: 10, bottom: 10});
  assert.deepEqual([view.x, view.y, view.scale], [0, 0, 1]);
});

test("a point is revealed by the least that is needed", () => {
  const view = made();
  view.reveal({x: 400, y: 300});
  assert.deepEqual([view.x, view.y], [0, 0]);
  view.reveal({x: 900, y: 10});
  assert.deepEqual([view.x, view.y], [-170, 60]);
});

test("what is to be read is shown in the middle, where it was too small", () => {
  const view = made();
  view.zoom(0.1);
  view.reveal({x: 3000, y: 10}, {legible: true});
  assert.deepEqual([view.scale, view.toWindow({x: 3000, y: 10})], [1, {x: 400, y: 300}]);
  view.zoom(0.8);
  view.reveal({x: 3000, y: 10}, {legible: true});
  close(view.scale, 0.8);
});

test("what keeps its scale where there is less room is in the middle, and smaller only if it has to be", () => {
  const box = {left: 0, top: 0, right: 700, bottom: 300};
  for (const [width, scale] of [
    [720, 1],
    [400, 328 / 700],
    [2000, 1],
  ]) {
    const view = made(width);
    view.refit(box, 1);
    close(view.scale, scale);
    close(view.toWindow({x: 350, y: 0}).x, width / 2);
  }
});

test("letters are readable at every scale at which text is drawn", () => {
  for (let scale = 4; scale >= VERY_FAR; scale *= 0.97) assert.ok(lettersAt(scale) * scale >= 10, String(scale));
  assert.equal(lettersAt(1), 10);
  assert.ok(10.5 * FAR >= 10);
});
