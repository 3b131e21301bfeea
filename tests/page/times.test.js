import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {spokenTime, toMilliseconds} = await import(new URL("kit/texts.js", STATIC).href);

test("times are typed in units of people, and shown so without losing any", () => {
  for (const [typed, milliseconds, shown] of [
    ["1.5 s", "1500", "1.5 s"],
    ["1,5s", "1500", "1.5 s"],
    ["500 ms", "500", "500 ms"],
    ["500", "500", "500 ms"],
    ["12.345 S", "12345", "12.345 s"],
    ["1234.5", "1234.5", "1234.5 ms"],
    ["2 min", "120000", "2 min"],
    ["0.1 s", "100", "100 ms"],
  ]) {
    assert.equal(toMilliseconds(typed), milliseconds, typed);
    assert.equal(spokenTime(milliseconds), shown, typed);
    assert.equal(toMilliseconds(shown), milliseconds, shown);
  }
});

test("what is no time stays as it was typed", () => {
  for (const typed of ["", "soon", "1.5 hours", "-3", "1 s 2"]) assert.equal(toMilliseconds(typed), typed);
  for (const text of ["", "soon"]) assert.equal(spokenTime(text), text);
});
