/**
 * The task of an exercise beside the drawing, with its points and marks, and handing in.
 *
 * @import {Words} from "visualhfsm/data/protocol.js"
 * @import {Task} from "./messages.js"
 */

import {html, nothing} from "lit";
import {download} from "visualhfsm/canvas/export.js";
import {ask} from "visualhfsm/data/commands.js";
import {PageElement} from "visualhfsm/data/element.js";
import {save} from "visualhfsm/data/files.js";
import {page} from "visualhfsm/data/page.js";
import {RequestError, store} from "visualhfsm/data/store.js";
import {actionButton} from "visualhfsm/kit/buttons.js";
import {confirm} from "visualhfsm/kit/dialog.js";
import {messageOf, notify, notifyError} from "visualhfsm/kit/notices.js";
import {addStyles} from "visualhfsm/kit/theme.js";
import {language, t} from "visualhfsm/kit/texts.js";
import {isOffered} from "visualhfsm/shell/panels.js";

await addStyles(new URL("./task.css", import.meta.url));

/** Whether two answers differ: a panel that is not drawn again stays scrolled. @param {unknown[]} answers */
const differ = (...answers) => new Set(answers.map((each) => JSON.stringify(each))).size > 1;

class TaskPanel extends PageElement {
  static properties = {task: {state: true, hasChanged: differ}, failed: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {};

  constructor() {
    super();
    /** The answer of the server, and the tab that it is about. @type {(Task & {tab: number}) | undefined} */
    this.task = undefined;
    this.failed = "";
  }

  #loaded = Promise.resolve();

  connectedCallback() {
    super.connectedCallback();
    this.listen(page, "tab", () => this.load());
    this.listen(window, "focus", () => this.load()); // marks may have come meanwhile
    this.load();
  }

  async focusFirst() {
    await this.#loaded;
    await this.updateComplete;
    /** @type {HTMLElement | null} */ (this.querySelector("article"))?.focus();
  }

  render() {
    const {task, failed} = this;
    if (task?.tab !== page.tab)
      return html`<p class="empty" role="status">${failed || t("This document belongs to no exercise.")}</p>`;
    const {text, marks, collected, handedIn} = task;
    const time =
      handedIn && new Date(handedIn * 1000).toLocaleString(language, {dateStyle: "medium", timeStyle: "short"});
    return html`<div class="task">
      <div class="hand-in">
        ${actionButton("handIn", this.context, {kind: "primary", label: "short"})}
        <span role="status" class="faint">
          ${time ? t("Handed in on {time}: {path}", {time, path: collected}) : collected && t("Not handed in yet")}
        </span>
      </div>
      <article tabindex="0" aria-label=${t("Task")}>
        ${nodesOf(text)} ${marks.length ? html`<h3>${t("Your marks")}</h3>` : nothing} ${nodesOf(marks)}
      </article>
    </div>`;
  }

  load() {
    this.#loaded = this.#ask();
    return this.#loaded;
  }

  async #ask() {
    const {tab} = page;
    try {
      const found = isOffered({name: "task"}) ? await store.request("task", {tab}) : null;
      if (tab === page.tab) Object.assign(this, {failed: "", task: found ? {...found, tab} : undefined});
    } catch (error) {
      this.failed = messageOf(error);
    }
  }
}

/** The nodes of a text of strangers: the server names only harmless elements. @param {Words} words @returns {Node[]} */
function nodesOf(words) {
  return words.map((each) => {
    if (typeof each === "string") return new Text(each);
    const [tag, attributes, content] = each;
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (element instanceof HTMLAnchorElement) Object.assign(element, {target: "_blank", rel: "noopener noreferrer"});
    element.append(...nodesOf(content));
    return element;
  });
}

/** Save the shown document, and put a copy where the teacher collects it. */
export async function handIn(overwrite = false) {
  const {tab} = page;
  if (!overwrite && !(await save(tab))) return;
  try {
    const {path, collected} = await store.request("handIn", {tab, overwrite});
    /** @type {TaskPanel | null} */ (document.querySelector("hfsm-task"))?.load();
    if (collected) notify(t("Handed in: your teacher collects {path}.", {path}));
    else await explain(tab, path);
  } catch (error) {
    if (overwrite || !(error instanceof RequestError && error.kind === "exists")) return notifyError(error, {tab});
    const choice = await confirm({
      title: t("Hand in again?"),
      text: t("What you handed in before is replaced."),
      choices: [["again", t("Hand in again"), "primary"]],
    });
    if (choice) await handIn(true);
  }
}

/** Say what to do where nobody collects. @param {number} tab @param {string} path */
async function explain(tab, path) {
  const choice = await confirm({
    title: t("Give it to your teacher"),
    text: t("Nobody collects files on this computer. Your work is saved as {path}: send that file to your teacher.", {
      path,
    }),
    choices: [["download", t("Download it"), "primary"]],
  });
  const done = choice && (await ask("export", {tab}));
  if (done) download(done.name, new Blob([done.text], {type: "application/xml"}));
}

customElements.define("hfsm-task", TaskPanel);
