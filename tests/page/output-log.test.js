import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {store} = await import(new URL("store.js", STATIC).href);
const {outputLog} = await import(new URL("panels/output-log.js", STATIC).href);

const write = (tab, ...lines) => store.dispatchEvent(new CustomEvent("output", {detail: {tab, lines}}));

test("the last error of a component is read off its log, without time and place", () => {
  const place = {automaton: 1, state: 2};
  const before = "2026-11-21 13:49:57.123 ERROR    follow_ball:";
  write(
    1,
    {text: `${before} Ball: ZeroDivisionError: division by zero at ball.py:12 (ball.xml:3)`, stream: "err", place},
    {text: "2026-11-21 13:49:57.124 WARNING  follow_ball: the robot is limp", stream: "err", place},
    {text: "RuntimeError: of something else", stream: "err"},
  );
  assert.equal(outputLog.lastError(1), "Ball: ZeroDivisionError: division by zero");
  assert.equal(outputLog.lastError(1, place), "Ball: ZeroDivisionError: division by zero");
});

test("without one in the log it is the last line of a traceback", () => {
  write(2, {text: "ImportError: no module named ball", stream: "err"}, {text: "ended", stream: "err"});
  assert.equal(outputLog.lastError(2), "ImportError: no module named ball");
  assert.equal(outputLog.lastError(3), undefined);
});

test("an error elsewhere is not why a component ended", () => {
  const place = {kind: "state", automaton: 1, id: 2, part: "code"};
  write(6, {
    text: "2026-11-21 13:49:57.123 ERROR    walk: walk/go: ValueError: 1 at w.py:1 (w.xml:3)",
    stream: "err",
    place,
  });
  assert.equal(outputLog.lastError(6, {...place, id: 3}), undefined);
});

test("a library that cannot be imported is an error of the component, too", () => {
  const place = {kind: "document", part: "libraries", index: 0, name: "name"};
  write(7, {text: "walk.py: error: walk.xml:9: the library cv3 is not installed", stream: "err", place});
  assert.equal(outputLog.lastError(7, place), "the library cv3 is not installed");
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
