/** What the tests of the page share: where its modules are, and the surroundings that they ask for. */

import {register} from "node:module";

export const STATIC = new URL("../../visualhfsm/_editor/static/", import.meta.url);
export const PLUGINS = new URL("../../plugins/", import.meta.url);

/** Let modules of plug-ins import those of the page as they do there. */
export function knowNames() {
  const hook = `export const resolve = (name, context, next) =>
    next(name.startsWith("visualhfsm/") ? name.replace("visualhfsm/", "${STATIC.href}") : name, context);`;
  register(`data:text/javascript,${encodeURIComponent(hook)}`);
}

/** A connection whose other end is the test. */
export class Socket extends EventTarget {
  static OPEN = 1;
  static CLOSED = 3;
  /** @type {Socket[]} */
  static made = [];
  readyState = 0;
  /** @type {any[]} */
  sent = [];

  /** @param {string} url */
  constructor(url) {
    super();
    this.url = url;
    Socket.made.push(this);
  }

  /** @param {string} text */
  send(text) {
    this.sent.push(JSON.parse(text));
  }

  /** The server accepts the connection. */
  open() {
    this.readyState = Socket.OPEN;
    this.dispatchEvent(new Event("open"));
  }

  /** The page closes it. */
  close() {
    this.readyState = Socket.CLOSED;
  }

  /** The server sends a message. @param {object} message */
  push(message) {
    this.dispatchEvent(Object.assign(new Event("message"), {data: JSON.stringify(message)}));
  }

  /** The connection is lost, or the server closes it with a code. */
  lose(code = 1006) {
    this.readyState = Socket.CLOSED;
    this.dispatchEvent(Object.assign(new Event("close"), {code, reason: ""}));
  }
}

/** What joins the pages of a browser: the test is the other pages. */
export class Channel extends EventTarget {
  /** @type {Channel[]} */
  static made = [];
  /** @type {unknown[]} */
  posted = [];

  /** @param {string} name */
  constructor(name) {
    super();
    this.name = name;
    Channel.made.push(this);
  }

  /** @param {unknown} message */
  postMessage(message) {
    this.posted.push(message);
  }
}

Object.defineProperty(globalThis, "navigator", {value: {platform: "Linux x86_64", languages: ["en"]}});
/** What the browser keeps. @type {Map<string, string>} */
const kept = new Map();
const localStorage = {
  getItem: (/** @type {string} */ key) => kept.get(key) ?? null,
  setItem: (/** @type {string} */ key, /** @type {string} */ value) => kept.set(key, value),
};
for (const storage of ["localStorage", "sessionStorage"])
  Object.defineProperty(globalThis, storage, {value: localStorage, writable: true, configurable: true});
/** A page in English. */
const page = {documentElement: {lang: ""}, querySelector: () => null, getElementById: () => null};
Object.assign(globalThis, {
  document: page,
  WebSocket: Socket,
  BroadcastChannel: Channel,
  location: new URL("http://127.0.0.1:1/"),
});
