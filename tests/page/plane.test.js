import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {Plane, touches} = await import(new URL("canvas/plane.js", STATIC).href);

/** Numbers from 0 to 1, the same each time. */
function dice() {
  let seed = 7;
  return () => (seed = (seed * 16807) % 2147483647) / 2147483647;
}

/** @param {() => number} roll */
function boxFrom(roll) {
  const [left, top] = [roll() * 20_000 - 10_000, roll() * 20_000 - 10_000];
  const size = roll() < 0.1 ? 15_000 : 300;
  return {left, top, right: left + roll() * size, bottom: top + roll() * size};
}

test("finds just what touches a box, also after things have moved and gone", () => {
  const roll = dice();
  const plane = new Plane();
  const boxes = new Map(Array.from({length: 500}, (_, number) => [{number}, boxFrom(roll)]));
  for (const [thing, box] of boxes) plane.put(thing, box);
  for (const thing of [...boxes.keys()].slice(0, 200)) {
    boxes.set(thing, boxFrom(roll));
    plane.put(thing, boxes.get(thing));
  }
  for (const thing of [...boxes.keys()].slice(150, 250)) {
    boxes.delete(thing);
    plane.remove(thing);
  }
  for (let round = 0; round < 50; round++) {
    const sought = boxFrom(roll);
    const wanted = [...boxes].filter(([, box]) => touches(box, sought)).map(([{number}]) => number);
    const found = [...plane.within(sought)].map(({number}) => number);
    assert.deepEqual(
      found.sort((a, b) => a - b),
      wanted.sort((a, b) => a - b),
    );
  }
  const all = {left: -Infinity, top: -Infinity, right: Infinity, bottom: Infinity};
  assert.equal(plane.within(all).size, boxes.size);
  assert.equal(plane.within(all, 5).size, 5);
});

test("what moves within its cells is found at its new place alone", () => {
  const plane = new Plane();
  const thing = {};
  plane.put(thing, {left: 10, top: 10, right: 20, bottom: 20});
  plane.put(thing, {left: 100, top: 100, right: 120, bottom: 120});
  assert.equal(plane.within({left: 0, top: 0, right: 50, bottom: 50}).size, 0);
  assert.equal(plane.within({left: 110, top: 110, right: 115, bottom: 115}).size, 1);
});

test("what has no place is never found, and keeps nothing else from being found", () => {
  const plane = new Plane();
  plane.put({}, {left: NaN, top: NaN, right: NaN, bottom: NaN});
  plane.put({}, {left: 0, top: 0, right: 1, bottom: 1});
  assert.equal(plane.within({left: -1, top: -1, right: 2, bottom: 2}).size, 1);
});
