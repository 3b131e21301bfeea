import assert from "node:assert/strict";
import {beforeEach, test} from "node:test";

import {Socket, STATIC} from "./page.js";

/** An element of the drawing, known by its key and its classes. */
class Element extends EventTarget {
  attributes = new Map();
  dataset = {};
  classList = {add: () => {}, remove: () => {}, toggle: () => {}, contains: (name) => this.names.includes(name)};

  /** @param {string[]} names @param {Element} [parent] */
  constructor(names = [], parent = undefined) {
    super();
    this.names = names;
    this.parent = parent;
  }

  closest(selector) {
    const [, name] = /^\.([\w-]+)$/.exec(selector) ?? [];
    const found = name ? this.names.includes(name) : this.dataset.key;
    return found ? this : (this.parent?.closest(selector) ?? null);
  }

  setAttribute(name, value) {
    this.attributes.set(name, value);
  }

  append() {}
  remove() {}
  focus() {}
  setPointerCapture() {}
}

const frames = [];
Object.assign(globalThis, {
  Element,
  WheelEvent: {DOM_DELTA_PIXEL: 0, DOM_DELTA_LINE: 1},
  document: {...globalThis.document, createElementNS: () => new Element()},
  requestAnimationFrame: (action) => frames.push(action),
  localStorage: {getItem: () => null, setItem: () => {}},
});
globalThis.addEventListener ??= () => {};

const {Pointer, wheelSetting} = await import(new URL("canvas/pointer.js", STATIC).href);
const {Viewport} = await import(new URL("canvas/viewport.js", STATIC).href);
const {page} = await import(new URL("data/page.js", STATIC).href);
const {store} = await import(new URL("data/store.js", STATIC).href);

const STATES = [
  {id: 1, name: "one", x: 100, y: 100, children: []},
  {id: 2, name: "two", x: 400, y: 100, children: []},
];
const ARC = {id: 1, name: "go", x: 250, y: 60, origin: 1, destination: 2};

/** A canvas of 800 by 600 pixels with two states and a transition between them, and what was done with it. */
function drawn() {
  const done = [];
  const surface = new Element();
  const canvas = Object.assign(new Element(), {
    surface,
    done,
    tip: new Element(),
    sketch: new Element(),
    readOnly: false,
    tool: undefined,
    drawing: {
      places: new Map([...STATES.map((each) => [`s${each.id}`, each]), ["t1", ARC]]),
      view: () => undefined,
      preview: () => {},
    },
    order: {select: (key) => page.select({[key[0] === "s" ? "states" : "transitions"]: [Number(key.slice(1))]})},
    rename: {commit: () => {}, input: undefined},
    viewport: new Viewport(
      () => ({width: 800, height: 600}),
      () => {},
    ),
    getBoundingClientRect: () => ({left: 0, top: 0, right: 800, bottom: 600}),
    contains: () => true,
    point: ({clientX, clientY}) => canvas.viewport.toDrawing(clientX, clientY),
    stateAt: ({x, y}) => STATES.find((each) => Math.hypot(each.x - x, each.y - y) < 46),
    selectedKeys: () => [...page.states].map((id) => `s${id}`),
    markTarget: () => {},
    cancel: () => canvas.pointer.cancel(),
    redraw: () => {},
    add: async (kind, command, fields) => done.push([command, fields]),
    beginRename: (kind, id) => done.push(["rename", kind, id]),
  });
  canvas.addEventListener("hfsm-menu", ({detail}) => done.push(["menu", detail.x, detail.y]));
  canvas.pointer = new Pointer(canvas);
  return canvas;
}

/** Something of the drawing. @param {string} key @param {...string} names */
const part = (key, ...names) => new Element(names, Object.assign(new Element(), {dataset: {key}}));

/** Send an event of the pointer to the canvas. */
function send(canvas, kind, x, y, fields = {}) {
  const event = new Event(kind, {cancelable: true});
  const {target = canvas.surface, ...more} = fields;
  Object.defineProperty(event, "target", {value: target});
  Object.assign(event, {clientX: x, clientY: y, button: 0, pointerId: 1, pointerType: "mouse", ...more});
  canvas.surface.dispatchEvent(event);
  return event;
}

/** Turn a wheel, or move two fingers on a trackpad. */
function wheel(canvas, fields, at = 0) {
  const event = new Event("wheel", {cancelable: true});
  Object.defineProperty(event, "timeStamp", {value: at});
  const all = {clientX: 400, clientY: 300, deltaMode: 0, deltaX: 0, deltaY: 0, wheelDeltaX: 0, wheelDeltaY: 0};
  canvas.surface.dispatchEvent(Object.assign(event, all, fields));
  const {x, y, scale} = canvas.viewport;
  return [x, y, scale].map((value) => Math.round(value * 100) / 100);
}

const touch = (pointerId) => ({pointerId, pointerType: "touch", isPrimary: pointerId === 1});

/** Draw what was asked for with the next frames. @param {number} count */
function showFrames(count) {
  for (let index = 0; index < count; index++) for (const action of frames.splice(0)) action();
}

store.connect();
const socket = Socket.made.at(-1);
socket.open();

beforeEach(() => {
  const automaton = {id: 1, father: 0, imported: null, states: STATES, transitions: [ARC], annotations: []};
  const full = {name: "a", automata: [automaton]};
  socket.push({push: "document", tab: 1, revision: 1, undo: [], redo: [], dirty: false, full});
  page.show(1);
  page.select({});
  frames.length = 0;
});

test("a mouse's wheel zooms where the pointer is, and pans to the side with Shift", () => {
  assert.equal(wheel(drawn(), {deltaY: -100, wheelDeltaY: 120})[2], 1.18);
  assert.equal(wheel(drawn(), {deltaY: -80, wheelDeltaY: 96})[2], 1.14); // of a screen with larger letters
  assert.equal(wheel(drawn(), {deltaY: 3, deltaMode: 1, wheelDeltaY: -90})[2], 0.92); // one that counts lines
  assert.deepEqual(wheel(drawn(), {deltaY: 100, wheelDeltaY: -120, shiftKey: true}), [-100, 0, 1]);
});

test("the wheel can be set to zoom, whatever it is", (t) => {
  t.after(() => wheelSetting.toggle());
  const small = {deltaY: -13, wheelDeltaY: 39};
  assert.equal(wheel(drawn(), small)[2], 1);
  wheelSetting.toggle();
  assert.equal(wheel(drawn(), small)[2], 1.02);
});

test("two fingers on a trackpad pan, and zoom when they pinch", () => {
  const canvas = drawn();
  assert.deepEqual(wheel(canvas, {deltaX: 4, deltaY: -7, wheelDeltaX: -12, wheelDeltaY: 21}), [-4, 7, 1]);
  // A step that looks like a notch belongs to the same movement; much later it is that of a mouse.
  assert.deepEqual(wheel(canvas, {deltaY: 40, wheelDeltaY: -120}, 300), [-4, -33, 1]);
  assert.deepEqual(wheel(canvas, {deltaY: 80, wheelDeltaY: -240}, 600), [-4, -113, 1]);
  assert.equal(wheel(canvas, {deltaY: -40, wheelDeltaY: 120}, 1100)[2], 1.07);
  assert.equal(wheel(drawn(), {deltaY: -15, wheelDeltaY: 45, ctrlKey: true})[2], 1.11);
});

test("two fingers on the screen pan and zoom, and what the first one began is undone", () => {
  const canvas = drawn();
  send(canvas, "pointerdown", 300, 300, touch(1));
  send(canvas, "pointerdown", 500, 300, touch(2));
  send(canvas, "pointermove", 310, 340, touch(1));
  send(canvas, "pointermove", 710, 340, touch(2));
  const {x, y, scale} = canvas.viewport;
  assert.equal(scale, 2);
  assert.deepEqual(canvas.viewport.toDrawing(510, 340), {x: 400, y: 300});
  send(canvas, "pointerup", 710, 340, touch(2));
  send(canvas, "pointermove", 0, 0, touch(1));
  assert.deepEqual([canvas.viewport.x, canvas.viewport.y, canvas.viewport.scale], [x, y, scale]);
  send(canvas, "pointerup", 0, 0, touch(1));
  assert.equal(canvas.pointer.isBusy, false);
});

test("a finger that rests opens the menu, and one that moves does not", (t) => {
  t.mock.timers.enable({apis: ["setTimeout"]});
  const canvas = drawn();
  send(canvas, "pointerdown", 300, 300, touch(1));
  send(canvas, "pointermove", 304, 303, touch(1));
  t.mock.timers.tick(600);
  assert.deepEqual(canvas.done.splice(0), [["menu", 300, 300]]);
  assert.equal(send(canvas, "touchend", 304, 303).defaultPrevented, true);
  send(canvas, "pointerup", 304, 303, touch(1));
  send(canvas, "pointerdown", 300, 300, touch(1));
  send(canvas, "pointermove", 330, 300, touch(1));
  t.mock.timers.tick(600);
  send(canvas, "pointerup", 330, 300, touch(1));
  assert.deepEqual(canvas.done, []);
  assert.equal(send(canvas, "touchend", 330, 300).defaultPrevented, false);
});

test("what is dragged to the edge scrolls for as long as it rests there", () => {
  const canvas = drawn();
  const target = part("s1", "body");
  send(canvas, "pointerdown", 100, 100, {target});
  send(canvas, "pointermove", 400, 300, {target});
  showFrames(3);
  assert.deepEqual([canvas.viewport.x, canvas.viewport.y], [0, 0]);
  send(canvas, "pointermove", 790, 300, {target});
  showFrames(10);
  assert.ok(canvas.viewport.x < -50, `${canvas.viewport.x}`);
  assert.equal(canvas.viewport.y, 0);
  send(canvas, "pointermove", 700, 300, {target});
  const {x} = canvas.viewport;
  showFrames(3);
  assert.equal(canvas.viewport.x, x);
  canvas.cancel();
});

test("a press near the edge that hardly moves does not scroll", () => {
  const canvas = drawn();
  send(canvas, "pointerdown", 5, 300);
  send(canvas, "pointermove", 9, 300);
  showFrames(3);
  assert.equal(canvas.viewport.x, 0);
  canvas.cancel();
});

test("a transition that is dropped on empty ground makes a state there, unless it is too near", () => {
  const canvas = drawn();
  const target = part("s1", "rim");
  for (const [x, y] of [
    [250, 301],
    [160, 110],
    [400, 110],
  ]) {
    send(canvas, "pointerdown", 140, 100, {target});
    send(canvas, "pointermove", x, y, {target});
    send(canvas, "pointerup", x, y, {target});
  }
  assert.deepEqual(canvas.done, [
    ["addState", {x: 250, y: 301, origin: 1, trigger: "condition"}],
    ["addTransition", {origin: 1, destination: 2, type: "condition"}],
  ]);
});

test("a double click on a transition edits its condition, and on its name the name", (t) => {
  const canvas = drawn();
  const edited = [];
  const listening = new AbortController();
  t.after(() => listening.abort());
  page.addEventListener("edit", ({detail}) => edited.push([detail.kind, detail.id, detail.part]), listening);
  for (const name of ["knob", "detail", "line", "title"]) {
    const target = part("t1", name);
    send(canvas, "pointerdown", 250, 60, {target});
    send(canvas, "pointerup", 250, 60, {target});
    send(canvas, "dblclick", 250, 60, {target});
  }
  assert.deepEqual(edited, Array(3).fill(["transition", 1, "trigger"]));
  assert.deepEqual(canvas.done, [["rename", "transition", 1]]);
  assert.equal(socket.sent.filter(({op}) => op === "do").length, 0);
});
