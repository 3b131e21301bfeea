import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {parameterOptions} = await import(new URL("run/parameters.js", STATIC).href);

const declared = [
  {name: "top_speed", type: "float", default: "0.3", description: ""},
  {name: "words", type: "str", default: "hello", description: ""},
  {name: "is_slow", type: "bool", default: "True", description: ""},
  {name: "fast", type: "bool", default: "False", description: ""},
];

test("what has a value becomes an option, and its dashes and spaces stay with it", () => {
  const values = {top_speed: "-0.5", words: "--go on", is_slow: "False", fast: "True"};
  assert.deepEqual(parameterOptions(declared, values), [
    "--top-speed=-0.5",
    "--words=--go on",
    "--no-is-slow",
    "--fast",
  ]);
});

test("what has no value is left to its default, and what is not declared any more is left out", () => {
  assert.deepEqual(parameterOptions(declared, {words: "", gone: "3"}), []);
});
