import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {spokenAngle, spokenPlace, valueIn} = await import(new URL("run/values.js", STATIC).href);

test("values are read as Python or JSON write them", () => {
  for (const [written, value] of /** @type {[string, unknown][]} */ ([
    ["3", 3],
    ["-0.5", -0.5],
    ["\"a 'text'\"", "a 'text'"],
    ["'it\\'s'", "it's"],
    ["True", true],
    ["None", null],
    ["[1, 2.5]", [1, 2.5]],
    ["(1, 2,)", [1, 2]],
    ["{'a': (True, None)}", {a: [true, null]}],
    ["'True, (1)'", "True, (1)"],
  ]))
    assert.deepEqual(valueIn(written), value, written);
});

test("what is no value is refused", () => {
  for (const written of ["nothing", "1 + 1", "", "'"]) assert.equal(valueIn(written), undefined, written);
});

test("joints that turn are shown in degrees, joints that slide in millimetres", () => {
  assert.equal(spokenAngle(Math.PI / 2), "90.0°");
  assert.equal(spokenPlace(-0.0125), "-12.5 mm");
});
