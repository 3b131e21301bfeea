import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {fold} = await import(new URL("canvas/folding.js", STATIC).href);
const {arc, boxOf, distance, pointsOf, RADIUS} = await import(new URL("measures/geometry.js", STATIC).href);

const BESIDE = 250;
const numbers = (count) => Array.from({length: count}, (_, index) => index + 1);
const step = (id, origin, destination) => ({id, origin, destination});
/** States in a line, each with a transition to the next one. */
const chain = (count) => ({
  layout: {
    states: numbers(count).map((id) => [id, id * BESIDE, 120]),
    transitions: numbers(count - 1).map((id) => [id, (id + 0.5) * BESIDE, 120]),
    annotations: [],
  },
  arcs: numbers(count - 1).map((id) => step(id, id, id + 1)),
});
const places = ({states}) => new Map(states.map(([id, x, y]) => [id, {x, y}]));
const aspectOf = (layout) => {
  const {left, right, top, bottom} = boxOf([...places(layout).values()]);
  return (right - left + 2 * RADIUS) / (bottom - top + 2 * RADIUS);
};
/** The states that the arc of a transition passes over. */
const metBy = (layout, {id, origin, destination}) => {
  const found = places(layout);
  const [, x, y] = layout.transitions.find(([each]) => each === id);
  const points = pointsOf(arc(found.get(origin), found.get(destination), {x, y}), 5);
  return [...found].filter(
    ([state, place]) =>
      state !== origin && state !== destination && points.some((point) => distance(point, place) < RADIUS),
  );
};

test("what a screen shows is not folded", () => {
  const {layout, arcs} = chain(12);
  assert.equal(fold(layout, arcs), layout);
  const high = {states: numbers(14).map((id) => [id, 120, id * 166]), transitions: [], annotations: []};
  assert.equal(fold(high, []), high);
});

test("a long chain becomes rows on which one can follow it", () => {
  for (const count of [40, 320]) {
    const {layout, arcs} = chain(count);
    const folded = fold(layout, arcs);
    assert.ok(aspectOf(folded) < 4 && aspectOf(folded) > 0.5, `${aspectOf(folded)}`);
    const found = places(folded);
    assert.deepEqual(
      [...found.keys()].sort((a, b) => a - b),
      numbers(count),
    );
    assert.deepEqual(
      folded.transitions.map(([id]) => id).sort((a, b) => a - b),
      numbers(count - 1),
    );
    for (const each of arcs) {
      assert.ok(distance(found.get(each.origin), found.get(each.destination)) <= BESIDE + 10);
      assert.deepEqual(metBy(folded, each), []);
    }
    assert.equal(Math.min(...folded.states.map(([, x]) => x)), BESIDE);
  }
});

test("states without transitions in one column become several columns", () => {
  const layout = {states: numbers(320).map((id) => [id, 120, id * 166]), transitions: [], annotations: []};
  const folded = fold(layout, []);
  assert.ok(aspectOf(folded) < 4 && aspectOf(folded) > 0.5, `${aspectOf(folded)}`);
  assert.deepEqual(folded.states.slice(0, 3), layout.states.slice(0, 3));
});

test("an arc over several rows passes no state, and no two handles are at one place", () => {
  const {layout, arcs} = chain(60);
  const back = [step(90, 60, 1), step(91, 1, 60)];
  layout.transitions.push(...back.map(({id}) => [id, 3000, 200]));
  const folded = fold(layout, [...arcs, ...back]);
  for (const each of back) assert.deepEqual(metBy(folded, each), []);
  const knobs = folded.transitions.map(([, x, y]) => ({x, y}));
  for (const [index, one] of knobs.entries())
    for (const other of knobs.slice(index + 1)) assert.ok(distance(one, other) > 20);
});

test("a frame stays around its states, and a row is cut beside it", () => {
  const {layout, arcs} = chain(40);
  const inside = layout.states.filter(([id]) => id > 5 && id < 12);
  layout.annotations.push([1, 6 * BESIDE - 70, 30, 5 * BESIDE + 140, 160]);
  const folded = fold(layout, arcs);
  const [[, left, top, width, height]] = folded.annotations;
  const found = places(folded);
  for (const [id, {x, y}] of found) {
    const isIn = x > left && x < left + width && y > top && y < top + height;
    assert.equal(
      isIn,
      inside.some(([each]) => each === id),
      `state ${id}`,
    );
  }
  assert.ok(found.get(40).y > top + height);
});
