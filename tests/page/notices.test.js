import assert from "node:assert/strict";
import {afterEach, test} from "node:test";

import {STATIC} from "./page.js";

/** An element that has just what notices need. */
class Element {
  children = [];
  attributes = new Map();
  listeners = new Map();
  classes = new Set();
  text = undefined;
  parent = undefined;
  hidden = false;
  classList = {
    toggle: (name, on) => (on ? this.classes.add(name) : this.classes.delete(name)),
    contains: (name) => this.classes.has(name),
    remove: (name) => this.classes.delete(name),
  };

  set className(names) {
    this.classes = new Set(names.split(" "));
  }

  set textContent(text) {
    this.text = Object.assign(new Text(), {data: text});
  }

  get firstChild() {
    return this.text ?? this.children[0];
  }

  get firstElementChild() {
    return this.children[0];
  }

  setAttribute(name, value) {
    this.attributes.set(name, value);
  }

  getAttribute(name) {
    return this.attributes.get(name) ?? null;
  }

  addEventListener(kind, listener) {
    this.listeners.set(kind, listener);
  }

  append(...added) {
    for (const each of added)
      if (typeof each === "string") this.textContent = each;
      else {
        each.parent = this;
        this.children.push(each);
      }
  }

  remove() {
    this.parent.children.splice(this.parent.children.indexOf(this), 1);
  }

  querySelectorAll(selector) {
    const [, wanted, unwanted] = /^\.(\w+)(?::not\(\.(\w+)\))?$/.exec(selector);
    return this.children.filter(({classes}) => classes.has(wanted) && !classes.has(unwanted));
  }

  click() {
    this.listeners.get("click")();
  }
}

class Text {}
const body = new Element();
Object.assign(globalThis, {
  Text,
  document: {...globalThis.document, createElement: () => new Element(), querySelector: () => null, body},
});

const {clearErrors, notify, notifyError, OFFLINE, showNoticesOf} = await import(new URL("kit/notices.js", STATIC).href);
const {RequestError} = await import(new URL("data/store.js", STATIC).href);

/** What is shown. */
const shown = () =>
  (body.children[0]?.children ?? [])
    .filter(({classes}) => !classes.has("elsewhere"))
    .map(({children: [words]}) => words.text.data);

afterEach(() => {
  for (const each of [...body.children[0].children]) each.remove();
});

test("an error goes when what was refused succeeds, and no other", () => {
  notify("no file", "error", undefined, {about: "save 1"});
  notify("no code", "error", undefined, {about: "run 1"});
  clearErrors("save 2");
  assert.deepEqual(shown(), ["no file", "no code"]);
  clearErrors("save 1");
  assert.deepEqual(shown(), ["no code"]);
});

test("an error about a document is shown beside it alone, and others everywhere", () => {
  notify("no code", "error", undefined, {tab: 1});
  notify("no robot", "error");
  showNoticesOf(2);
  assert.deepEqual(shown(), ["no robot"]);
  showNoticesOf(1);
  assert.deepEqual(shown(), ["no code", "no robot"]);
});

test("a link leads from an error to its place, and removes nothing", () => {
  let followed = 0;
  const link = {label: "line 3", run: () => (followed += 1)};
  notify("it ended", "error", link);
  body.children[0].children[0].children[1].click();
  assert.equal(followed, 1);
  assert.deepEqual(shown(), ["it ended"]);
});

test("what could not be sent goes when the page is connected, but not what may have been executed", () => {
  notifyError(new RequestError("The editor is offline.", "offline", {wasSent: false}), {about: "run 1"});
  notifyError(new RequestError("The connection was lost before the answer came.", "offline"), {about: "run 1"});
  clearErrors(OFFLINE);
  assert.deepEqual(shown(), ["The connection was lost before the answer came."]);
});
