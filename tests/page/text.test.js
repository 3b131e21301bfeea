import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {fitCircle, shortened, width, wrapped} = await import(new URL("measures/text.js", STATIC).href);

test("widths count every character, and accents take no room", () => {
  assert.equal(width("", 12), 0);
  assert.equal(width("mm", 20), 4 * width("m", 10));
  assert.equal(width("áñ", 12), width("an", 12));
  assert.equal(width("a\u0301n\u0303", 12), width("an", 12));
  assert.equal(width("足球", 12), 24);
});

test("a text is shortened at its end, and a character never halved", () => {
  assert.equal(shortened("short", 12, 150), "short");
  assert.equal(shortened("a b c", 12, width("a …", 12)), "a…");
  assert.equal(shortened("😀😀", 10, 20 - 0.01), "…");
  assert.equal(shortened("anything", 12, 1), "…");
});

test("a text is broken at spaces, or within a word that is wider than its room", () => {
  assert.deepEqual(wrapped("one two\n  - three", 13, width("one two", 13)), ["one two", "\u00a0\u00a0- three"]);
  assert.deepEqual(wrapped("Öffnung", 10, width("Öff", 10)), ["Öff", "nu", "ng"]);
  assert.deepEqual(wrapped("😀😀", 10, 1), ["😀", "😀"]);
});

test("a name that does not fit in its circle is smaller, then shortened", () => {
  assert.deepEqual(fitCircle("walk").lines, ["walk"]);
  assert.deepEqual(fitCircle("followTheRedBall").lines, ["followThe", "RedBall"]);
  const {lines} = fitCircle(`${"w".repeat(40)} and some more words that nobody can read`, true);
  assert.equal(lines.length, 3);
  assert.match(lines[2], /…$/);
});

test("a name in larger letters, seen from far away, may stand out of its circle as far as there is room", () => {
  assert.deepEqual(fitCircle("approach", false, 25, 150), {lines: ["approach"], size: 25});
  assert.deepEqual(fitCircle("approach slowly", false, 25, 150).lines, ["approach", "slowly"]);
  assert.match(fitCircle("approach", false, 25, 100).lines[0], /^app.*…$/);
  assert.equal(fitCircle("walk", false, 10, 150).lines[0], "walk");
});

test("a name stands out of its circle no further than two lines need", () => {
  assert.deepEqual(fitCircle("kick with the left foot", false, 14.5, 168).lines, ["kick with", "the left foot"]);
  const room = width("recover balance", 14.5);
  assert.deepEqual(fitCircle("recover balance after a push", false, 14.5, room).lines, [
    "recover balance",
    "after a push",
  ]);
});

test("a name of ideographs is broken between any two", () => {
  assert.deepEqual(fitCircle("识别红色的球并靠近它").lines, ["识别红色的", "球并靠近它"]);
  assert.deepEqual(fitCircle("环顾四周寻找球 2", true).lines, ["环顾四周", "寻找球 2"]);
});
