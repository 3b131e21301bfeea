/**
 * The connection to the server and its state: open documents, problems, present components.
 *
 * The server is the truth. The page sends requests, and every change arrives as a push, before the answer to the
 * request that made it. The messages are those of visualhfsm/_editor/protocol.py.
 */

import {channelOf, socketAddress} from "../kit/location.js";
import {decimal, language, t} from "../kit/texts.js";
import {updated, withContent} from "./updates.js";
import {viewing} from "../kit/viewers.js";

/**
 * @import {Target} from "../kit/events.js"
 * @import {Answer, Answers, Automaton, Command, Fields, FieldsOf, Greeting, OutputPush} from "./protocol.js"
 * @import {OutsidePush, Problem, ProblemsPush, Push, ReadyState, Requests, RobotPush, ShelfPush} from "./protocol.js"
 * @import {SnapshotPush, StalePush, StartedPush, StructurePush, TestsPush, UndoStep, ViewPush} from "./protocol.js"
 * @import {Workspace} from "./protocol.js"
 * @typedef {{tab: number, revision: number, undo: UndoStep[], redo: UndoStep[], dirty: boolean, fields: Fields,
 *   automata: Map<number, Automaton>, own: Map<number, Automaton>, content: Automaton[], problems: Problem[],
 *   counts: ProblemsPush["counts"], checked?: number, proved?: number}} OpenDocument `automata` are its `own` with the `content` of
 *   those that are imported; `checked` is the revision that the problems, with the `counts` of all, are those of
 * @typedef {{tab: number, text: string, typed: boolean}} Unsaved a text; `typed` while it is not sent
 * @typedef {Required<Omit<RobotPush, "push">>} Robot
 * @typedef {{connection: {code?: number, reason?: string}, workspace: {former: Workspace}, request: null, restarted: null,
 *   document: {tab: number, changed: boolean}, failure: {error: Error}, closed: {tab: number},
 *   problems: ProblemsPush, fixes: {tab: number}, output: OutputPush, started: StartedPush, robot: RobotPush, shelf: ShelfPush, snapshot: SnapshotPush,
 *   structure: StructurePush, stale: StalePush, outside: OutsidePush,
 *   tests: TestsPush, view: ViewPush}} StoreEvents
 */

/** The robot of a realm without one; what a push leaves out is as here. @type {Robot} */
const NO_ROBOT = {
  status: "none",
  simulated: false,
  name: "",
  title: "",
  speed: 0,
  since: 0,
  stopped: "",
  started: "",
  simulation: {world: "balls", speed: "1", balls: false, body: ""},
  hasBalls: false,
  postures: [],
  others: [],
  serves: [],
  trouble: "",
};
/**
 * Why the server does not let this page in, so that it asks no more: the address for looking on was withdrawn, or the
 * server does not know this page.
 *
 * @typedef {"notShared" | "unknown"} Refusal
 */

/** The code with which the server closes the connections of viewers for good. */
const WITHDRAWN = 4410;
/** What differs in a document that has changed; one that comes again, as after an outage, is the same. */
const COMPARED = /** @type {const} */ (["revision", "dirty", "fields"]);
const FIRST_RETRY = 250; // ms
const LAST_RETRY = 5000;
/** Bytes of a message; a larger one would close the connection (`Limits` of visualhfsm/_editor/limits.py). */
const LARGEST = 4 * 2 ** 20;
const MERGED = 200_000; // characters; longer texts are not merged, but replaced
/** Requests that do not depend on unsent text. */
const ASIDE = new Set(["hello", "codeHelp", "fixes", "interfaces", "listFiles", "outputShown"]);

/** An answer of the server with the reason why a request failed. */
export class RequestError extends Error {
  /**
   * @param {string} message
   * @param {string} kind as docs/reference/protocol.md has them
   * @param {{wasSent?: boolean}} [more] whether the request was sent, so that the server may have executed it
   */
  constructor(message, kind, {wasSent = true} = {}) {
    super(message);
    this.kind = kind;
    this.wasSent = wasSent;
  }
}

/**
 * Events: `connection`, `workspace`, `document` {tab, changed: whether it was another one}, `problems` {tab},
 * `fixes` {tab} when what fixes these is known, `request` before one that others may have to precede, and one of the name of each further push (`output`, `started`,
 * `robot`, `shelf`, `snapshot`, `structure`, `stale`, `outside`, `tests`, `view`, `closed`).
 */
class Store extends /** @type {new () => Target<StoreEvents>} */ (EventTarget) {
  /** @type {Map<number, OpenDocument>} */
  documents = new Map();
  /** @type {Workspace} */
  workspace = {tabs: [], recoverable: [], present: []};
  robot = NO_ROBOT;
  /** What views of plug-ins do for the document of each tab, by the names of the views. @type {Map<number, Map<string, ViewPush>>} */
  views = new Map();
  /** The tests of each tab, as far as any were asked for. @type {Map<number, TestsPush>} */
  tests = new Map();
  /** What can be drawn as ready states. @type {ReadyState[]} */
  shelf = [];
  online = false;
  /** When the connection was lost, ms since 1970; 0 while connected. */
  offlineSince = 0;
  /** Why this page does not try to connect again, if so. @type {Refusal | undefined} */
  refused = undefined;
  /** Whether the server was restarted, so that the page is reloaded: the tabs are different. */
  restarted = false;
  /** Typed texts that the server does not have yet, by their keys. @type {Map<string, Unsaved>} */
  unsaved = new Map();
  /** The answer of the server to `hello`. @type {Partial<Greeting>} */
  greeting = {};
  /**
   * The stand-in for the server in an exported page: it answers requests, and has frames by path.
   *
   * @type {{answer: (op: string, fields: any) => any, frames: Record<string, ArrayBuffer>} | undefined}
   */
  exported = undefined;

  /** Whether a document is not changed: that of a recording, or any for viewers. @param {number} tab */
  isRecorded = (tab) => viewing.on || this.workspace.tabs.some((each) => each.tab === tab && each.recording);

  /** @type {WebSocket | undefined} */
  #socket = undefined;
  #number = 0;
  /** @type {Map<number, {resolve(value: unknown): void, reject(error: RequestError): void}>} */
  #waiting = new Map();
  #retry = FIRST_RETRY;
  #timer = 0;
  /** Settled with what can readmit this page. @type {Promise<import("./resumption.js").Resumption | undefined> | undefined} */
  #resumption = undefined;
  /** @type {ReturnType<typeof channelOf> | undefined} */
  #admission = undefined;
  /** Settled when the server has greeted, or will not. */
  #greeted = Promise.resolve();

  /** Connect, and again whenever the connection is lost. */
  connect() {
    clearTimeout(this.#timer);
    // One at a time, or everything would be reported twice.
    if (this.#socket && this.#socket.readyState !== WebSocket.CLOSED) return;
    this.#listenForAdmission();
    const socket = new WebSocket(socketAddress("ws"));
    this.#socket = socket;
    socket.addEventListener("open", () => (this.#greeted = this.#greet()));
    socket.addEventListener("message", (event) => this.#receive(JSON.parse(event.data)));
    socket.addEventListener("close", (event) => this.#lose(event));
  }

  /**
   * Show what an exported page contains, instead of connecting.
   *
   * @param {NonNullable<Store["exported"]>} exported @param {Push[]} pushes
   */
  show(exported, pushes) {
    this.exported = exported;
    this.online = true;
    for (const push of pushes) this.#receive(push);
  }

  /** The text for users while there is no connection. */
  get whyOffline() {
    if (this.refused === "notShared")
      return t("The owner has withdrawn this address. To look on again, ask the owner for a new one.");
    if (viewing.on && this.refused)
      return t(
        "This address is not valid any more: the owner has withdrawn it, or has started the editor again. To look on again, ask the owner for a new one.",
      );
    if (this.greeting.key === "")
      return t(
        "The editor is offline; your work is kept there. This page connects again by itself when the editor runs again. If that takes long, load it again: you may have to log in, or to start your server.",
      );
    if (this.refused)
      return t(
        "The editor was restarted: open the address that it printed in its terminal. Then this page connects again, too.",
      );
    return location.pathname === "/"
      ? t(
          "The editor is offline; your work is kept there. This page connects again by itself when it runs on port {port}.",
          {port: location.port},
        )
      : t("The editor is offline; your work is kept there. This page connects again by itself when it runs again.");
  }

  /**
   * Send a request to the server.
   *
   * @template {keyof Requests} Op
   * @param {Op} op @param {FieldsOf<Requests[Op]>} fields
   * @returns {Promise<Answers[Op]>} its value; rejected with a RequestError
   */
  request(op, ...[fields]) {
    if (!ASIDE.has(op)) this.dispatchEvent(new Event("request"));
    // Before the greeting, the server's tabs may differ from those that the page shows.
    const isGreeting = op !== "hello" && !this.online && this.#socket?.readyState === WebSocket.OPEN;
    return isGreeting ? this.#greeted.then(() => this.#send(op, fields)) : this.#send(op, fields);
  }

  /**
   * @template {keyof Requests} Op
   * @param {Op} op @param {Requests[Op]} [fields]
   * @returns {Promise<Answers[Op]>}
   */
  #send(op, fields) {
    const {exported} = this;
    if (exported) return Promise.resolve().then(() => exported.answer(op, fields));
    return new Promise((resolve, reject) => {
      if (this.#socket?.readyState !== WebSocket.OPEN || (!this.online && op !== "hello")) {
        reject(new RequestError(this.whyOffline, "offline", {wasSent: false}));
        return;
      }
      const id = ++this.#number;
      const message = JSON.stringify({id, op, ...fields});
      const size = message.length > LARGEST / 3 ? new TextEncoder().encode(message).length : 0;
      if (size > LARGEST) {
        const megabytes = decimal(size / 2 ** 20, 1);
        reject(
          new RequestError(
            t("This is too large for the editor: {megabytes} MB, and at most 4 MB.", {megabytes}),
            "refused",
          ),
        );
        return;
      }
      this.#waiting.set(id, {resolve, reject});
      this.#socket.send(message);
    });
  }

  /**
   * Change a document by a command.
   *
   * @param {number} tab @param {Command} command
   * @param {string} [base] the text in which that of the command was typed: changes of others to it are merged
   */
  do(tab, command, base) {
    return this.request("do", {tab, command, base: (base?.length ?? Infinity) <= MERGED ? base : undefined});
  }

  /**
   * Show the content of the imported automata of a document.
   *
   * @param {Automaton[]} content each before those below it
   * @param {number} tab
   */
  showContent(tab, content) {
    const former = this.documents.get(tab);
    if (!former) return;
    const next = {...former, content};
    next.automata = withContent(next);
    this.documents.set(tab, next);
    this.#emit("document", {tab, changed: true});
  }

  async #greet() {
    const former = this.greeting.instance;
    const asked = this.request("hello", {language});
    try {
      this.greeting = (await asked) ?? {};
      viewing.on = Boolean(this.greeting.viewer);
    } catch (error) {
      this.#emit("failure", {error});
      return;
    }
    const {instance, key} = this.greeting;
    if (former && instance !== former) {
      this.restarted = true;
      this.#emit("restarted");
      location.reload();
      return;
    }
    this.#resumption = import("./resumption.js").then(
      ({Resumption}) => Resumption.of(key),
      () => undefined, // the server is lost already
    );
    this.online = true;
    this.offlineSince = 0;
    this.refused = undefined;
    this.#retry = FIRST_RETRY;
    this.#admission?.postMessage("admitted");
    this.#emit("connection");
  }

  /** @param {CloseEvent} event */
  #lose(event) {
    for (const {reject} of this.#waiting.values()) {
      reject(new RequestError(t("The connection was lost before the answer came."), "offline"));
    }
    this.#waiting.clear();
    if (this.online || !this.offlineSince) this.offlineSince = Date.now();
    this.online = false;
    if (event.code === WITHDRAWN) this.refused = "notShared";
    this.#emit("connection", {code: event.code, reason: event.reason});
    if (this.refused) return;
    this.#findOutWhy();
    this.#timer = setTimeout(() => this.connect(), this.#retry);
    this.#retry = Math.min(LAST_RETRY, this.#retry * 2);
  }

  /** Browsers do not say why a websocket was refused; a request is answered with the reason. */
  async #findOutWhy() {
    const answer = await fetch("./", {method: "HEAD"}).catch(() => undefined);
    if (answer?.status !== 403 || this.online) return;
    const admitted = this.#resumption ? await (await this.#resumption)?.resume() : false;
    if (admitted) this.connect();
    // Without a key, others decide who may come, such as a hub, and may let this page in again.
    else if (admitted === false && !this.online && (viewing.on || this.greeting.key !== "")) this.#giveUp();
  }

  /** Ask no more: the server will refuse this page until its browser has opened another address. */
  #giveUp() {
    clearTimeout(this.#timer);
    this.refused ??= "unknown";
    this.#emit("connection");
  }

  /** When a page is let in, the others of its browser have its new cookie, and connect, too. */
  #listenForAdmission() {
    if (this.#admission) return;
    this.#admission = channelOf("admission");
    this.#admission.addEventListener("message", () => this.refused && this.connect());
  }

  /** @param {Answer | Push} message */
  #receive(message) {
    switch (message.push) {
      case undefined:
        this.#settle(message);
        return;
      case "document": {
        const former = this.documents.get(message.tab);
        const document = updated(former, message);
        this.documents.set(message.tab, document);
        const changed = Boolean(former) && COMPARED.some((name) => former?.[name] !== document[name]);
        this.#emit("document", {tab: message.tab, changed});
        return;
      }
      case "workspace": {
        const former = this.workspace;
        this.workspace = message;
        for (const tab of this.documents.keys()) {
          if (!message.tabs.some((each) => each.tab === tab)) this.documents.delete(tab);
        }
        this.#emit("workspace", {former});
        return;
      }
      case "robot":
        this.robot = {...NO_ROBOT, ...message};
        break;
      case "shelf":
        this.shelf = message.states;
        break;
      case "problems": {
        const document = this.documents.get(message.tab);
        const {items: problems, counts, revision: checked, complete} = message;
        if (document) Object.assign(document, {problems, counts, checked, proved: complete ? checked : undefined});
        break;
      }
      case "view":
        this.views.set(message.tab, new Map(this.views.get(message.tab)).set(message.name, message));
        break;
      case "tests":
        this.tests.set(message.tab, message);
        break;
      case "closed":
        this.documents.delete(message.tab);
        this.views.delete(message.tab);
        this.tests.delete(message.tab);
        break;
    }
    this.#emit(message.push, message);
    if (message.push === "output") this.request("outputShown").catch(() => {}); // the connection is lost
  }

  /** @param {Answer} message */
  #settle(message) {
    const waiting = this.#waiting.get(message.re);
    this.#waiting.delete(message.re);
    if (message.error !== undefined) {
      const error = new RequestError(message.error, message.kind);
      if (waiting) waiting.reject(error);
      else this.#emit("failure", {error});
    } else {
      waiting?.resolve(message.ok);
    }
  }

  /** @param {string} kind @param {object} detail */
  #emit(kind, detail = {}) {
    this.dispatchEvent(new CustomEvent(kind, {detail}));
  }
}

/** The one connection of the page. */
export const store = new Store();
