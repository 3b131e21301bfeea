import assert from "node:assert/strict";
import {test} from "node:test";

import {Socket, STATIC} from "./page.js";

/** @type {(() => void)[]} */
const waiting = [];
globalThis.setTimeout = (run) => waiting.push(run);
globalThis.clearTimeout = () => {};
const {store} = await import(new URL("data/store.js", STATIC).href);
const {receiveFrames} = await import(new URL("robot3d/frames.js", STATIC).href);

const later = () => waiting.splice(0).forEach((run) => run());

test("frames that are lost are asked for again, and without the server only when it is back", () => {
  store.online = true;
  const frames = receiveFrames("poses", {draw() {}, lost() {}});
  Socket.made.at(-1)?.lose();
  later();
  assert.equal(Socket.made.length, 2);
  store.online = false;
  Socket.made.at(-1)?.lose();
  later();
  store.dispatchEvent(new Event("connection"));
  assert.equal(Socket.made.length, 2);
  store.online = true;
  store.dispatchEvent(new Event("connection"));
  assert.equal(Socket.made.length, 3);
  frames.close();
});

test("text between frames is told, not drawn", () => {
  /** @type {unknown[]} */
  const got = [];
  const frames = receiveFrames("camera/Camera", {
    draw: (frame) => void got.push(frame),
    lost: (why) => void got.push(why),
    told: (text) => void got.push(["told", text]),
  });
  Socket.made.at(-1)?.push([]);
  assert.deepEqual(got, [["told", "[]"]]);
  frames.close();
});
