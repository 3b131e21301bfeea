/**
 * The small parts around the canvas: tabs, breadcrumbs, banners and the line of status.
 *
 * @import {HfsmCanvas} from "../canvas/canvas.js"
 * @import {From} from "../data/element.js"
 * @import {Target} from "../kit/events.js"
 * @import {Automaton} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {selectionTitle} from "./actions.js";
import {ask} from "../data/commands.js";
import {PageElement} from "../data/element.js";
import {importLink} from "../data/import-link.js";
import {icon, iconButton} from "../kit/icons.js";
import {keyOf, spoken} from "../kit/keys.js";
import {monitor} from "../run/monitor.js";
import {page} from "../data/page.js";
import {perform} from "../kit/registry.js";
import {viewing} from "../kit/viewers.js";
import {store} from "../data/store.js";
import {folderOf, partsOf} from "../data/tab-names.js";
import {language, n, rich, t, visible} from "../kit/texts.js";
import {copyUnsent, unsentBanner} from "../data/unsent.js";

class Tabs extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["document", "workspace", "connection"]};
  static properties = {overflows: {state: true}};

  #revealed = 0;
  #count = 0; // of the tabs when they were last measured
  /** Looks whether all tabs are visible. */
  #sizes = new ResizeObserver(() => this.#measure());

  constructor() {
    super();
    /** Whether some tabs are out of view. */
    this.overflows = false;
  }

  render() {
    const {tabs} = store.workspace;
    return html`<div role="tablist" aria-label=${t("Open documents")} @keydown=${this.#key}>
        ${tabs.map((each) => {
          const folder = folderOf(each, tabs);
          const [start, end] = partsOf(each, tabs);
          const name = visible([each.title, folder, each.dirty && t("not saved")].filter(Boolean).join(" "));
          return html`<div class="tab ${each.tab === page.tab ? "chosen" : ""}" role="presentation">
            <button
              type="button"
              role="tab"
              aria-label=${name}
              aria-selected=${each.tab === page.tab}
              tabindex=${each.tab === page.tab ? 0 : -1}
              title=${each.recording ? t("Recording {recording}", {recording: each.recording}) : visible(each.path) || t("not saved yet")}
              @click=${(/** @type {MouseEvent} */ {detail}) => this.#show(each.tab, detail > 0)}
              @auxclick=${(/** @type {MouseEvent} */ event) => event.button === 1 && this.#close(each.tab)}
            >
              ${each.recording ? icon("film") : nothing}<span class="text"
                ><span class="name-start">${visible(start)}</span><span class="name-end">${visible(end)}</span>${
                  folder && html`<span class="faint"> ${visible(folder)}</span>`
                }</span
              >${
                each.dirty
                  ? html`<span class="dirty" role="img" aria-label=${t("not saved")} title=${t("not saved")}></span>`
                  : nothing
              }
            </button>
            ${
              viewing.on
                ? nothing
                : html`<span
                    class="close-tab"
                    aria-hidden="true"
                    title=${t("Close {title} ({key}, or {other})", {title: each.title, key: spoken("Delete"), other: keyOf("closeTab")})}
                    @click=${() => this.#close(each.tab)}
                    >${icon("close")}</span
                  >`
            }
          </div>`;
        })}
      </div>
      ${
        this.overflows
          ? html`<button
              type="button"
              class="all-tabs"
              aria-label=${n("The document", "All {count} documents", tabs.length)}
              title=${n("The document", "All {count} documents", tabs.length)}
              aria-haspopup="menu"
              aria-expanded="false"
              @click=${this.#list}
            >
              ${icon("chevron")}${tabs.length}
            </button>`
          : nothing
      }
      ${
        viewing.on
          ? nothing
          : iconButton("add", t("Start page"), () => page.show(0), {title: t("Start page: open or create a document")})
      }`;
  }

  firstUpdated() {
    const list = this.querySelector("[role=tablist]");
    if (list) this.#sizes.observe(list);
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.#sizes.disconnect();
  }

  get #hidesTabs() {
    const list = this.querySelector("[role=tablist]");
    return Boolean(list && list.scrollHeight > list.clientHeight);
  }

  #measure() {
    this.overflows = this.#hidesTabs;
    if (this.overflows) this.#reveal();
  }

  #reveal() {
    const chosen = this.querySelector(".tab.chosen"); // missing until the workspace has arrived
    chosen?.scrollIntoView({block: "nearest"});
    this.#revealed = chosen ? page.tab : 0;
  }

  /** A menu of all documents. @param {MouseEvent & From<HTMLElement>} event */
  #list = async ({currentTarget: button}) => {
    const {tabs} = store.workspace;
    const items = tabs.map((each) => ({
      id: String(each.tab),
      label: visible(each.title + (folderOf(each, tabs) && ` (${folderOf(each, tabs)})`)) + (each.dirty ? " •" : ""),
      icon: each.recording ? "film" : "file",
      checked: () => each.tab === page.tab,
      run: () => page.show(each.tab),
    }));
    (await import("./menu.js")).dropMenu(button, {groups: [items], label: t("Open documents")}, this.context);
  };

  updated() {
    if (this.#revealed === page.tab && this.#count === store.workspace.tabs.length) return;
    this.#count = store.workspace.tabs.length;
    this.#reveal(); // which makes the browser lay out everything at once
    this.overflows = this.#hidesTabs;
  }

  /** Show a document; after a click its drawing has the keys. @param {number} tab @param {boolean} isClicked */
  async #show(tab, isClicked) {
    page.show(tab);
    if (!isClicked) return;
    const {app, canvas} = this.context;
    await app.updateComplete; // the start page is gone
    canvas.surface.focus({preventScroll: true});
  }

  /** @param {number} tab */
  async #close(tab) {
    if (viewing.on) return;
    (await import("../data/files.js")).closeTab(tab);
  }

  /** @param {KeyboardEvent} event */
  async #key(event) {
    if (event.key === "Delete") {
      event.preventDefault();
      await this.#close(page.tab);
      return;
    }
    const step = /** @type {Record<string, number>} */ ({ArrowRight: 1, ArrowLeft: -1})[event.key];
    if (!step) return;
    event.preventDefault();
    this.context.app.showNeighbor(step);
    await this.updateComplete;
    /** @type {HTMLElement | null} */ (this.querySelector('[aria-selected="true"]'))?.focus();
  }
}

const MOST_CRUMBS = 4; // automata of a path that are shown; the middle of a longer one is a list

class Breadcrumbs extends PageElement {
  render() {
    const {path} = page;
    const hidden = path.length > MOST_CRUMBS ? path.slice(1, 2 - MOST_CRUMBS) : [];
    const current = path.at(-1);
    return html`<nav aria-label=${t("Path to the shown automaton")}>
        <ol>
          ${path.map((automaton) => {
            if (automaton === hidden[0]) return html`<li>${this.#between(hidden)}</li>`;
            if (hidden.includes(automaton)) return nothing;
            const title = visible(page.title(automaton));
            return automaton === current
              ? html`<li class="current"><span aria-current="location" title=${title}>${title}</span></li>`
              : html`<li>
                  <button type="button" title=${title} @click=${() => page.open(automaton.id)}>${title}</button>
                </li>`;
          })}
        </ol>
      </nav>
      ${this.#siblings()}`;
  }

  /** The list of the automata in the middle of a long path. @param {Automaton[]} hidden */
  #between(hidden) {
    return html`<select
      aria-label=${n("{count} automaton between", "{count} automata between", hidden.length)}
      title=${visible(hidden.map((automaton) => page.title(automaton)).join(" / "))}
      @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => page.open(Number(target.value))}
    >
      <option selected disabled hidden>…</option>
      ${hidden.map((automaton) => html`<option value=${automaton.id}>${visible(page.title(automaton))}</option>`)}
    </select>`;
  }

  /** Automata that run beside the shown one, below the same state. */
  #siblings() {
    const {automaton, document} = page;
    const owner =
      automaton &&
      document?.automata.get(automaton.father)?.states.find((state) => state.children.includes(automaton.id));
    if (!owner || owner.children.length < 2) return nothing;
    return html`<div class="siblings" role="group" aria-label=${t("Automata of {name}", {name: owner.name})}>
      ${owner.children.map(
        (id, index) =>
          html` <button
            type="button"
            aria-pressed=${id === automaton.id}
            title=${t("Automaton {number} of {name}", {number: index + 1, name: owner.name})}
            @click=${() => page.open(id)}
          >
            ${index + 1}
          </button>`,
      )}
    </div>`;
  }
}

class Status extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["document", "workspace", "problems", "connection", "started"]};

  firstUpdated() {
    this.listen(/** @type {Target<{view: null}>} */ (this.context.canvas), "view", () => this.#showZoom());
  }

  updated() {
    this.#showZoom();
  }

  render() {
    const {document, automaton} = page;
    if (!document) return store.online ? nothing : html`<span>${t("Connecting")}</span>`;
    const {error: errors = 0, warning: warnings = 0} = document.counts;
    const about =
      selectionTitle() ||
      [
        n("{count} state", "{count} states", automaton?.states.length ?? 0),
        n("{count} transition", "{count} transitions", automaton?.transitions.length ?? 0),
      ].join(", ");
    return html` <button
        type="button"
        class="problem-count ${errors ? "error" : warnings ? "warning" : "none"}"
        title=${t("Problems")}
        @click=${() => perform("problems", this.context)}
      >
        ${icon(errors + warnings ? "problems" : "properties")}${
          errors + warnings
            ? [
                errors && n("{count} error", "{count} errors", errors),
                warnings && n("{count} warning", "{count} warnings", warnings),
              ]
                .filter(Boolean)
                .join(", ")
            : t("No problems")
        }
      </button>
      <span class="about" title=${about}>${about}</span>
      ${automaton?.imported ? html`<span>${rich("from {file}", {file: importLink(automaton.imported.file)})}</span>` : nothing}
      ${
        automaton?.states.length || !automaton?.imported
          ? html`<span class="period" title=${t("Time between two cycles of this automaton")}
              >${t("every {period} ms", {period: automaton?.period.trim() || "?"})}</span
            >`
          : nothing
      }
      <span class="room"></span>
      ${
        document.undo.length
          ? html`<span class="last-step" title=${t("The last step; it can be undone")}>${document.undo[0].name}</span>`
          : nothing
      }
      <span class="zoom"></span>
      ${store.online ? nothing : html`<span class="connection">${t("Editor offline")}</span>`}`;
  }

  #showZoom() {
    const element = this.querySelector(".zoom");
    if (element) element.textContent = `${Math.round(this.context.canvas.viewport.scale * 100)} %`;
  }
}

/**
 * Banners above everything until their cause is resolved: the server is offline, the robot is stopped, another program
 * changed a file, changes were not saved, or typed text was not sent.
 *
 * @param {import("../kit/registry.js").Context} context
 */
export function banner({app, canvas}) {
  if (!store.online && store.offlineSince) {
    const since = new Date(store.offlineSince).toLocaleTimeString(language);
    const isOver = viewing.on && store.refused;
    return html`<div class="banner error ${viewing.on ? "looking" : ""}" role="alert">
      ${isOver ? nothing : t("No connection since {since}.", {since})} ${store.whyOffline}
      ${isOver ? nothing : html`<button type="button" @click=${() => store.connect()}>${t("Try now")}</button>`}
      ${copyUnsent()}
    </div>`;
  }
  if (viewing.on)
    return html`<div class="banner looking" role="status">
      <strong class="read-only">${icon("eye")}${t("Read only")}</strong>
      <span class="words">${t("You look on: you see every change and run, and can change nothing. STOP works.")}</span>
    </div>`;
  return html`${stoppedBanner()}${unsentBanner(() => app.requestUpdate())}${fileBanner(canvas)}`;
}

/** The robot refuses commands until the operator has checked it and resets the stop. */
function stoppedBanner() {
  const reason = store.robot.stopped;
  if (!reason) return nothing;
  return html`<div class="banner error" role="alert">
    ${t("The robot is stopped and refuses commands: {reason}.", {reason})}
    <button type="button" @click=${() => ask("resetEmergencyStop")}>${t("Reset the emergency stop")}</button>
  </div>`;
}

/** The recording that contains the shown, read-only document. @param {string} path @param {HfsmCanvas} canvas */
function recordingBanner(path, canvas) {
  const plays = monitor.recording?.tab === page.tab;
  return html`<div class="banner recorded" role="status">
    ${t("This is the document of the recording {path}. It cannot be changed.", {path})}
    ${
      plays
        ? html`<button type="button" @click=${async () => (await recordings()).compareRecorded(canvas)}>
            ${t("Compare with {file}", {file: monitor.structure?.document || t("its file")})}
          </button>`
        : html`<button type="button" @click=${async () => (await recordings()).play(path)}>${t("Play it")}</button>`
    }
    <button type="button" @click=${async () => (await import("../data/files.js")).saveAs()}>${t("Save a copy")}</button>
  </div>`;
}

const recordings = () => import("../run/documents.js");

/** The file of the shown document. @param {HfsmCanvas} canvas */
function fileBanner(canvas) {
  if (page.tabState?.recording) return recordingBanner(page.tabState.recording, canvas);
  const outside = page.tabState?.outside;
  if (!outside) return unsavedBanner();
  return html`<div class="banner" role="alert">
    ${
      outside === "deleted"
        ? t("Another program deleted the file of {title}.", {title: page.tabState?.title})
        : t("Another program changed the file of {title}.", {title: page.tabState?.title})
    }
    ${
      outside === "deleted"
        ? nothing
        : html`<button type="button" @click=${() => resolve("merge")}>${t("Merge both")}</button
            ><button type="button" @click=${() => resolve("theirs")}>${t("Take theirs")}</button>`
    }
    <button type="button" @click=${() => resolve("mine")}>${t("Keep mine")}</button>
  </div>`;
}

/** @param {"mine" | "theirs" | "merge"} choice */
const resolve = async (choice) => (await import("../data/files.js")).resolve(choice);

/** Changes to the shown file from a session that ended without saving them. */
function unsavedBanner() {
  const path = page.tabState?.path;
  const lost = path && store.workspace.recoverable.find((each) => each.path === path);
  if (!lost || store.restarted) return nothing;
  return html`<div class="banner" role="alert">
    ${t("Changes to {title} of {time} were not saved when the editor ended.", {
      title: page.tabState?.title,
      time: new Date(lost.changedAt * 1000).toLocaleString(language),
    })}
    <button type="button" @click=${async () => (await import("../data/files.js")).recover(lost.journal)}>
      ${t("Recover them")}
    </button>
    <button type="button" @click=${() => ask("discard", {journal: lost.journal})}>${t("Discard them")}</button>
  </div>`;
}

/** Let no pinch zoom the page, on a trackpad or a screen: STOP would leave the window. The keys still zoom it. */
export function keepStopInView() {
  document.documentElement.classList.add("no-pinch");
  addEventListener("wheel", (event) => event.ctrlKey && event.preventDefault(), {passive: false});
}

customElements.define("hfsm-tabs", Tabs);
customElements.define("hfsm-breadcrumbs", Breadcrumbs);
customElements.define("hfsm-status", Status);
