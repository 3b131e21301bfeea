import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {partsOf} = await import(new URL("data/tab-names.js", STATIC).href);

const parts = (...titles) => {
  const tabs = titles.map((title, tab) => ({tab, title, path: `${title}.xml`}));
  return tabs.map((each) => partsOf(each, tabs));
};

test("the end of a name stays as far as it differs from names with the same beginning", () => {
  assert.deepEqual(parts("follow_ball_left", "follow_ball_right", "dance"), [
    ["follow_ball_", "left"],
    ["follow_ball_", "right"],
    ["", "dance"],
  ]);
  assert.deepEqual(parts("approach_the_ball", "approach_with_much_care"), [
    ["approach_t", "he_ball"],
    ["approach_with_mu", "ch_care"],
  ]);
});

test("a name that resembles no other keeps a few letters of its end", () => {
  assert.deepEqual(parts("dance_and_follow"), [["dance_and_f", "ollow"]]);
  assert.deepEqual(parts("walk"), [["", "walk"]]);
});

test("no letter is cut in two", () => {
  assert.deepEqual(parts("robot dances 🕺🕺🕺🕺🕺"), [["robot dances ", "🕺🕺🕺🕺🕺"]]);
});
