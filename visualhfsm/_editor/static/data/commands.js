/**
 * Changes of the shown document. The commands are defined in visualhfsm/_document/commands/.
 *
 * Nothing is drawn before the server has changed the document; refusals are shown.
 *
 * @import {Answers, Automaton, Command, Commands, Done, FieldsOf, Place, Requests, State} from "./protocol.js"
 */

import {withContent} from "../measures/areas.js";
import {messageOf, notify, notifyError, clearErrors} from "../kit/notices.js";
import {page} from "./page.js";
import {samePlace} from "./places.js";
import {Sequence} from "../kit/sequence.js";
import {store} from "./store.js";
import {n, t} from "../kit/texts.js";

/**
 * Requests that messages are about alike: when one succeeds, what was said of another is over.
 *
 * @type {Record<string, string>}
 */
const KINDS = {do: "edit", paste: "edit", cut: "edit", copy: "edit", undo: "edit", redo: "edit", generate: "start"};

/**
 * Send a request of the user; shows why it was refused, until it succeeds.
 *
 * @template {keyof Requests} Op
 * @param {Op} op @param {FieldsOf<Requests[Op]>} fields
 * @returns {Promise<Answers[Op] | null | undefined>} its value, undefined when it was refused
 */
export function ask(op, ...fields) {
  const [{tab = 0} = {}] = /** @type {{tab?: number}[]} */ (fields);
  return askBy(op, tab, () => store.request(op, ...fields));
}

/**
 * The same by a function that sends the request, of a tab or 0.
 *
 * @template Value
 * @param {keyof Requests} op @param {number} tab @param {() => Promise<Value>} request
 * @returns {Promise<Value | null | undefined>} its value, undefined when it was refused
 */
export async function askBy(op, tab, request) {
  const about = `${KINDS[op] ?? op} ${tab}`;
  try {
    const done = (await request()) ?? null;
    clearErrors(about);
    return done;
  } catch (error) {
    notifyError(error, {tab, about});
    return undefined;
  }
}

/**
 * Send a request about the shown tab.
 *
 * @template {keyof Requests} Op
 * @param {Op} op @param {FieldsOf<Omit<Requests[Op], "tab">>} fields
 */
export const askTab = (op, ...[fields]) =>
  ask(op, .../** @type {FieldsOf<Requests[Op]>} */ ([{tab: page.tab, ...fields}]));

/**
 * Apply a command to the shown document.
 *
 * @template {keyof Commands} Name
 * @param {Name} command @param {FieldsOf<Commands[Name]>} fields
 */
export const apply = (command, ...[fields]) =>
  ask("do", {tab: page.tab, command: /** @type {Command} */ ({command, ...fields})});

/**
 * Apply a command to the shown automaton.
 *
 * @template {keyof Commands} Name
 * @param {Name} command @param {FieldsOf<Omit<Commands[Name], "automaton">>} fields
 */
export const applyHere = (command, ...[fields]) =>
  ask("do", {tab: page.tab, command: /** @type {Command} */ ({command, automaton: page.shownAutomaton.id, ...fields})});

/** The selected ids as the fields of a command. */
export const selected = () => ({
  states: [...page.states],
  transitions: [...page.transitions],
  annotations: [...page.annotations],
});

/** The same with what lies in selected frames. */
const selectedWithContent = () => withContent(page.shownAutomaton, selected());

/**
 * Select what a command has added to the shown automaton; returns the first id.
 *
 * @param {"states" | "transitions" | "annotations"} kind @param {Done | null | undefined} done
 */
export function selectAdded(done, kind) {
  const added = done?.added?.find((each) => each.automaton === page.automaton?.id);
  if (!added?.[kind]?.length) return undefined;
  page.select({[kind]: added[kind]});
  return added[kind][0];
}

/** Delete the selection. */
export async function deleteSelected() {
  const count = page.selectedCount;
  if (await applyHere("deleteItems", selected())) say(n("Deleted", "{count} deleted", count));
}

/** Say what is seen on the canvas for users of screen readers. @param {string} text */
const say = (text) => void page.dispatchEvent(new CustomEvent("say", {detail: text}));

/** Move the selection, with what lies in its frames. @param {number} dx @param {number} dy */
export function moveSelected(dx, dy) {
  return applyHere("moveItems", {...selectedWithContent(), dx, dy});
}

/** Rename a state or transition. @param {"state" | "transition"} kind @param {number} id @param {string} name */
export function rename(kind, id, name) {
  return kind === "state"
    ? applyHere("renameState", {state: id, name})
    : applyHere("renameTransition", {transition: id, name});
}

/** Whether the system's clipboard may be older than the last copy here, because the browser refused to write it. */
let systemIsBehind = false;

/** @param {"copy" | "cut"} op */
async function take(op) {
  const wasBehind = systemIsBehind;
  systemIsBehind = true;
  const {states, annotations} = selectedWithContent();
  const names = namesOf(states, annotations);
  const asked = askTab(op, {automaton: page.shownAutomaton.id, states, annotations});
  const [done, isWritten] = await Promise.all([asked, write(asked, names)]);
  systemIsBehind = done ? !isWritten : wasBehind;
  if (done && !isWritten) notify(t("The browser keeps its clipboard closed: this can be pasted in this editor alone."));
  return done;
}

/** What copied states and notes are for programs that do not know them. @param {number[]} states @param {number[]} notes */
function namesOf(states, notes) {
  const all = page.shownAutomaton;
  const names = all.states.filter((each) => states.includes(each.id)).map((each) => each.name);
  return [...names, ...all.annotations.filter((each) => notes.includes(each.id)).map((each) => each.text)].join("\n");
}

/**
 * Write to the system's clipboard, still in the press of the key, as Safari asks: the names as text, and what they stand
 * for in an attribute of HTML, the only other type that all browsers pass on. Returns whether the browser allowed it.
 *
 * @param {Promise<{text: string} | null | undefined>} asked @param {string} names
 */
async function write(asked, names) {
  const shown = names.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
  const html = asked.then((done) => {
    if (!done) throw new Error("nothing was copied");
    const copied = `<span data-visualhfsm="${new URLSearchParams({text: done.text})}">${shown}</span>`;
    return new Blob([copied], {type: "text/html"});
  });
  try {
    const item = {"text/plain": new Blob([names], {type: "text/plain"}), "text/html": html};
    await navigator.clipboard.write([new ClipboardItem(item)]);
    return true;
  } catch {
    await html.catch(() => {}); // it may have failed because of this
    return false;
  }
}

export const copy = () => take("copy");
export const cut = () => take("cut");

/** The steps that are being undone or redone, in order. */
const steps = new Sequence();
let waiting = 0;

/** Own steps that were taken back alone, and can be redone in their places; of each tab. @type {Map<number, number>} */
const takenBack = new Map();

/** Whether a step is possible, or may be after pending ones. @param {"undo" | "redo"} op */
export const canStep = (op) => waiting > 0 || hasStep(op, page.tab);

/** What is being typed becomes a step, too. @param {"undo" | "redo"} op @param {number} tab */
const hasStep = (op, tab) =>
  Boolean(store.documents.get(tab)?.[op].length) ||
  (op === "undo" && [...store.unsaved.values()].some((piece) => piece.tab === tab));

/**
 * Undo or redo a step, after pending ones, and show its changes; a notice names it unless they were in sight, or if it
 * was of another window. In a piece of code, where others change something as well, it is what was typed here.
 *
 * @param {"undo" | "redo"} op
 * @param {Place} [here] the code that the user edits; by default the user edits the canvas
 */
export function step(op, here) {
  const {tab} = page;
  waiting += 1;
  return steps
    .add(() => takeStep(op, tab, here))
    .finally(() => {
      waiting -= 1;
      page.dispatchEvent(new Event("change")); // the steps that can be undone depend on it
    });
}

/** @param {"undo" | "redo"} op @param {number} tab @param {Place} [here] */
async function takeStep(op, tab, here) {
  const former = store.documents.get(tab);
  const count = takenBack.get(tab) ?? 0;
  if (!former || !(hasStep(op, tab) || (here && op === "redo" && count))) return;
  const done = await ask(op, {tab, place: here});
  if (!done && op === "redo") takenBack.delete(tab);
  if (done?.own) takenBack.set(tab, count + (op === "undo" ? 1 : -1));
  const document = store.documents.get(tab);
  if (!done?.place || !document || page.tab !== tab) return;
  const {place} = done;
  const said = nameOfStep(op, done);
  const isText = Boolean(place.part && place.part !== "name");
  if (here) {
    if (samePlace(place, here)) return done.others ? notify(said) : undefined;
    if (!isText) page.dispatchEvent(new Event("focus-canvas"));
    page.jump(place);
  } else {
    const changed = [...document.automata].filter(([id, automaton]) => former.automata.get(id) !== automaton);
    const isShown = !changed.length || changed.some(([id]) => id === page.automaton?.id);
    if (!isShown) page.open(changed[0][0]);
    else if (!isText && !done.others) return say(said);
  }
  notify(said);
}

/** What is said of a step. @param {"undo" | "redo"} op @param {import("./protocol.js").Undone} done */
function nameOfStep(op, {name, others}) {
  if (others)
    return op === "undo"
      ? t("Undone what another window did: {name}.", {name})
      : t("Redone what another window did: {name}.", {name});
  return op === "undo" ? t("Undone: {name}.", {name}) : t("Redone: {name}.", {name});
}

/** The beginning of the text of a document, which may have been sent by mail. */
const DOCUMENT = /^\s*(<\?xml[^>]*>\s*)?<VisualHFSM\b/i;

/**
 * Paste, with the upper left corner at a point if one is given, and select the result: states of this editor or another,
 * or else the text in the system's clipboard, as a note.
 *
 * @param {{x: number, y: number} | undefined} point
 * @param {{text?: string, html?: string} | undefined} pasted content of the system's clipboard
 * @param {(text: string) => Promise<Done | null | undefined>} writeNote
 */
export async function paste(point, {text = "", html = ""} = {}, writeNote) {
  const written = systemIsBehind ? "" : text.replaceAll("\r\n", "\n").trim();
  const [, copied] = (!systemIsBehind && /data-visualhfsm="([^"]*)"/.exec(html)) || [];
  const content = copied ? new URLSearchParams(copied).get("text") : DOCUMENT.test(written) && written;
  showAdded(
    await (content
      ? applyHere("pasteStates", {content, ...point})
      : written
        ? writeNote(written)
        : askTab("paste", {automaton: page.shownAutomaton.id, ...point})),
  );
}

/** Paste what is selected beside itself; the clipboards keep what they have. */
export async function duplicate() {
  const {states, annotations} = selectedWithContent();
  showAdded(await askTab("duplicate", {automaton: page.shownAutomaton.id, states, annotations}));
}

/** Select what was pasted. @param {import("./protocol.js").Done | null} [done] */
function showAdded(done) {
  const added = done?.added?.find((each) => each.automaton === page.automaton?.id);
  if (!added) return;
  page.select({states: added.states, annotations: added.annotations});
  page.dispatchEvent(new Event("reveal"));
  page.dispatchEvent(new Event("focus-canvas"));
}

/** Move an automaton to a separate file, which the user chooses. @param {Automaton} automaton */
export async function extract(automaton) {
  const path = page.tabState?.path;
  if (!path) {
    notifyError(new Error(t("Save the document first: imports are relative to its file.")));
    return;
  }
  const {chooseFile} = await import("./file-dialog.js");
  const directory = path.includes("/") ? path.replace(/[^/]*$/, "") : "";
  const name = page.title(automaton).replace(/[^\w-]+/g, "_") || "part";
  const {tab} = page;
  /** @param {string} file */
  const attempt = async (file) => {
    try {
      await store.request("extract", {tab, automaton: automaton.id, path: file});
      return "";
    } catch (error) {
      return messageOf(error);
    }
  };
  const file = await chooseFile({
    title: t("Move the sub-automaton to a file"),
    verb: t("Move"),
    suggestion: `${directory}${name}.xml`,
    attempt,
  });
  if (file) notify(t("Moved the sub-automaton to {file}. It is imported from there.", {file}));
}

/** Copy the content of an imported automaton into the document. @param {Automaton} automaton */
export async function inline(automaton) {
  if (await askTab("inline", {automaton: automaton.id}))
    notify(
      t("Copied the content of {file} into this document. The file is unchanged.", {file: automaton.imported?.file}),
    );
}

/** Show a sub-automaton of a state; create it when there is none. @param {State} state */
export async function openChild(state) {
  if (!state.children.length) {
    const father = page.shownAutomaton.id;
    const done = await applyHere("addAutomaton", {state: state.id});
    const made = done?.added?.find((each) => each.automaton !== father);
    if (made) page.open(made.automaton);
  } else {
    page.open(state.children[0]);
  }
}
