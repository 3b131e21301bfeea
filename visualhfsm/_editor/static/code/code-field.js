/**
 * A piece of code in a panel: a label, and the editor, which is loaded when the first one is shown.
 *
 * @import {Place} from "../data/protocol.js"
 */

import {LitElement, css, html, nothing} from "lit";
import {properties} from "../data/element.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {step} from "../data/commands.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {messageOf} from "../kit/notices.js";
import {required} from "../kit/existence.js";
import {t} from "../kit/texts.js";
import {Draft, flushEdits} from "./draft.js";
import {commandFor, keyOf, samePlace} from "../data/places.js";

/**
 * The field, with a separate shadow root: the editor's styles affect nothing else, and need no exception from the
 * page's policy.
 */
export class CodeField extends LitElement {
  static properties = {
    ...properties("tab", "place", "text", "failed", "ready"),
    label: {},
    hint: {},
    short: {type: Boolean},
    readonly: {type: Boolean},
  };

  static styles = css`
    :host {
      display: block;
      min-height: 0;
      background: var(--code-background);
    }
    :host([hidden]) {
      display: none;
    }
    .editor {
      height: 100%;
    }
    .editor:empty {
      display: none;
    }
    pre {
      margin: 0;
      padding: 6px 6px 6px 32px;
      font: 13px/1.5 var(--code-font);
      color: var(--code-faint);
      overflow: hidden;
      height: 100%;
      box-sizing: border-box;
      white-space: pre-wrap;
    }
    :host([short]) pre {
      padding-left: 6px;
    }
    .failed {
      padding: 8px;
      color: var(--code-error);
    }
  `;

  constructor() {
    super();
    this.tab = 0;
    /** @type {Place} */
    this.place = {kind: "document"};
    this.text = "";
    this.label = t("Code");
    this.hint = "";
    /** Whether it mostly has one line: then that needs no number. */
    this.short = false;
    this.readonly = false;
    this.failed = "";
    this.ready = false;
  }

  #stop = new AbortController();
  #resolve = () => {};
  /** Resolves when the editor has loaded; replaced whenever the field is shown again. */
  loaded = this.#awaitEditor();

  /** @type {import("./editor.js").Editor | null} exists as long as the field is shown */
  #editor = null;
  #cursor = 0; // its position when the field was last shown
  #draft = new Draft(
    (text, whole) => this.#show(text, whole),
    () => this.#editor?.recheck(), // problems that came before the answer to an edit are those of the text
  );

  connectedCallback() {
    super.connectedCallback();
    const {signal} = (this.#stop = new AbortController());
    store.addEventListener("problems", ({detail}) => detail.tab === this.tab && this.#editor?.recheck(), {signal});
    page.addEventListener("tested", () => this.#editor?.retest(), {signal});
    page.addEventListener("run", () => this.#editor?.closeHelp(), {signal});
    if (this.hasUpdated) this.#load();
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.#stop.abort();
    this.#draft.flush();
    queueMicrotask(() => this.isConnected || this.#unload()); // it may have been moved elsewhere
  }

  render() {
    const {failed, ready} = this;
    if (failed) return html`<div class="failed" role="alert">${failed}</div>`;
    return html`<div class="editor"></div>
      ${ready ? nothing : html`<pre aria-hidden="true" @click=${this.#await}>${this.text}</pre>`}`;
  }

  /** After a click on code that has not loaded, keys wait for it. */
  #await = () =>
    holdKeys(async () => {
      await this.focus();
      return this.#editor ?? undefined;
    });

  willUpdate() {
    this.#draft.take(this.tab, keyOf(this.place), this.text, this.#send(this.place));
  }

  firstUpdated() {
    this.#load();
  }

  updated() {
    this.#editor?.rename(this.label);
  }

  /**
   * Place the cursor in the code, and select a number of characters; line and column from 1.
   *
   * @param {number} line @param {number} [column]
   */
  async goTo(line, column, {length = 0, focus = true} = {}) {
    await this.loaded;
    this.#editor?.goTo(line, column, length);
    if (focus) this.#editor?.focus();
  }

  async focus() {
    await this.loaded;
    this.#editor?.focus();
  }

  /** Select the text, of a quoted one what is between the quotes, so that typing replaces it. */
  async selectValue() {
    await this.loaded;
    this.#editor?.selectValue();
    this.#editor?.focus();
  }

  /** Type a text at the cursor. @param {string} text */
  insert(text) {
    this.#editor?.insert(text);
  }

  /** Press a key at the cursor. @param {import("../kit/waiting-keys.js").Key} key */
  press(key) {
    this.#editor?.press(key);
  }

  /** @param {Place} place @returns {import("./draft.js").Send} */
  #send = (place) => (tab, text, base) => store.do(tab, commandFor(place, text), base);

  async #load() {
    try {
      const {Editor} = await import("./editor.js");
      if (!this.isConnected || this.#editor) return;
      this.#editor = new Editor(required(this.renderRoot.querySelector(".editor"), "place for it"), this.#content(), {
        typed: (text) => this.#draft.type(text),
        undo: () => this.#step("undo"),
        redo: () => this.#step("redo"),
        save: () => page.dispatchEvent(new Event("save")),
        problems: () => this.#problems(),
        tested: (place) => this.#tested(place),
      });
      this.ready = true;
    } catch (error) {
      this.failed = t("The code editor could not be loaded: {reason}", {reason: messageOf(error)});
    }
    this.#resolve();
  }

  /** A hidden editor would keep listening to the page. */
  #unload() {
    if (!this.#editor) return;
    this.#cursor = this.#editor.cursor;
    this.#editor.destroy();
    this.#editor = null;
    this.ready = false;
    this.loaded = this.#awaitEditor();
  }

  /** @returns {Promise<void>} */
  #awaitEditor() {
    return new Promise((resolve) => (this.#resolve = resolve));
  }

  #content() {
    const {tab, place, label, hint, short} = this;
    const readonly = this.readonly || store.isRecorded(tab);
    return {text: this.#draft.text, cursor: this.#cursor, tab, place, label, hint, short, readonly};
  }

  /** @param {string} text @param {boolean} whole */
  #show(text, whole) {
    if (whole) this.#cursor = 0;
    if (!this.#editor) return;
    if (whole) this.#editor.open(this.#content());
    else this.#editor.replace(text);
  }

  #problems() {
    const {problems = [], checked, revision} = store.documents.get(this.tab) ?? {};
    return {items: problems, current: checked === revision && !this.#draft.busy};
  }

  /** What tests passed of the code at a place. @param {Place} place */
  #tested(place) {
    const {tab, code = []} = page.tested ?? {};
    return tab === this.tab ? code.find((each) => samePlace(each.place, place)) : undefined;
  }

  /** Undo or redo typing here, or where nobody else types the last step; one that changed another place is shown there. @param {"undo" | "redo"} op */
  async #step(op) {
    await flushEdits();
    await step(op, this.place);
  }
}

customElements.define("hfsm-code-field", CodeField);
