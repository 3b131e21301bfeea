/** Open, save and close documents, and ask the user to decide where needed. */

import {ask} from "./commands.js";
import {chooseFile} from "./file-dialog.js";
import {confirm} from "../kit/dialog.js";
import {keyOf} from "../kit/keys.js";
import {notify, notifyError, clearErrors} from "../kit/notices.js";
import {page} from "./page.js";
import {browserStorage} from "../kit/location.js";
import {RequestError, store} from "./store.js";
import {n, t} from "../kit/texts.js";

const RECENT = "visualhfsm.recent";
const MOST_RECENT = 8;
const LARGEST = 4_000_000; // characters that a dropped file may have

/** Paths of recent files, the latest first. @returns {string[]} */
export function recentFiles() {
  try {
    const found = JSON.parse(browserStorage.getItem(RECENT) ?? "[]");
    return Array.isArray(found) ? found.filter((each) => typeof each === "string") : [];
  } catch {
    return []; // invalid: written by another program
  }
}

/** @param {string} path */
function remember(path) {
  browserStorage.setItem(
    RECENT,
    JSON.stringify([path, ...recentFiles().filter((each) => each !== path)].slice(0, MOST_RECENT)),
  );
}

/** @param {string} path */
export async function openPath(path) {
  const done = await ask("open", {path});
  if (!done) return;
  remember(path);
  shown(done, path);
}

/**
 * Show an opened document, and remarks on what is missing or not the same here.
 *
 * @param {import("./protocol.js").Opened} opened @param {string} name
 */
function shown({tab, remarks}, name) {
  page.show(tab);
  if ([...(store.documents.get(tab)?.automata.values() ?? [])].some(isHeaped))
    notify(t("{name} has no positions for its states: Shift+L arranges all automata.", {name}));
  if (!remarks) return;
  const [first = "", ...others] = remarks;
  const values = {name, first};
  notify(
    others.length
      ? n(
          "{name} was imported as a new document. Some of it is missing or not the same here: {first}, and {count} more.",
          "{name} was imported as a new document. Some of it is missing or not the same here: {first}, and {count} more.",
          others.length,
          values,
        )
      : first
        ? t("{name} was imported as a new document. Some of it is missing or not the same here: {first}.", values)
        : t("{name} was imported as a new document.", values),
  );
}

/** Open a new document; returns undefined when that was not possible. */
export async function openNew(template = "empty") {
  const done = await ask("new", {template});
  if (!done) return undefined;
  page.show(done.tab);
  page.dispatchEvent(new Event("focus-canvas"));
  return true;
}

export async function openFile() {
  const path = await chooseFile({title: t("Open a document"), verb: t("Open")});
  if (path) await openPath(path);
}

/**
 * Open a file that the shown document imports, at a place in it.
 *
 * @param {string} file relative to the document
 * @param {import("./protocol.js").Place} [place] @param {import("./page.js").At} at
 */
export async function openImport(file, place, at = {}) {
  const from = page.tab;
  const {path} = page.tabState ?? {};
  if (!path) return;
  await openPath(/^\//.test(file) ? file : path.replace(/[^/]*$/, "") + file);
  if (place && page.tab !== from) page.jump(place, at);
}

/** Let the user choose the file that an automaton of the shown document imports. @param {number} automaton */
export async function chooseImport(automaton) {
  const own = page.tabState?.path?.split("/").slice(0, -1) ?? [];
  const source = page.document?.automata.get(automaton)?.imported?.automaton ?? 0;
  const path = await chooseFile({title: t("Choose the file to import"), verb: t("Import"), start: own.join("/")});
  if (!path) return;
  const parts = path.split("/");
  const shared = [...own, ""].findIndex((each, index) => each !== parts[index] || index === own.length);
  const file = [...own.slice(shared).map(() => ".."), ...parts.slice(shared)].join("/");
  await ask("do", {tab: page.tab, command: {command: "setImport", automaton, file, source}});
}

/** Whether all states of an automaton have the same position. @param {import("./protocol.js").Automaton} automaton */
const isHeaped = ({imported, states}) =>
  !imported && states.length > 1 && states.every(({x, y}) => x === states[0].x && y === states[0].y);

/** @param {File[]} dropped */
export async function openDropped(dropped) {
  for (const file of dropped) {
    if (/\.mcap$/i.test(file.name)) {
      notify(
        t("{name} is a recording: put it into the folder of the editor and open it with {key}.", {
          name: file.name,
          key: keyOf("openRecording"),
        }),
        "error",
      );
      continue;
    }
    if (file.size > LARGEST) {
      notify(t("{name} is too large for a document.", {name: file.name}), "error");
      continue;
    }
    const done = await ask("openText", {name: file.name, text: await file.text()});
    if (done) shown(done, file.name);
  }
}

/** Open the document of a session that ended without closing. @param {string} journal */
export async function recover(journal) {
  const {recoverable, tabs} = store.workspace;
  const path = recoverable.find((each) => each.journal === journal)?.path;
  const former = path && tabs.find((each) => each.path === path && !each.dirty);
  const done = await ask("recover", {journal});
  if (!done) return;
  page.show(done.tab);
  if (former) await ask("close", {tab: former.tab}); // close the document as it was saved
}

/** @returns {Promise<boolean>} whether the document is saved */
export async function save(tab = page.tab) {
  const state = store.workspace.tabs.find((each) => each.tab === tab);
  if (!state?.path) return saveAs(tab);
  const done = await saving((overwrite) => store.request("save", {tab, overwrite}), state.path, tab);
  if (done === OTHER_NAME) return saveAs(tab, state.path.replace(/(\.xml)?$/i, "_2.xml"));
  if (done === true) clearErrors(`save ${tab}`);
  else if (done) notifyError(new Error(done), {tab, about: `save ${tab}`});
  return done === true;
}

/** @param {string} [wanted] suggested path, by default the present one @returns {Promise<boolean>} */
export async function saveAs(tab = page.tab, wanted = "") {
  const state = store.workspace.tabs.find((each) => each.tab === tab);
  const {path: former = "", title = ""} = state ?? {};
  const suggestion = wanted || former || `${title.replace(/\.(xml|mcap)$/i, "")}.xml`;
  /** @param {string} path */
  const attempt = async (path) => {
    const done = await saving((overwrite) => store.request("saveAs", {tab, path, overwrite}), path, tab);
    return done === true ? "" : done || OTHER_NAME;
  };
  return Boolean(await chooseFile({title: t("Save the document as"), verb: t("Save"), suggestion, attempt}));
}

const OTHER_NAME = t("Choose another name.");

/**
 * Save, and ask before overwriting something.
 *
 * @param {(overwrite: boolean) => Promise<{path: string, tab?: number}>} request @param {string} path
 * @param {number} tab
 * @returns {Promise<true | string>} true if it was saved, else why not; empty if the user decided so
 */
async function saving(request, path, tab, overwrite = false) {
  try {
    const done = await request(overwrite);
    remember(done.path);
    if (done.tab) page.show(done.tab); // a copy
    notify(t("Saved {path}.", {path: done.path}));
    return true;
  } catch (error) {
    const {kind = "", message = String(error)} = /** @type {Partial<RequestError>} */ (error);
    if (overwrite || !["exists", "outside"].includes(kind)) return message;
    const isGone = store.workspace.tabs.find((each) => each.tab === tab)?.outside === "deleted";
    /** @type {[string, string, string?][]} */
    const choices =
      kind === "exists"
        ? [
            ["overwrite", t("Overwrite"), "danger"],
            ["saveAs", t("Save as…"), "primary"],
          ]
        : isGone
          ? [
              ["saveAs", t("Save as…")],
              ["overwrite", t("Write it again"), "primary"],
            ]
          : [
              ["theirs", t("Take theirs"), "danger"],
              ["overwrite", t("Keep mine"), "danger"],
              ["merge", t("Merge both"), "primary"],
            ];
    const title =
      kind === "exists"
        ? t("Write over {path}?", {path})
        : isGone
          ? t("Another program deleted {path}", {path})
          : t("Another program changed {path}", {path});
    const choice = await confirm({title, text: message, choices});
    if (choice === "overwrite") return saving(request, path, tab, true);
    if (choice === "theirs" || choice === "merge") {
      if (!(await resolve(choice, tab))) return "";
      return choice === "theirs" || saving(request, path, tab);
    }
    return choice === "saveAs" ? OTHER_NAME : "";
  }
}

/**
 * Resolve a change of the file of a document by another program.
 *
 * @param {"mine" | "theirs" | "merge"} choice
 * @returns {Promise<boolean>} whether that was possible
 */
export async function resolve(choice, tab = page.tab) {
  const done = await ask("resolve", {tab, choice});
  const conflicts = done?.conflicts ?? [];
  if (conflicts.length) notify(t("Merged. Both sides had changed {parts}.", {parts: conflicts.join("; ")}));
  return done !== undefined;
}

/** @param {number} tab */
export async function closeTab(tab) {
  try {
    await store.request("close", {tab});
  } catch (error) {
    if (!(error instanceof RequestError && error.kind === "unsaved")) {
      notifyError(error);
      return;
    }
    const title = store.workspace.tabs.find((each) => each.tab === tab)?.title ?? t("the document");
    const choice = await confirm({
      title: t("Save {title} before closing?", {title}),
      text: t("It has unsaved changes."),
      choices: [
        ["discard", t("Close without saving"), "danger"],
        ["save", t("Save"), "primary"],
      ],
    });
    if (choice === "discard" || (choice === "save" && (await save(tab))))
      await ask("close", {tab, discard: choice === "discard"});
  }
}
