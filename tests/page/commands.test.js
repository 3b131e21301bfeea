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
  push(2, [{name: "Rename", revision: 1}], true);
  page.tab = TAB;
  socket.sent.length = 0;
});

const push = (revision, undo, dirty) =>
  socket.push({push: "document", tab: TAB, revision, undo, redo: [], dirty, full: {name: "walk", automata: []}});

const HERE = {kind: "document", part: "description"};

/** Answer the last request that the page has sent. @param {object} [more] */
async function answer(more) {
  await settled();
  socket.push({re: socket.sent.at(-1).id, ok: {name: "Rename", revision: 1, added: [], place: HERE, ...more}});
  await settled();
}

test("steps are taken one after the other", async () => {
  const both = [step("undo", HERE), step("undo", HERE)];
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
  const {jump} = page;
  page.jump = () => {
    throw new Error("a panel has failed");
  };
  const failed = step("undo", {...HERE, part: "world"});
  const next = step("undo", HERE);
  await Promise.all([answer(), assert.rejects(failed, /a panel has failed/)]);
  page.jump = jump;
  assert.equal(socket.sent.length, 2);
  await answer();
  await next;
  assert.ok(canStep("undo")); // one that the document has, and none that is pending
  page.tab = 0;
  assert.ok(!canStep("undo"));
});

test("what is typed is undone before the server has it", async () => {
  push(3, [], false);
  assert.ok(!canStep("undo"));
  store.unsaved.set("code", {tab: TAB, typed: true, text: "x"});
  assert.ok(canStep("undo"));
  assert.ok(!canStep("redo"));
  const done = step("undo", HERE);
  await answer();
  await done;
  assert.deepEqual(
    socket.sent.map(({op}) => op),
    ["undo"],
  );
  store.unsaved.clear();
});

test("what was taken back alone can be redone in its place, though the document has no step to redo", async () => {
  const undone = step("undo", HERE);
  await answer({own: true});
  await undone;
  await step("redo");
  assert.equal(socket.sent.length, 1); // on the canvas there is nothing to redo
  const redone = step("redo", HERE);
  await answer({own: true});
  await redone;
  assert.deepEqual(
    socket.sent.map(({op, place}) => [op, place]),
    [
      ["undo", HERE],
      ["redo", HERE],
    ],
  );
  await step("redo", HERE);
  assert.equal(socket.sent.length, 2);
});
