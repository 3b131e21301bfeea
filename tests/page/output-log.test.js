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
  assert.deepEqual(outputLog.lastError(1), {text: "Ball: ZeroDivisionError: division by zero", stream: "err", place});
});

test("without one in the log it is the last line of a traceback", () => {
  write(2, {text: "ImportError: no module named ball", stream: "err"}, {text: "ended", stream: "err"});
  assert.equal(outputLog.lastError(2).text, "ImportError: no module named ball");
  assert.equal(outputLog.lastError(3), undefined);
});
