import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {beforeEach, test} from "node:test";

import {Socket, STATIC} from "./page.js";

globalThis.addEventListener ??= () => {};

const {RUN_MENU} = await import(new URL("run/actions.js", STATIC).href);
const {MENUS, selectionActions, selectionTitle} = await import(new URL("shell/actions.js", STATIC).href);
const {keyTable} = await import(new URL("dialogs/key-table.js", STATIC).href);
const {listenForKeys, spoken, written} = await import(new URL("kit/keys.js", STATIC).href);
const {page} = await import(new URL("data/page.js", STATIC).href);
const {actions, addActions, findActions, isEnabled, perform, withAdded} = await import(
  new URL("kit/registry.js", STATIC).href
);
const {store} = await import(new URL("data/store.js", STATIC).href);
const {containsWords} = await import(new URL("kit/texts.js", STATIC).href);

const state = (id, fields = {}) => ({id, name: `s${id}`, initial: false, final: false, children: [], ...fields});
const transition = (id, origin, destination, priority = "") => ({id, name: `t${id}`, origin, destination, priority});
const note = (id, fields = {}) => ({
  id,
  kind: "note",
  x: 0,
  y: 0,
  width: 100,
  height: 50,
  color: "",
  text: "",
  ...fields,
});
const automaton = (id, father, states, transitions = [], annotations = []) => ({
  id,
  father,
  imported: null,
  states,
  transitions,
  annotations,
});

/** @type {Socket} */
let socket;
const context = {app: {}, canvas: {}};

/** Show a document; the actions work on it. */
function show(...automata) {
  push(1, [{name: "Move", revision: 0}], [], automata);
  page.show(1);
}

/** Push a document and its steps. */
const push = (revision, undo, redo, automata) =>
  socket.push({
    push: "document",
    tab: 1,
    revision,
    undo,
    redo,
    dirty: true,
    full: {name: "a", parameters: [], automata},
  });

/** What was asked last. */
const asked = () => socket.sent.at(-1);

beforeEach(async () => {
  store.documents.clear();
  page.show(0);
  page.forget(1);
  if (!socket) {
    store.connect();
    socket = Socket.made.at(-1);
    socket.open();
    socket.push({re: socket.sent[0].id, ok: {}});
    await new Promise((resolve) => setImmediate(resolve));
  }
});

test("no key does two things where both count", () => {
  const taken = new Map();
  for (const {id, keys = [], scope} of actions.values()) {
    for (const key of keys) {
      const where = scope === "code" ? `${key} in code` : key;
      assert.ok(!taken.has(where), `${key} is of ${taken.get(where)} and of ${id}`);
      taken.set(where, id);
      assert.ok(scope !== "typing" || /^(Ctrl|Alt|F\d|Shift\+F\d)/.test(key), `${id} takes ${key} from who types`);
    }
  }
});

test("what is in the menus and in the list of keys are actions, each with words", () => {
  for (const {title, rows} of keyTable()) {
    assert.ok(title && rows.length);
    for (const {keys, text} of rows) assert.ok(text && keys.length, `${text} has no key`);
  }
  show(automaton(1, 0, [state(1), state(2), state(3)], [transition(1, 1, 2), transition(2, 2, 3)]));
  for (const selection of [{states: [1]}, {transitions: [1]}, {states: [1, 2]}, {transitions: [1, 2]}, {}]) {
    page.select(selection);
    for (const id of selectionActions().flat()) assert.ok(actions.get(id)?.label, `${id} is no action`);
  }
});

test("the menus have each action once, and none that is unknown", () => {
  const ids = MENUS.flatMap(({groups}) => groups.flat());
  assert.deepEqual(
    ids.filter((id) => !actions.has(id)),
    [],
  );
  assert.equal(new Set(ids).size, ids.length);
});

test("an action stands before or after the one that it names", () => {
  const added = (/** @type {object} */ fields) => ({label: "x", icon: "file", run: () => {}, ...fields});
  addActions([added({id: "board", before: "problems"}), added({id: "give", after: "saveAs", keys: ["Alt+Q"]})]);
  try {
    assert.deepEqual(withAdded(["saveAs", "problems", "output"]), ["saveAs", "give", "board", "problems", "output"]);
    assert.deepEqual(
      keyTable()
        .flatMap(({rows}) => rows)
        .filter(({text}) => text === "x")
        .map(({keys}) => keys),
      [[], ["Alt+Q"]],
    );
  } finally {
    for (const id of ["board", "give"]) actions.delete(id);
  }
});

test("what has no key is in a menu", () => {
  show(automaton(1, 0, [state(1, {children: [2]}), state(2), state(3)], [], [note(1)]), automaton(2, 1, []));
  const reached = new Set([...MENUS.flatMap(({groups}) => groups.flat()), ...RUN_MENU.flat()]);
  for (const selection of [{states: [1]}, {states: [1, 2]}, {annotations: [1]}]) {
    page.select(selection);
    for (const id of selectionActions().flat()) reached.add(id);
  }
  const lost = [...actions.values()].filter(({id, keys}) => !keys && !reached.has(id)).map(({id}) => id);
  assert.deepEqual(lost, ["inline", "repairNumbers"]); // in the menu of the canvas, where they are possible
});

test("actions that are possible are found by their words, those that begin so first", () => {
  const found = (text) => findActions(text, context).map(({id}) => id);
  show(automaton(1, 0, [state(1), state(2)], [transition(1, 1, 2)]));
  assert.deepEqual(found("arr"), ["layout", "layoutAll"]);
  assert.equal(found("final").includes("toggleFinal"), false);
  page.select({states: [1]});
  assert.equal(found("  FINAL on ")[0], "toggleFinal");
  assert.equal(found("save as")[0], "saveAs");
  assert.equal(found("start page")[0], "startPage");
  perform("startPage", context);
  assert.equal(page.tab, 0);
  page.show(1);
  const all = found("");
  for (const {id} of actions.values())
    assert.equal(all.includes(id), isEnabled(id, context) && id !== "palette" && id !== "cancel", id);
  assert.deepEqual(found("no such thing"), []);
});

test("the palette finds actions by what else people call them, in each language", () => {
  show(automaton(1, 0, [state(1), state(2)], [transition(1, 1, 2)]));
  page.select({states: [1]});
  /** @type {[id: string, english: string, spanish: string][]} */
  const called = [
    [
      "export",
      "drawing as a page|export drawing|print|picture|svg|png|pdf",
      "dibujo como página|imprimir|imagen|svg|png",
    ],
    ["share", "share|link", "compartir|enlace"],
    ["layout", "arrange|layout|tidy", "ordenar|organizar|disposicion"],
    ["fit", "fit|zoom", "encajar|ajustar|zoom"],
    ["zoomIn", "zoom|larger", "zoom|acercar"],
    ["zoomOut", "zoom|smaller", "zoom|alejar"],
    ["search", "find|replace", "buscar|reemplazar"],
    ["delete", "remove", "eliminar"],
    ["newNote", "comment", "comentario"],
    ["theme", "dark mode", "modo oscuro"],
    ["help", "shortcuts", "atajos"],
    ["tryIt", "simulate", "simular"],
    ["libraries", "library|add a library|import|module", "biblioteca|añadir una biblioteca|importar|módulo"],
    ["ros", "topic|publish", "tópico|publicar"],
    ["events", "event|add an event", "evento"],
    ["properties", "property|model checker|prove", "propiedad|demostrar"],
    ["component", "parameter|add a parameter|settings", "parámetro|ajustes"],
  ];
  const spanish = JSON.parse(readFileSync(new URL("languages/es.json", STATIC), "utf-8"));
  for (const [id, english, others] of called) {
    for (const words of english.split("|"))
      assert.ok(
        findActions(words, context).some((each) => each.id === id),
        `${id} is not found by “${words}”`,
      );
    const {label, hint = "", help = "", words = ""} = actions.get(id);
    const said = [label, hint, help, words].map((text) => spanish[text] ?? text).join(" ");
    for (const each of others.split("|")) assert.ok(containsWords(said, each), `${id} is not found by “${each}”`);
  }
});

test("without a document only what needs none can be done", () => {
  for (const id of ["save", "run", "undo", "selectAll", "newState", "copy", "delete", "stop", "pauseResume"])
    assert.equal(isEnabled(id, context), false, id);
  for (const id of ["new", "open", "help", "openRecording"]) assert.equal(isEnabled(id, context), true, id);
  assert.equal(perform("undo", context), undefined);
});

test("a document without automata offers its first state, and nothing to select", () => {
  show();
  assert.equal(isEnabled("newState", context), true);
  assert.equal(isEnabled("newTransition", context), false);
  assert.equal(isEnabled("selectAll", context), false);
});

test("what is imported is looked at, and not changed", () => {
  show(automaton(1, 0, [state(1, {children: [2]})]), {...automaton(2, 1, []), imported: {file: "b.xml", automaton: 0}});
  page.select({states: [1]});
  assert.equal(isEnabled("inline", context), true);
  assert.equal(isEnabled("extract", context), false);
  page.open(2);
  for (const id of ["newState", "paste", "layout"]) assert.equal(isEnabled(id, context), false, id);
  assert.equal(isEnabled("fit", context), true);
});

test("an action asks for a command about what is selected", () => {
  show(automaton(1, 0, [state(1), state(2)], [transition(1, 1, 2), transition(2, 1, 2)]));
  page.select({states: [1, 2], transitions: [2]});
  assert.equal(selectionTitle(), "2 states, 1 transition");
  perform("moveRight", context);
  assert.deepEqual(asked().command, {
    command: "moveItems",
    automaton: 1,
    states: [1, 2],
    transitions: [2],
    annotations: [],
    dx: 10,
    dy: 0,
  });
  page.select({states: [2]});
  assert.equal(selectionTitle(), "State s2");
  perform("toggleFinal", context);
  assert.deepEqual(asked().command, {command: "markFinal", automaton: 1, state: 2, final: true});
  assert.equal(actions.get("toggleFinal").checked(), false);
});

test("a frame moves with what lies in it, and is deleted alone", () => {
  const inside = note(2, {x: 20, y: 30});
  const frame = note(1, {kind: "frame", width: 300, height: 200});
  const sticksOut = note(3, {x: 250, y: 30});
  const states = [state(1, {x: 150, y: 100}), state(2, {x: 400, y: 100})];
  show(automaton(1, 0, states, [], [frame, inside, sticksOut]));
  page.select({annotations: [1]});
  perform("moveDown", context);
  assert.deepEqual(asked().command, {
    command: "moveItems",
    automaton: 1,
    states: [1],
    transitions: [],
    annotations: [1, 2],
    dx: 0,
    dy: 10,
  });
  perform("delete", context);
  assert.deepEqual([asked().command.states, asked().command.annotations], [[], [1]]);
});

test("a note takes one of the colors, and the chosen one is checked", () => {
  show(automaton(1, 0, [], [], [note(1), note(2, {color: "pink"})]));
  page.select({annotations: [1, 2]});
  assert.equal(selectionTitle(), "2 notes");
  perform("colorBlue", context);
  assert.deepEqual(asked().command, {command: "setAnnotationColor", automaton: 1, annotations: [1, 2], color: "blue"});
  page.select({annotations: [2]});
  assert.equal(actions.get("colorPink").checked(), true);
});

test("a transition is evaluated earlier or later among those of its state, as far as there are others", () => {
  show(automaton(1, 0, [state(1), state(2)], [transition(1, 1, 2), transition(2, 2, 1), transition(3, 1, 2)]));
  page.select({transitions: [3]});
  perform("tryEarlier", context);
  assert.deepEqual(asked().command, {command: "reorderTransition", automaton: 1, transition: 3, index: 0});
  const before = socket.sent.length;
  perform("tryLater", context);
  assert.equal(socket.sent.length, before);
});

/** A key that is pressed. */
const event = (key, held = {}) => ({
  ...{key, code: "", ctrlKey: false, altKey: false, shiftKey: false, metaKey: false, ...held},
  getModifierState: (name) => Boolean(held[name]),
});

test("keys are written as the table has them, and shown as people know them", () => {
  assert.equal(written(event("z", {ctrlKey: true})), "Ctrl+Z");
  assert.equal(written(event("Z", {metaKey: true, shiftKey: true})), "Ctrl+Shift+Z");
  assert.equal(written(event("?", {shiftKey: true})), "?");
  assert.equal(written(event("Enter", {shiftKey: true})), "Shift+Enter");
  assert.equal(spoken("Ctrl+ArrowUp"), "Ctrl+↑");
  assert.equal(spoken("+"), "+");
});

test("where a key types no Latin letter, its place counts", () => {
  for (const [key, code, held, wanted] of [
    ["¬", "KeyL", {altKey: true}, "Alt+L"], // the Option key of a Mac
    ["@", "KeyL", {altKey: true}, "Alt+L"], // that of a German one
    ["Dead", "KeyI", {altKey: true}, "Alt+I"],
    ["Å", "KeyA", {altKey: true, shiftKey: true}, "Alt+Shift+A"],
    ["ы", "KeyS", {ctrlKey: true}, "Ctrl+S"],
    ["Я", "KeyZ", {metaKey: true, shiftKey: true}, "Ctrl+Shift+Z"],
    ["σ", "KeyS", {}, "S"],
    ["z", "KeyY", {ctrlKey: true}, "Ctrl+Z"], // a German keyboard has Latin letters, elsewhere
    ["ł", "KeyL", {AltGraph: true}, "Ł"],
    ["é", "Digit2", {}, "É"],
  ])
    assert.equal(written(event(key, {code, ...held})), wanted, key);
});

/** A document with fields, until a test ends. */
function surroundings(t) {
  class Field extends EventTarget {
    isContentEditable = true;
    matches = () => false;
    closest = () => null;
  }
  t.after(() => (delete globalThis.document, delete globalThis.HTMLElement, delete globalThis.Element));
  const document = Object.assign(new EventTarget(), {querySelector: () => null, body: new Field()});
  Object.assign(globalThis, {document, HTMLElement: Field, Element: Field});
  return {document, Field};
}

test("a Mac types accents and signs with its Option key, and not where nothing is typed", (t) => {
  const {document, Field} = surroundings(t);
  const performed = [];
  listenForKeys({app: {toggleTheme: () => performed.push("theme")}, canvas: {contains: () => false}});
  /** @param {string} key @param {EventTarget} target */
  const press = (key, target) => {
    const pressed = Object.assign(new Event("keydown"), event(key, {code: "KeyD", altKey: true}));
    Object.defineProperties(pressed, {composedPath: {value: () => [target]}, target: {value: target}});
    document.dispatchEvent(pressed);
    return performed.splice(0);
  };
  const ground = Object.assign(new Field(), {isContentEditable: false});
  for (const [key, field, where] of [
    ["d", ["theme"], ["theme"]],
    ["∂", ["theme"], ["theme"]],
    ["@", [], ["theme"]],
    ["Dead", [], ["theme"]],
  ]) {
    assert.deepEqual(press(key, new Field()), field, `${key} in a field`);
    assert.deepEqual(press(key, ground), where, `${key} elsewhere`);
  }
});

test("on a Mac keys are shown with its signs, and what the system takes with its Control key", () => {
  for (const [key, wanted] of [
    ["Ctrl+S", "⌘S"],
    ["Ctrl+Shift+Z", "⇧⌘Z"],
    ["Alt+L", "⌥L"],
    ["Alt+ArrowUp", "⌥↑"],
    ["Backspace", "⌫"],
    ["Ctrl+M", "⌃M"],
    ["+", "+"],
  ])
    assert.equal(spoken(key, true), wanted);
});

test("undo and redo that follow each other quickly are all done, each after the one before", async () => {
  show(automaton(1, 0, [state(1)]));
  const steps = [];
  const undone = {name: "Move", revision: 0};
  for (const op of ["undo", "redo", "undo", "redo", "redo"]) perform(op, context);
  for (let revision = 2; revision < 6; revision += 1) {
    await new Promise((resolve) => setImmediate(resolve));
    const {id, op} = socket.sent.at(-1);
    steps.push(op);
    const [undo, redo] = op === "undo" ? [[], [undone]] : [[undone], []];
    push(revision, undo, redo, [automaton(1, 0, [state(1)])]);
    socket.push({re: id, ok: {...undone, revision, added: [], place: null}});
  }
  assert.deepEqual(steps, ["undo", "redo", "undo", "redo"]);
});

test("states go through the system's clipboard, and through the server's while that is older", async (t) => {
  /** @type {string[]} */
  const said = [];
  const element = () => ({
    children: [],
    append: (/** @type {unknown} */ each) => void (typeof each === "string" && said.push(each)),
    querySelectorAll: () => [],
    ...{setAttribute() {}, addEventListener() {}, remove() {}},
  });
  const former = globalThis.document;
  globalThis.document = /** @type {any} */ ({
    ...former,
    createElement: element,
    querySelector: () => null,
    body: element(),
  });
  t.after(() => (globalThis.document = former));
  /** @type {string[]} */
  const texts = [];
  let refuses = false;
  const clipboard = {
    write: async (/** @type {any[]} */ [{data}]) => {
      if (refuses) throw new Error("refused");
      for (const type of ["text/plain", "text/html"]) texts.push(await (await data[type]).text());
    },
  };
  globalThis.ClipboardItem = /** @type {any} */ (
    class {
      /** @param {unknown} data */
      constructor(data) {
        this.data = data;
      }
    }
  );
  Object.defineProperty(navigator, "clipboard", {value: clipboard, configurable: true});
  show(automaton(1, 0, [state(1), state(2)]));
  page.select({states: [2]});
  const text = '<?xml version="1.0"?>\n<VisualHFSM/>';
  const paste = (pasted = text, html = "") => {
    perform("paste", {...context, pasted: {text: pasted, html}});
    return asked().command ?? asked().op;
  };
  const copy = async () => {
    const done = perform("copy", context);
    assert.deepEqual([asked().op, asked().states], ["copy", [2]]);
    const {id} = asked();
    assert.equal(paste(), "paste", "a copy is under way");
    socket.push({re: id, ok: {text}});
    await done;
  };
  const ours = {command: "pasteStates", automaton: 1, content: text};
  assert.deepEqual(paste(), ours, "of another editor");
  await copy();
  const [names, html] = texts;
  assert.equal(names, "s2", "what other programs get");
  assert.deepEqual(paste("s2", `<meta charset="utf-8">${html}`), ours);
  assert.deepEqual(paste(`\uFEFF  ${text}\r\n`), ours);
  assert.equal(paste(""), "paste");
  const garbled = paste("s2", '<span data-visualhfsm="text=%E0%A4%A">s2</span>');
  assert.equal(garbled.command, "pasteStates", "the server says what is wrong with it");
  refuses = true;
  await copy();
  assert.equal(paste(), "paste", "the browser refused to write it");
  assert.deepEqual(said, ["The browser keeps its clipboard closed: this can be pasted in this editor alone."]);
  refuses = false;
  await copy();
  assert.deepEqual(paste(), ours);
});

test("a paste of the browser goes to the drawing, and not where text is typed", (t) => {
  const {document, Field} = surroundings(t);
  show(automaton(1, 0, [state(1)]));
  listenForKeys(context);
  /** @param {EventTarget} target */
  const paste = (target) => {
    const before = socket.sent.length;
    const pasted = Object.assign(new Event("paste", {cancelable: true}), {
      clipboardData: {getData: (type) => (type === "text/plain" ? "<VisualHFSM/>" : "")},
    });
    Object.defineProperty(pasted, "composedPath", {value: () => [target]});
    document.dispatchEvent(pasted);
    return [pasted.defaultPrevented, ...socket.sent.slice(before).map(({command}) => command.content)];
  };
  assert.deepEqual(paste(new Field()), [false]);
  assert.deepEqual(paste(Object.assign(new Field(), {isContentEditable: false})), [true, "<VisualHFSM/>"]);
  document.querySelector = () => "a dialog";
  assert.deepEqual(paste(Object.assign(new Field(), {isContentEditable: false})), [false]);
});
