import assert from "node:assert/strict";
import {beforeEach, test} from "node:test";

import {Socket, STATIC} from "./page.js";

/** What was shown as notices. @type {{textContent?: string}[]} */
let notices = [];

/** An element that keeps its text and shows nothing. */
const element = () => ({
  children: [],
  setAttribute() {},
  addEventListener() {},
  remove() {},
  textContent: "",
  append(/** @type {object | string} */ child) {
    if (typeof child === "string") this.textContent = child;
    else notices.push(child);
  },
  querySelectorAll: () => [],
});
globalThis.setTimeout = () => 0; // nothing waits here
Object.assign(globalThis, {
  Text: class {},
  document: {...globalThis.document, createElement: element, body: {append() {}}},
});

const {monitor} = await import(new URL("run/monitor.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

const settled = () => new Promise((resolve) => setImmediate(resolve));

/** @type {Socket} */
let socket;

/** Answer the last request. */
async function answer(ok) {
  socket.push({re: socket.sent.at(-1).id, ok});
  await settled();
}

async function connect() {
  store.connect();
  socket = Socket.made.at(-1);
  socket.open();
  await answer({});
}

/** The components that run, and what the tab of `walk` is doing. */
const runs = (...running) =>
  socket.push({
    push: "workspace",
    tabs: [{tab: 1, title: "walk", path: "walk.xml", component: "walk"}],
    running: running.map((component) => ({component})),
    recoverable: [],
  });
const status = (kind) => socket.push({push: "run", tab: 1, component: "walk", status: kind, message: "it was stopped"});
const moment = (startedAt) => ({at: 0, component: {startedAt, time: 1, status: 0, automata: []}, robot: {joints: {}}});
const sends = (startedAt) => socket.push({push: "snapshot", component: "walk", value: moment(startedAt)});

/** Follow the component, with the run that was started then. */
async function follow(startedAt) {
  const attached = monitor.attach("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  assert.ok(await attached);
  sends(startedAt);
}

beforeEach(async () => {
  if (!store.online) await connect();
  runs();
  status("ended");
  const detached = monitor.detach();
  await settled();
  if (socket.sent.at(-1).op === "detach") await answer(null);
  await detached;
  notices = [];
});

const said = () => notices.map(({textContent}) => textContent).filter((text) => text?.includes("Another run"));

test("a run that this window started is steered, and the next one of its name is only watched", async () => {
  status("running");
  monitor.expect("walk");
  runs("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  assert.equal(monitor.component, "walk");
  sends(10);
  assert.ok(monitor.steers);
  status("ended");
  sends(20);
  assert.ok(!monitor.writable);
  assert.equal(said().length, 1);
});

test("a run that this window starts again stays steered", async () => {
  monitor.expect("walk");
  await follow(10);
  status("ended");
  status("running");
  monitor.expect("walk");
  sends(20);
  assert.ok(monitor.steers);
  assert.equal(said().length, 0);
});

test("a run that ended before its first moment is over when another begins to send", async () => {
  status("starting");
  monitor.expect("walk");
  runs("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  status("ended");
  sends(10); // late
  assert.ok(monitor.ended);
  monitor.detach();
  await answer(null);

  status("starting");
  monitor.expect("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  status("ended");
  status("starting");
  monitor.expect("walk");
  sends(20);
  assert.ok(monitor.steers && !monitor.ended);
});

test("steering is allowed for one run", async () => {
  await follow(10);
  assert.ok(!monitor.writable);
  monitor.allowSteering(true);
  assert.ok(monitor.steers);
  sends(10);
  assert.ok(monitor.steers);
  sends(20);
  assert.ok(!monitor.writable);
  assert.equal(said().length, 1);
});

test("the same run is steered when it is followed again", async () => {
  monitor.expect("walk");
  await follow(10);
  const detached = monitor.detach();
  await answer(null);
  await detached;
  await follow(10);
  assert.ok(monitor.steers);
  assert.equal(said().length, 0);
});

for (const [startedAt, steers] of [
  [10, true],
  [20, false],
])
  test(`after a lost connection ${steers ? "the same run is steered" : "another run is only watched"}`, async () => {
    monitor.expect("walk");
    await follow(10);
    globalThis.fetch = async () => ({status: 200});
    socket.lose();
    assert.ok(!monitor.steers);
    await connect();
    runs("walk");
    await settled();
    await answer({structure: null, snapshot: null, timeline: null, since: null});
    sends(startedAt);
    assert.equal(monitor.steers, steers);
  });

test("a run whose answer was lost with the connection is followed, and only watched", async () => {
  socket.lose();
  monitor.lookFor("walk");
  await connect();
  status("running");
  runs("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  assert.equal(monitor.component, "walk");
  sends(30);
  assert.ok(!monitor.writable);
});
