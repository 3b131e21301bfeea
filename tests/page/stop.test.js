import assert from "node:assert/strict";
import {before, test} from "node:test";

import {Socket, STATIC} from "./page.js";

const window = new EventTarget();
Object.assign(globalThis, {window});

const {listenForStop} = await import(new URL("run/stop.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

/** @type {Socket} */
let socket;

before(async () => {
  listenForStop();
  store.connect();
  socket = Socket.made.at(-1);
  socket.open();
  socket.push({re: socket.sent[0].id, ok: {}});
  await new Promise((resolve) => setImmediate(resolve));
});

/** Press a key, or hold it; whether somebody else gets it, such as the button with the focus. */
function press(fields) {
  const event = Object.assign(new Event("keydown", {cancelable: true}), {
    code: "Space",
    ctrlKey: true,
    shiftKey: true,
    ...fields,
  });
  let passed = false;
  const hear = () => (passed = true);
  window.addEventListener("keydown", hear);
  window.dispatchEvent(event);
  window.removeEventListener("keydown", hear);
  return passed || !event.defaultPrevented;
}

const stops = () => socket.sent.filter(({op}) => op === "emergencyStop").length;

test("the key stops once, also while it is held down, and nobody else gets it", (t) => {
  t.mock.timers.enable({apis: ["setTimeout"]}); // nobody answers
  assert.ok(!press({}));
  assert.ok(!press({repeat: true}));
  assert.ok(!press({repeat: true}));
  assert.equal(stops(), 1);
  assert.ok(!press({ctrlKey: false, metaKey: true}));
  assert.equal(stops(), 2);
});

test("other keys are left to others", () => {
  const former = stops();
  for (const fields of [{code: "KeyA"}, {ctrlKey: false}, {shiftKey: false}]) assert.ok(press(fields));
  assert.equal(stops(), former);
});
