import assert from "node:assert/strict";
import {afterEach, beforeEach, test} from "node:test";

import {Socket, STATIC} from "./page.js";

globalThis.addEventListener ??= () => {};
globalThis.fetch = () => Promise.resolve({status: 200});

/** The notices that were shown. @type {string[]} */
const notices = [];
const element = () => {
  const children = [];
  return {
    children,
    setAttribute() {},
    addEventListener() {},
    remove() {},
    querySelectorAll: () => [],
    append(...more) {
      for (const each of more) (typeof each === "string" ? notices : children).push(each);
    },
  };
};
Object.assign(globalThis.document, {createElement: element, body: element()});
globalThis.Text ??= class {};

const {Draft, flushEdits} = await import(new URL("code/draft.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

/** @type {Socket} */
let socket;
/** @type {string[]} */
let shown = [];
/** @type {InstanceType<typeof Draft>} */
let draft;
let key = 0;

const unsent = () => [...store.unsaved.values()].filter(({typed}) => typed).map(({text}) => text);
const settled = () => new Promise((resolve) => setImmediate(resolve));
const send = (tab, text, base) => store.do(tab, {command: "setText", text}, base);
/** The document has a text: what the server pushes. */
const has = (text) => draft.take(1, `${key}`, text, send);
const asked = () => socket.sent.filter(({op}) => op === "do").map(({base, command}) => [base, command.text]);
const answer = (ok = {revision: 0}) => socket.push({re: socket.sent.at(-1).id, ok});

async function connect() {
  store.connect();
  socket = Socket.made.at(-1);
  socket.open();
  socket.push({re: socket.sent[0].id, ok: {}});
  await settled();
}

beforeEach(async () => {
  await connect();
  shown = [];
  key += 1;
  draft = new Draft((text) => shown.push(text));
  has("x");
});

afterEach(() => {
  socket.push({push: "closed", tab: 1});
  socket.lose();
});

test("what is typed is sent with the text over which it was typed", async () => {
  draft.type("xa");
  draft.flush();
  draft.type("xab");
  draft.flush();
  assert.deepEqual(asked(), [
    ["x", "xa"],
    ["xa", "xab"],
  ]);
});

test("what was sent before is awaited, too, before another command such as undo", async () => {
  draft.type("xa");
  draft.flush(); // after a pause
  let sent = false;
  const flushed = flushEdits().then(() => (sent = true));
  await settled();
  assert.equal(sent, false);
  answer();
  await flushed;
});

test("what others typed is shown once the server has merged it, and not while one types", async () => {
  draft.type("xa");
  has("xB");
  assert.equal(draft.text, "xa");
  draft.flush();
  assert.deepEqual(asked(), [["x", "xa"]]);
  has("xaB");
  answer();
  await settled();
  assert.equal(shown.at(-1), "xaB");
  draft.type("xaBc");
  draft.flush();
  assert.deepEqual(asked().at(-1), ["xaB", "xaBc"]);
});

test("what is typed offline is kept, and sent over the text that the server has", async () => {
  draft.type("xa");
  socket.lose();
  draft.flush();
  draft.type("xab");
  draft.flush();
  assert.deepEqual(unsent(), ["xab"]);
  await connect();
  assert.deepEqual(asked(), [["x", "xab"]]);
  has("xab");
  answer();
  await settled();
  assert.deepEqual(unsent(), []);
});

test("what was on its way when the connection was lost is not typed twice", async () => {
  draft.type("xa");
  draft.flush();
  draft.type("xab");
  draft.flush();
  socket.lose();
  await settled();
  has("xa"); // the first one had arrived
  draft.type("xabc");
  await connect();
  assert.deepEqual(asked(), [["xa", "xabc"]]);
  has("xabc");
  answer();
  await settled();
});

test("what was typed offline stays when another text is shown meanwhile", async () => {
  draft.type("xa");
  socket.lose();
  draft.take(1, "another", "y", send);
  assert.equal(draft.text, "y");
  has("x");
  assert.equal(draft.text, "xa");
  await connect();
  assert.deepEqual(asked(), [["x", "xa"]]);
  has("xa");
  answer();
  await settled();
});

test("a number that two change is the last one, which is said", async () => {
  const takes = (text) => draft.take(1, `period ${key}`, text, send, false);
  takes("100");
  draft.type("200");
  takes("300");
  draft.flush();
  assert.deepEqual(asked(), [[undefined, "200"]]);
  takes("200");
  answer();
  await settled();
  assert.deepEqual(notices, ["Somebody else wrote “300” where you wrote “200”. Yours is kept."]);
  draft.type("250");
  draft.flush();
  takes("250");
  answer();
  await settled();
  assert.equal(notices.length, 1);
});

test("a closed document has nothing to send", async () => {
  draft.type("xa");
  socket.push({push: "closed", tab: 1});
  await flushEdits();
  assert.deepEqual(asked(), []);
});

test("a text that may have arrived before a restart is kept with the text in which it was typed", async () => {
  draft.type("xy");
  flushEdits();
  socket.lose();
  await settled();
  draft.type("xyz");
  store.dispatchEvent(new Event("restarted"));
  delete store.do; // until the page is loaded again nothing is sent
  const [{text, base, lost, command}] = JSON.parse(sessionStorage.getItem("visualhfsm.typed"));
  assert.deepEqual(
    {text, base, lost, command},
    {text: "xyz", base: "x", lost: ["xy"], command: {command: "setText", text: "xyz"}},
  );
});

test("a field is told when the document has what stands in it", async () => {
  const busy = [];
  draft = new Draft(
    () => {},
    () => busy.push(draft.busy),
  );
  key += 1;
  has("x");
  draft.type("xy");
  draft.flush();
  await settled();
  has("xy"); // the push comes before the answer
  assert.deepEqual(busy, []);
  answer();
  await settled();
  assert.deepEqual(busy, [false]);
});
