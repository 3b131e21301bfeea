import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {fitTitle, linesOf, neededHeight, occupied, titleSize, SIZE} = await import(
  new URL("measures/annotation-text.js", STATIC).href
);
const {areaOf} = await import(new URL("measures/areas.js", STATIC).href);

const note = (text, more = {}) => ({id: 1, kind: "note", x: 0, y: 0, width: 150, height: 33, color: "", text, ...more});
const FRAME = {left: 0, top: 0, right: 400, bottom: 300};

test("a note is as high as its text needs, and keeps a larger height", () => {
  const {bottom} = areaOf(note("one\ntwo\nthree"));
  assert.equal(bottom, neededHeight("one\ntwo\nthree", 150));
  assert.equal(bottom, 3 * 18 + 15);
  assert.equal(areaOf(note("one\ntwo\nthree", {height: 90})).bottom, 90);
  assert.equal(areaOf(note("one\ntwo\nthree", {kind: "frame"})).bottom, 33);
  assert.deepEqual(linesOf("one\ntwo\nthree", areaOf(note("one\ntwo\nthree"))), ["one", "two", "three"]);
});

test("a text without end is cut with a sign", () => {
  const endless = "line\n".repeat(5000);
  const lines = linesOf(endless, areaOf(note(endless)));
  assert.equal(lines.length, 200);
  assert.match(lines.at(-1), /…$/);
});

test("titles keep their size in the window where the drawing gets smaller", () => {
  assert.equal(titleSize(1), SIZE);
  assert.equal(titleSize(3), SIZE);
  for (const scale of [0.9, 0.5, 0.3, 0.1]) {
    const seen = titleSize(scale) * scale;
    assert.ok(seen > 0.9 * SIZE && seen < 1.1 * SIZE, `${seen} at ${scale}`);
  }
});

test("a title is as large as there is room, and covers nothing", () => {
  const free = fitTitle("begin", FRAME, 40);
  assert.equal(free.size, 40);
  assert.equal(free.line, "begin");
  const state = {left: 60, right: 140, top: 50, bottom: 130};
  const inTheWay = (box) => (box.bottom > state.top && box.right > state.left ? [state] : []);
  const tight = fitTitle("begin", FRAME, 40, inTheWay);
  assert.ok(tight.foot + 0.3 * tight.size < state.top);
  assert.ok(tight.size > 2 * SIZE);
  assert.equal(tight.line, "begin");
});

test("a title that is too long is shortened where smaller letters could not be read", () => {
  const {line, size} = fitTitle("what the robot does when nobody is near", FRAME, 40);
  assert.match(line, /^what the .*…$/);
  assert.ok(size > 30);
});

test("a title is never cut to nothing: it is as small as in the document then", () => {
  const wall = {left: 0, right: 400, top: 5, bottom: 300};
  assert.deepEqual(
    fitTitle("begin", FRAME, 40, () => [wall]),
    fitTitle("begin", FRAME, SIZE),
  );
});

test("no other words are on a note, nor on a title or the border of a frame", () => {
  assert.deepEqual(occupied("why", FRAME, false), [FRAME]);
  const boxes = occupied("begin", FRAME, true);
  const isTaken = ([x, y]) =>
    boxes.some(({left, right, top, bottom}) => x > left && x < right && y > top && y < bottom);
  const places = [
    [12, 14],
    [0, 150],
    [400, 150],
    [200, 0],
    [200, 300],
    [300, 14],
    [200, 150],
  ];
  assert.deepEqual(places.map(isTaken), [true, true, true, true, true, false, false]);
});
