/**
 * Open what a component runs elsewhere: its document, and recordings of its runs.
 *
 * @import {HfsmCanvas} from "../canvas/canvas.js"
 */

import {ask} from "../data/commands.js";
import {download} from "../canvas/export.js";
import {chooseFile} from "../data/file-dialog.js";
import {openPath} from "../data/files.js";
import {notify} from "../kit/notices.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {decimal, t} from "../kit/texts.js";
import {monitor} from "./monitor.js";

/** Open the document of the component that is followed, if the server can reach a file of its name. */
export async function openFollowed() {
  if (monitor.tab) page.show(monitor.tab);
  else {
    const path = await documentBelow(`${monitor.component}.xml`);
    if (path) await openPath(path);
  }
}

/**
 * The path of the document of what is followed; a notice says so if there is none.
 *
 * @param {string} [name] of its file, if the component does not say it
 */
export async function documentBelow(name = "") {
  name = monitor.structure?.document.replace(/^.*\//, "") || name;
  const isNamed = (/** @type {{path: string}} */ {path}) => path.replace(/^.*\//, "") === name;
  const below = async () => (await ask("listFiles", {below: true}))?.entries.find(isNamed);
  const found = name ? (store.workspace.tabs.find(isNamed) ?? (await below())) : undefined;
  const root = store.greeting.root ?? t("the root");
  const missing = name ? t("No {name} lies below {root}.", {name, root}) : t("No document lies below {root}.", {root});
  if (!found) notify(missing, "error");
  return found?.path;
}

/** Download the followed run, from its beginning until now, as a page that needs no server. */
export async function exportRun() {
  const done = await ask("exportRun", {component: monitor.component, tab: monitor.tab});
  if (!done) return;
  const file = new Blob([done.text], {type: "text/html"});
  download(done.name, file);
  notify(t("{name} was exported: {megabytes} MB.", {name: done.name, megabytes: decimal(file.size / 1e6, 1)}));
}

/** Ask for a recording, and show it in the views of a running component. */
export async function openRecording() {
  const path = await chooseFile({title: t("Open a recording"), verb: t("Open"), kind: "recording"});
  if (path) await play(path);
}

/**
 * Offer to play the recording of a run, once the run has ended.
 *
 * @param {number} tab that it was started from
 * @param {string} path
 */
export function awaitRecording(tab, path) {
  notify(t("The run is recorded into {path}.", {path}));
  /** @param {CustomEvent<import("../data/protocol.js").StartedPush>} event */
  const ended = ({detail}) => {
    if (detail.tab !== tab || detail.status !== "ended") return;
    store.removeEventListener("started", ended);
    notify(t("The run was recorded into {path}.", {path}), "info", {label: t("Play it"), run: () => play(path)});
  };
  store.addEventListener("started", ended);
}

/** @param {string} path */
export async function play(path) {
  const found = await ask("recording", {path});
  if (!found) return;
  await monitor.lookAtRecording(path, found);
  if (found.tab) page.show(found.tab);
  else notify(t("The recording does not contain its document: its states cannot be drawn."));
  if (found.shortened) notify(found.shortened);
}

/** Compare what a recording contains, which is shown, with the document of that name as it is now. @param {HfsmCanvas} canvas */
export async function compareRecorded(canvas) {
  const path = await documentBelow();
  if (path) await (await import("../canvas/comparison.js")).compareWith(canvas, path);
}
