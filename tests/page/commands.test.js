import assert from "node:assert/strict";
import {before, beforeEach, test} from "node:test";

import {Socket, STATIC} from "./page.js";

const {canStep, step} = await import(new URL("data/commands.js", STATIC).href);
const {page} = await import(new URL("data/page.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

const TAB = 1;
/** @type {Socket} */
let socket;

const settled = () => new Promise((resolve) => setImmediate(resolve));

before(async () => {
  store.connect();
  socket = Socket.made.at(-1);
  socket.open();
  socket.push({re: socket.sent[0].id, ok: {}});
  await settled();
});

beforeEach(() => {
  const undo = [{name: "Rename", revision: 1}];
  socket.push({
    push: "document",
    tab: TAB,
    revision: 2,
    undo,
    redo: [],
    dirty: true,
    full: {name: "walk", automata: []},
  });
  page.tab = TAB;
  socket.sent.length = 0;
});

/** Answer the last request that the page has sent. */
async function answer() {
  await settled();
  const place = {kind: "document", part: "description"};
  socket.push({re: socket.sent.at(-1).id, ok: {name: "Rename", revision: 1, added: [], place}});
  await settled();
}

test("steps are taken one after the other", async () => {
  const here = () => true;
  const both = [step("undo", here), step("undo", here)];
  await settled();
  assert.equal(socket.sent.length, 1);
  await answer();
  assert.equal(socket.sent.length, 2);
  await answer();
  await Promise.all(both);
  assert.deepEqual(
    socket.sent.map(({op}) => op),
    ["undo", "undo"],
  );
});

test("an error of a panel during a step is reported, and the next step is taken", async () => {
  const failed = step("undo", () => {
    throw new Error("a panel has failed");
  });
  const next = step("undo", () => true);
  await Promise.all([answer(), assert.rejects(failed, /a panel has failed/)]);
  assert.equal(socket.sent.length, 2);
  await answer();
  await next;
  assert.ok(canStep("undo")); // one that the document has, and none that is pending
  page.tab = 0;
  assert.ok(!canStep("undo"));
});

test("what is typed is undone before the server has it", async () => {
  socket.push({push: "document", tab: TAB, revision: 3, undo: [], redo: [], dirty: false, changed: []});
  assert.ok(!canStep("undo"));
  store.unsaved.set("code", {tab: TAB, typed: true, text: "x"});
  assert.ok(canStep("undo"));
  assert.ok(!canStep("redo"));
  const done = step("undo", () => true);
  await answer();
  await done;
  assert.deepEqual(
    socket.sent.map(({op}) => op),
    ["undo"],
  );
  store.unsaved.clear();
});
