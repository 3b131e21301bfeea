/**
 * The connection to the server and what it has said: open documents, problems, what runs.
 *
 * The server is the truth. The page asks with `request`, and everything that changes comes back as a push, before
 * the answer to the request that changed it.
 *
 * @typedef {{id: number, name: string, x: number, y: number, initial: boolean, final: boolean, children: number[],
 *   history: string, entry: string, code: string, exit: string, arguments: object[]}} State
 * @typedef {{id: number, name: string, x: number, y: number, origin: number, destination: number, type: string,
 *   trigger: string, guard: string, priority: string, code: string}} Transition
 * @typedef {{id: number, father: number, period: string, variables: string,
 *   functions: string, inputs: object[], imported: object | null, states: State[], transitions: Transition[]}}
 *   Automaton
 * @typedef {{code: string, severity: string, message: string, automaton?: number, state?: number, transition?: number,
 *   part?: string, line: number, column: number, length: number}} Problem
 * @typedef {{tab: number, revision: number, undo: string[], redo: string[], dirty: boolean, fields: object,
 *   automata: Map<number, Automaton>, own: Map<number, Automaton>, content: Automaton[], problems: Problem[], checked?:
 *   number}} OpenDocument `automata` are its `own` with the `content` of those that are imported; `checked` is the
 *   revision that the problems are those of
 */

const FIRST_RETRY = 250; // ms
const LAST_RETRY = 5000;
/** Requests that have nothing to do with what was typed before. */
const ASIDE = new Set(["hello", "codeHelp", "interfaces", "listFiles"]);

/** An answer of the server that says why something was not done. */
class RequestError extends Error {
  constructor(message, kind) {
    super(message);
    this.kind = kind;
  }
}

/**
 * Events: `connection`, `workspace`, `document` {tab, changed: Set of automaton ids, whole}, `problems` {tab},
 * `request` before one that others may have to precede, and one of the name of each further push (`output`, `run`,
 * `snapshot`, `structure`, `stale`, `outside`, `closed`).
 */
class Store extends EventTarget {
  /** @type {Map<number, OpenDocument>} */
  documents = new Map();
  workspace = {tabs: [], recoverable: [], clipboard: 0, running: []};
  online = false;
  /** When the connection was lost, ms since 1970; 0 while it stands. */
  offlineSince = 0;
  /** What the server said of itself to `hello`. */
  greeting = {};

  #socket = null;
  #number = 0;
  #waiting = new Map();
  #retry = FIRST_RETRY;
  #timer = 0;

  /** Connect, and again whenever the connection is lost. */
  connect() {
    clearTimeout(this.#timer);
    // One at a time, or everything would be reported twice.
    if (this.#socket && this.#socket.readyState !== WebSocket.CLOSED) return;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/ws`);
    this.#socket = socket;
    socket.addEventListener("open", () => this.#greet());
    socket.addEventListener("message", (event) => this.#receive(JSON.parse(event.data)));
    socket.addEventListener("close", (event) => this.#lose(event));
  }

  /**
   * Ask the server for something.
   *
   * @param {string} op
   * @param {object} fields
   * @returns {Promise<any>} its value; rejected with a RequestError
   */
  request(op, fields = {}) {
    if (!ASIDE.has(op)) this.dispatchEvent(new Event("request"));
    return new Promise((resolve, reject) => {
      if (this.#socket?.readyState !== WebSocket.OPEN) {
        reject(
          new RequestError(
            "The server is offline; your work is kept there. This page connects again by itself.",
            "offline",
          ),
        );
        return;
      }
      const id = ++this.#number;
      this.#waiting.set(id, {resolve, reject});
      this.#socket.send(JSON.stringify({id, op, ...fields}));
    });
  }

  /** Change a document by a command. */
  do(tab, command) {
    return this.request("do", {tab, command});
  }

  /**
   * Show what the imported automata of a document stand for.
   *
   * @param {Automaton[]} content each before those below it
   */
  showContent(tab, content) {
    const former = this.documents.get(tab);
    if (!former) return;
    const next = {...former, content};
    next.automata = withContent(next);
    this.documents.set(tab, next);
    this.#emit("document", {tab, changed: new Set(next.automata.keys()), whole: false});
  }

  async #greet() {
    const asked = this.request("hello");
    try {
      this.greeting = (await asked) ?? {};
    } catch (error) {
      this.#emit("failure", {error});
      return;
    }
    this.online = true;
    this.offlineSince = 0;
    this.#retry = FIRST_RETRY;
    this.#emit("connection");
  }

  #lose(event) {
    for (const {reject} of this.#waiting.values()) {
      reject(new RequestError("The connection was lost before the answer came.", "offline"));
    }
    this.#waiting.clear();
    if (this.online || !this.offlineSince) this.offlineSince = Date.now();
    this.online = false;
    this.#emit("connection", {code: event.code, reason: event.reason});
    this.#timer = setTimeout(() => this.connect(), this.#retry);
    this.#retry = Math.min(LAST_RETRY, this.#retry * 2);
  }

  #receive(message) {
    if (message.push === "document") this.#takeDocument(message);
    else if (message.push) this.#push(message);
    else this.#settle(message);
  }

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

  #push(message) {
    switch (message.push) {
      case "workspace":
        this.workspace = message;
        for (const tab of this.documents.keys()) {
          if (!message.tabs.some((each) => each.tab === tab)) this.documents.delete(tab);
        }
        break;
      case "problems": {
        const document = this.documents.get(message.tab);
        if (document) Object.assign(document, {problems: message.items, checked: message.revision});
        break;
      }
      case "closed":
        this.documents.delete(message.tab);
        break;
    }
    this.#emit(message.push, message);
  }

  #takeDocument(message) {
    const {tab, revision, undo, redo, dirty} = message;
    const former = this.documents.get(tab);
    const next = {
      tab,
      problems: former?.problems ?? [],
      fields: {},
      own: new Map(),
      content: [],
      ...former,
      revision,
      undo,
      redo,
      dirty,
    };
    const changed = new Set();
    if (message.full) {
      const {automata, ...fields} = message.full;
      next.fields = fields;
      next.own = new Map(automata.map((each) => [each.id, each]));
      for (const {id} of automata) changed.add(id);
    } else if (message.patch) {
      const {document: fields, automata = [], parts = [], removed = [], order} = message.patch;
      if (fields) next.fields = {...next.fields, ...fields};
      const known = new Map(next.own);
      for (const id of removed) known.delete(id);
      for (const each of [...automata, ...parts.map((part) => patched(known.get(part.id), part))]) {
        known.set(each.id, each);
        changed.add(each.id);
      }
      next.own = order ? new Map(order.filter((id) => known.has(id)).map((id) => [id, known.get(id)])) : known;
    }
    next.automata = withContent(next);
    this.documents.set(tab, next);
    this.#emit("document", {tab, changed, whole: Boolean(message.full)});
  }

  #emit(kind, detail = {}) {
    this.dispatchEvent(new CustomEvent(kind, {detail}));
  }
}

/** The automata of a document with what is imported in the place of where it is. @param {OpenDocument} document */
function withContent({own, content}) {
  if (!content.length) return own;
  const automata = new Map(own);
  for (const each of content) {
    const stub = own.get(each.id);
    const fits = stub
      ? stub.imported?.file === each.imported.file && stub.imported.automaton === each.imported.automaton
      : automata.has(each.father);
    if (fits) automata.set(each.id, stub ? {...each, father: stub.father} : each);
  }
  return automata;
}

/** An automaton after a change; what did not change in it is the very same object as before. */
function patched(automaton, {fields, states, transitions}) {
  const items = (list, change) => (change ? patchedItems(list, change) : list);
  return {
    ...automaton,
    ...fields,
    states: items(automaton.states, states),
    transitions: items(automaton.transitions, transitions),
  };
}

function patchedItems(list, {changed = [], removed = [], order}) {
  const byId = new Map(list.map((each) => [each.id, each]));
  for (const id of removed) byId.delete(id);
  for (const each of changed) byId.set(each.id, each);
  return order ? order.map((id) => byId.get(id)) : [...byId.values()];
}

/** The one connection of the page. */
export const store = new Store();
