/** What stands above everything until it is settled: the server is away, the robot is stopped, a file was changed by another program, or changes were not saved. */

import {html, nothing} from "lit";

import {ask, askTab} from "./commands.js";
import {notify, notifyError} from "./notices.js";
import {page} from "./page.js";
import {store} from "./store.js";

export function banner() {
  if (!store.online && store.offlineSince) {
    const since = new Date(store.offlineSince).toLocaleTimeString();
    return html`<div class="banner error" role="alert">The server has been away since ${since}. Your work is kept there; this page connects again by itself.
      <button type="button" @click=${() => store.connect()}>Try now</button></div>`;
  }
  return html`${stopped()}${file()}`;
}

/** The robot takes no command until somebody who has looked at it lets it go on. */
function stopped() {
  const reason = store.workspace.robotStopped;
  if (!reason) return nothing;
  return html`<div class="banner error" role="alert">The robot is stopped and takes no command: ${reason}.
    <button type="button" @click=${reset}>Reset the emergency stop</button></div>`;
}

async function reset() {
  try {
    await store.request("control", {component: "", action: "resetEmergencyStop", arguments: {}});
  } catch (error) {
    notifyError(error);
  }
}

/** The file of the shown document. */
function file() {
  const outside = page.tabState?.outside;
  if (!outside) return unsaved();
  return html`<div class="banner" role="alert">Another program ${outside} the file of ${page.tabState.title}.
    ${outside === "deleted" ? nothing : html`<button type="button" @click=${() => resolve("merge")}>Merge both</button><button type="button" @click=${() => resolve("theirs")}>Take theirs</button>`}
    <button type="button" @click=${() => resolve("mine")}>Keep mine</button></div>`;
}

async function resolve(choice) {
  const done = await askTab("resolve", {choice});
  const conflicts = (done?.conflicts ?? []).map((each) => each.message);
  if (conflicts.length) notify(`Merged. Both had changed: ${conflicts.join("; ")}. Yours was kept there.`);
}

/** Changes to the shown file from a session that ended without saving them. */
function unsaved() {
  const path = page.tabState?.path;
  const lost = path && store.workspace.recoverable.find((each) => each.path === path);
  if (!lost) return nothing;
  return html`<div class="banner" role="alert">Changes to ${page.tabState.title} of ${new Date(lost.changedAt * 1000).toLocaleString()} were not saved when the editor ended.
    <button type="button" @click=${async () => (await import("./files.js")).recover(lost.journal)}>Recover them</button>
    <button type="button" @click=${() => ask("discard", {journal: lost.journal})}>Give them up</button></div>`;
}
