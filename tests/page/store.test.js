import assert from "node:assert/strict";
import {afterEach, beforeEach, test} from "node:test";

import {Channel, Socket, STATIC} from "./page.js";

const {store} = await import(new URL("data/store.js", STATIC).href);

const state = (id, name = `s${id}`) => ({id, name, children: []});
const transition = (id, origin, destination) => ({id, origin, destination});
const automaton = (id, father, states, transitions = []) => ({
  id,
  father,
  imported: null,
  states,
  transitions,
  annotations: [],
});

/** @type {Socket} */
let socket;
let events = [];

// Time stands still but for `pass`. (Node's own mock of timers loses one when a timer that has fired is cleared.)
/** @type {Map<number, {due: number, run: () => void}>} */
const timers = new Map();
let now = 0;
let count = 0;
globalThis.setTimeout = (run, delay) => timers.set(++count, {due: now + delay, run}) && count;
globalThis.clearTimeout = (timer) => timers.delete(timer);

function pass(milliseconds) {
  now += milliseconds;
  for (const [timer, {due, run}] of timers) {
    if (due <= now) {
      timers.delete(timer);
      run();
    }
  }
}

beforeEach(() => {
  store.documents.clear();
  events = [];
  for (const kind of ["connection", "document", "problems", "closed", "failure"]) {
    store[`on${kind}`] ??= store.addEventListener(kind, (event) => events.push([kind, event.detail])) ?? true;
  }
  store.connect();
  socket = Socket.made.at(-1);
  socket.open();
  socket.push({re: socket.sent[0].id, ok: {version: "1"}});
});

afterEach(() => {
  socket.lose();
});

/** Push a whole document, and forget what that announced. */
async function opened(...automata) {
  await settled();
  socket.push({push: "document", tab: 1, revision: 1, undo: [], redo: [], dirty: false, full: {name: "a", automata}});
  events.length = 0;
  return store.documents.get(1);
}

const settled = () => new Promise((resolve) => setImmediate(resolve));
/** Push the document after a change. */
const change = (revision, automata, fields = {name: "a"}) =>
  socket.push({
    push: "document",
    tab: 1,
    revision,
    undo: [{name: "x", revision: 0}],
    redo: [],
    dirty: true,
    full: {...fields, automata},
  });

test("a new connection greets, and is announced once the server has answered", async () => {
  assert.equal(socket.url, "ws://127.0.0.1:1/ws");
  assert.equal(socket.sent[0].op, "hello");
  await settled();
  assert.equal(store.online, true);
  assert.deepEqual(store.greeting, {version: "1"});
});

test("a request is settled by the answer with its number", async () => {
  const first = store.request("one", {x: 1});
  const second = store.request("two");
  const [a, b] = socket.sent.slice(1);
  assert.deepEqual([a.op, a.x, b.op], ["one", 1, "two"]);
  socket.push({re: b.id, ok: "second"});
  socket.push({re: a.id, error: "not so", kind: "refused"});
  assert.equal(await second, "second");
  await assert.rejects(first, {message: "not so", kind: "refused"});
});

test("a request that comes before the greeting waits for it", async () => {
  socket.lose();
  pass(250);
  socket = Socket.made.at(-1);
  socket.open();
  const early = store.request("one");
  await settled();
  assert.deepEqual(
    socket.sent.map(({op}) => op),
    ["hello"],
  );
  socket.push({re: socket.sent[0].id, ok: {version: "1"}});
  await settled();
  assert.equal(socket.sent[1].op, "one");
  socket.push({re: socket.sent[1].id, ok: "done"});
  assert.equal(await early, "done");
});

test("what is too large for a message is refused, and the connection stands", async () => {
  const before = socket.sent.length;
  await assert.rejects(store.request("openText", {text: "x".repeat(5 * 2 ** 20)}), {
    message: "This is too large for the editor: 5.0 MB, and at most 4 MB.",
    kind: "refused",
  });
  await assert.rejects(store.request("openText", {text: "球".repeat(1.5 * 2 ** 20)}), {kind: "refused"});
  assert.equal(socket.sent.length, before);
  assert.equal(store.online, true);
});

test("what waits for an answer is rejected when the connection is lost", async () => {
  const waiting = store.request("one");
  socket.lose();
  await assert.rejects(waiting, {kind: "offline"});
  await assert.rejects(store.request("two"), {kind: "offline"});
  assert.equal(store.online, false);
});

test("the page connects again, later and later, and greets again", async () => {
  await settled();
  const before = Socket.made.length;
  socket.lose();
  pass(249);
  assert.equal(Socket.made.length, before);
  pass(1);
  assert.equal(Socket.made.length, before + 1);
  Socket.made.at(-1).lose();
  pass(499);
  assert.equal(Socket.made.length, before + 1);
  pass(1);
  assert.equal(Socket.made.length, before + 2);
  socket = Socket.made.at(-1);
  socket.open();
  socket.push({re: socket.sent[0].id, ok: {version: "2"}});
  await settled();
  assert.equal(store.online, true);
  assert.deepEqual(store.greeting, {version: "2"});
});

test("the page asks no more when its address was withdrawn, until another page is let in", async () => {
  await settled();
  const before = Socket.made.length;
  socket.lose(4410);
  pass(3_600_000);
  assert.equal(Socket.made.length, before);
  assert.equal(store.refused, "notShared");
  Channel.made[0].dispatchEvent(new Event("message"));
  assert.equal(Socket.made.length, before + 1);
  socket = Socket.made.at(-1);
  socket.open();
  socket.push({re: socket.sent[0].id, ok: {version: "3"}});
  await settled();
  assert.equal(store.refused, undefined);
  assert.equal(Channel.made[0].posted.at(-1), "admitted");
});

test("the page asks no more when the server that answers again does not know it", async (context) => {
  await settled();
  const genuine = globalThis.fetch;
  context.after(() => (globalThis.fetch = genuine));
  globalThis.fetch = async () => ({status: 403});
  const before = Socket.made.length;
  socket.lose();
  await settled();
  pass(3_600_000);
  assert.equal(Socket.made.length, before);
  assert.equal(store.refused, "unknown");
});

test("a page that another one lets in connects only if it was refused", async () => {
  await settled();
  const before = Socket.made.length;
  socket.lose();
  Channel.made[0].dispatchEvent(new Event("message"));
  assert.equal(Socket.made.length, before);
});

test("what is the same after a change is the same object", async () => {
  const former = await opened(
    automaton(1, 0, [state(1), state(2)], [transition(1, 1, 2)]),
    automaton(2, 1, [state(1)]),
  );
  const [first, second] = former.automata.values();
  change(2, [
    {...automaton(1, 0, [state(1), state(2, "new"), state(3)], [transition(1, 1, 2)]), period: "50"},
    automaton(2, 1, [state(1)]),
  ]);
  const next = store.documents.get(1);
  const [one, two] = next.automata.values();
  assert.deepEqual(
    one.states.map(({name}) => name),
    ["s1", "new", "s3"],
  );
  assert.equal(one.period, "50");
  assert.equal(one.states[0], first.states[0]);
  assert.equal(one.transitions[0], first.transitions[0]);
  assert.equal(two, second);
  assert.equal(next.fields, former.fields);
  assert.deepEqual([next.revision, next.dirty, next.undo], [2, true, [{name: "x", revision: 0}]]);
  assert.deepEqual(events, [["document", {tab: 1, changed: true}]]);
});

test("items go, and stand in the order of the document", async () => {
  await opened(automaton(1, 0, [state(1), state(2), state(3)], [transition(1, 1, 2), transition(2, 2, 3)]));
  change(2, [automaton(1, 0, [state(3), state(1)], [transition(2, 2, 3)])]);
  const [only] = store.documents.get(1).automata.values();
  assert.deepEqual(
    only.states.map(({id}) => id),
    [3, 1],
  );
  assert.deepEqual(
    only.transitions.map(({id}) => id),
    [2],
  );
});

test("automata come, go, and stand in the order of the document", async () => {
  await opened(automaton(1, 0, [state(1)]), automaton(2, 1, []), automaton(3, 1, []));
  change(2, [automaton(4, 1, []), automaton(1, 0, [state(1)]), automaton(3, 1, [])]);
  assert.deepEqual([...store.documents.get(1).automata.keys()], [4, 1, 3]);
});

test("a change of the document's own fields leaves its automata", async () => {
  const former = await opened(automaton(1, 0, []));
  change(2, [automaton(1, 0, [])], {name: "a", language: "Python"});
  const next = store.documents.get(1);
  assert.deepEqual(next.fields, {name: "a", language: "Python"});
  assert.equal(next.automata.get(1), former.automata.get(1));
});

test("a document that comes again, as after an outage, has not changed", async () => {
  await opened(automaton(1, 0, [state(1)]));
  change(1, [automaton(1, 0, [state(1)])]);
  change(1, [automaton(1, 0, [state(1)])]);
  change(1, [automaton(1, 0, [state(1)])], {name: "b"});
  assert.deepEqual(
    events.map(([, {changed}]) => changed),
    [true, false, true], // unsaved; the same; of another name
  );
});

test("imported automata stand where they are imported, as long as they are", async () => {
  const imported = {file: "other.xml", automaton: 0};
  await opened(automaton(1, 0, [state(1)]), {...automaton(2, 1, []), imported});
  store.showContent(1, [
    {...automaton(2, 7, [state(9)]), imported},
    {...automaton(5, 2, [state(1)]), imported},
  ]);
  const shown = store.documents.get(1).automata;
  assert.deepEqual([shown.get(2).father, shown.get(2).states[0].id, shown.get(5).father], [1, 9, 2]);
  change(2, [automaton(1, 0, [state(1)]), {...automaton(2, 1, []), imported: null}]);
  assert.deepEqual(store.documents.get(1).automata.get(2).states, []);
});

test("problems belong to the document that they are of", async () => {
  await opened(automaton(1, 0, []));
  socket.push({push: "problems", tab: 1, revision: 1, items: [{code: "E1"}], counts: {error: 1200}});
  assert.deepEqual(store.documents.get(1).counts, {error: 1200});
  assert.deepEqual([store.documents.get(1).problems, store.documents.get(1).checked], [[{code: "E1"}], 1]);
  change(2, [automaton(1, 0, [])]);
  assert.deepEqual(store.documents.get(1).problems, [{code: "E1"}]);
});

test("a document that is closed, here or by another window, is forgotten", async () => {
  await opened(automaton(1, 0, []));
  socket.push({push: "workspace", tabs: [], recoverable: [], present: []});
  assert.equal(store.documents.size, 0);
  await opened(automaton(1, 0, []));
  socket.push({push: "closed", tab: 1});
  assert.equal(store.documents.size, 0);
});
