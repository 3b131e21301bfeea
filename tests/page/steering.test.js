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
const {page} = await import(new URL("data/page.js", STATIC).href);
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
const runs = (...present) =>
  socket.push({
    push: "workspace",
    tabs: [{tab: 1, title: "walk", path: "walk.xml", component: "walk"}],
    present: present.map((component) => ({component})),
    recoverable: [],
  });
const status = (kind) =>
  socket.push({push: "started", tab: 1, component: "walk", status: kind, message: "it was stopped"});
const moment = (startedAt) => ({at: 0, component: {startedAt, time: 1, status: 0, automata: []}, robot: {joints: {}}});
const sends = (startedAt) => socket.push({push: "snapshot", component: "walk", value: moment(startedAt)});

/** Follow the component, with the run that was started then. */
async function follow(startedAt) {
  const followed = monitor.follow("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  assert.ok(await followed);
  sends(startedAt);
}

const NOTHING_YET = {component: "walk", structure: null, snapshot: null, timeline: null, since: null};

/** Start the component from this window; `meanwhile` is what happens before the answer. */
async function start(meanwhile = () => {}) {
  const started = monitor.start(1, () => store.request("start", {tab: 1}));
  await settled();
  status("generating");
  meanwhile();
  await answer(NOTHING_YET);
  await started;
}

beforeEach(async () => {
  if (!store.online) await connect();
  runs();
  status("ended");
  const unfollowed = monitor.unfollow();
  await settled();
  if (socket.sent.at(-1).op === "unfollow") await answer(null);
  await unfollowed;
  notices = [];
});

const said = () => notices.map(({textContent}) => textContent).filter((text) => text?.includes("Another run"));

test("a run that this window started is steered, and the next one of its name is only watched", async () => {
  await start();
  assert.equal(monitor.component, "walk");
  sends(10);
  assert.ok(monitor.steers);
  status("ended");
  sends(20);
  assert.ok(!monitor.writable);
  assert.equal(said().length, 1);
});

test("a run that this window starts again stays steered", async () => {
  await start();
  sends(10);
  status("ended");
  await start();
  sends(20);
  assert.ok(monitor.steers);
  assert.equal(said().length, 0);
});

test("a run is steered of whose statuses a slow window saw only the last one", async () => {
  const started = monitor.start(1, () => store.request("start", {tab: 1}));
  await settled();
  status("started");
  await answer(NOTHING_YET);
  await started;
  sends(15);
  assert.ok(monitor.steers);
});

test("a run that ended before its first moment is over when another begins to send", async () => {
  await start();
  status("ended");
  sends(10); // late
  assert.ok(monitor.ended);
  monitor.unfollow();
  await answer(null);

  await start();
  status("ended");
  await start(() => status("starting"));
  sends(20);
  assert.ok(monitor.steers && !monitor.ended);
});

test("a run that has ended before the answer is not followed, and the one before it goes on", async () => {
  await start(() => status("ended"));
  assert.equal(monitor.component, "");
  assert.deepEqual([socket.sent.at(-1).op, socket.sent.at(-1).component], ["unfollow", "walk"]);
  assert.ok(!monitor.starts.running.has("walk"));
});

test("automata that come before the answer are those of what it starts", async () => {
  const structure = {name: "walk", document: "walk.xml", generation: 1, parameters: [], automata: []};
  await start(() =>
    socket.push({push: "structure", component: "walk", value: {structure, run: 1, breakpoints: [], cameras: []}}),
  );
  assert.equal(monitor.structure.name, "walk");
});

test("nothing is followed by a start that is refused", async () => {
  const started = monitor.start(1, () => store.request("start", {tab: 1}).catch(() => undefined));
  await settled();
  socket.push({re: socket.sent.at(-1).id, error: "no", kind: "refused"});
  assert.equal(await started, undefined);
  runs("walk");
  await settled();
  assert.equal(monitor.component, "");
  assert.notEqual(socket.sent.at(-1).op, "follow");
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
  await start();
  sends(10);
  const unfollowed = monitor.unfollow();
  await answer(null);
  await unfollowed;
  await follow(10);
  assert.ok(monitor.steers);
  assert.equal(said().length, 0);
});

for (const [startedAt, steers] of [
  [10, true],
  [20, false],
])
  test(`after a lost connection ${steers ? "the same run is steered" : "another run is only watched"}`, async () => {
    await start();
    sends(10);
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
  page.show(1);
  const started = monitor.start(1, () => store.request("start", {tab: 1}).catch(() => undefined));
  await settled();
  status("generating");
  socket.lose();
  assert.equal(await started, undefined);
  await connect();
  status("started");
  runs("walk");
  await settled();
  await answer({structure: null, snapshot: null, timeline: null, since: null});
  assert.equal(monitor.component, "walk");
  sends(30);
  assert.ok(!monitor.writable);
});
