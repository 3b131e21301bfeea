import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {store} = await import(new URL("data/store.js", STATIC).href);
const {outputLog} = await import(new URL("data/output-log.js", STATIC).href);

const write = (tab, ...lines) => store.dispatchEvent(new CustomEvent("output", {detail: {tab, lines}}));

test("the last error of a component is the last line of a traceback", () => {
  write(2, {text: "ImportError: no module named ball", stream: "err"}, {text: "ended", stream: "err"});
  assert.equal(outputLog.lastError(2), "ImportError: no module named ball");
  assert.equal(outputLog.lastError(3), undefined);
});

test("or why it could not start", () => {
  write(7, {text: "walk.py: error: the servant Head is not there: start the robot", stream: "err"});
  assert.equal(outputLog.lastError(7), "the servant Head is not there: start the robot");
});

test("what was left out is counted in words", () => {
  const push = (dropped) =>
    store.dispatchEvent(new CustomEvent("output", {detail: {tab: 4, lines: [{text: "rest", stream: "out"}], dropped}}));
  push(48213);
  push(1);
  assert.deepEqual(
    outputLog.of(4).map(({text}) => text),
    ["… 48,213 lines left out …", "rest", "… 1 line left out …", "rest"],
  );
});

test("lines and characters of a tab are bounded", () => {
  for (let index = 0; index < 6000; index++) write(5, {text: `${index}`, stream: "out"});
  assert.equal(outputLog.of(5).length, 5000);
  assert.equal(outputLog.of(5).at(-1).text, "5999");
  for (let index = 0; index < 300; index++) write(5, {text: "x".repeat(4000), stream: "out"});
  assert.equal(outputLog.of(5).length, 250);
  outputLog.clear(5);
  for (let index = 0; index < 250; index++) write(5, {text: "x".repeat(4000), stream: "out"});
  assert.equal(outputLog.of(5).length, 250);
});
