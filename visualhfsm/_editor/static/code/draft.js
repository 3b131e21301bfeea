/**
 * Texts that are being typed.
 *
 * Typed text is sent to the server after a short pause; the server combines related changes in one undo step. Changes
 * from elsewhere (undo, another window) are shown at once, but never replace text that is being typed: the server also
 * gets the text in which it was typed, and merges both.
 *
 * @import {Done} from "../data/protocol.js"
 * @typedef {(tab: number, text: string, base?: string) => Promise<Done>} Send with the text in which it was typed,
 *   if both are to be merged
 */

import {notify, notifyError, clearErrors} from "../kit/notices.js";
import {page} from "../data/page.js";
import {RequestError, store} from "../data/store.js";
import {decimal, t} from "../kit/texts.js";
import {keepTyped} from "./typed-offline.js";

const PAUSE = 250; // ms
const LONGEST = 1_000_000; // characters, the limit of the server (`Code` of visualhfsm/_editor/protocol.py)

/** @type {Map<string, Piece>} */
const unsaved = (store.unsaved = new Map());

/** Send all unsent text; resolves when the document contains it. */
export async function flushEdits() {
  await Promise.all([...unsaved.values()].map((piece) => piece.flush()));
}

/**
 * Whether a text is too long to be typed or pasted; shows a notice then. The field refuses the change.
 *
 * @param {number} length
 */
export function isTooLong(length) {
  if (length <= LONGEST) return false;
  const [count, most] = [length, LONGEST].map((each) => decimal(each, 0));
  notify(
    t(
      "That would be {count} characters, but a text here holds at most {most}: nothing was changed. " +
        "Put large code or data into a Python module, and import that as a library.",
      {count, most},
    ),
    "error",
    undefined,
    {tab: page.tab, about: `length ${page.tab}`}, // not of an edit: the answer to an earlier one would remove it
  );
  return true;
}

// Typed text is sent before saving, running, undo and other commands, so that they include it.
store.addEventListener("request", () => flushEdits());
addEventListener("pagehide", () => flushEdits());
// Text typed while the server was offline is sent after reconnecting.
store.addEventListener("connection", () => store.online && flushEdits());
// After a restart of the editor the page is loaded again, and sends it then.
store.addEventListener("restarted", () =>
  keepTyped([...unsaved.values()].filter((each) => each.typed).map((each) => each.kept)),
);
store.addEventListener("closed", ({detail}) => {
  for (const piece of unsaved.values()) if (piece.tab === detail.tab) piece.drop();
});

/** One piece of text, until the server has all typed text. */
class Piece {
  /** Whether there is typed text that was not sent. */
  typed = false;
  /** The server's text from which `text` was made. */
  #base;
  /** Whether it is merged with what others typed; numbers and names are not merged letter by letter. */
  merges = true;
  #unanswered = 0;
  /** Resolves when the server has what was sent last. */
  #sent = Promise.resolve();
  #dropped = false;
  /** Texts that were sent when the connection was lost: the document may contain them. @type {Set<string>} */
  #lost = new Set();
  #timer = 0;

  /** @param {number} tab @param {string} key @param {string} text @param {Send} send */
  constructor(tab, key, text, send) {
    this.tab = tab;
    this.key = key;
    /** The text in the field. */
    this.text = text;
    /** The text in the document. */
    this.known = text;
    this.#base = text;
    this.send = send;
    /** Show another text; set by the field that shows the piece. @type {() => void} */
    this.show = () => {};
    /** Say that the document has what stands in the field; set in the same way. @type {() => void} */
    this.settled = () => {};
  }

  /** Whether the document does not yet have what stands in the field. */
  get busy() {
    return this.typed || this.#unanswered > 0;
  }

  /** What is kept of it, to be sent to the editor that is started again. @returns {import("./typed-offline.js").Piece} */
  get kept() {
    const {tab, text, send} = this;
    return {tab, text, send, base: this.merges ? this.#base : undefined, lost: [...this.#lost]};
  }

  /** @param {string} text */
  type(text) {
    clearErrors(`length ${this.tab}`);
    this.text = text;
    this.typed = true;
    unsaved.set(this.key, this);
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.flush(), PAUSE);
  }

  /** @param {string} text that the document has now */
  take(text) {
    this.known = text;
    if (!this.busy) this.#settle();
  }

  /** Send what was typed; resolves when the server has that, and what was sent before. */
  flush() {
    clearTimeout(this.#timer);
    if (this.typed && store.online) this.#sent = this.#sendTyped();
    return this.#sent;
  }

  async #sendTyped() {
    this.typed = false;
    if (this.#lost.has(this.known)) this.#base = this.known;
    const [base, text] = [this.#base, this.text];
    const theirs = this.#unanswered || this.known === base ? text : this.known;
    this.#base = text;
    this.#unanswered += 1;
    let revision = 0;
    try {
      const done = await this.send(this.tab, text, this.merges ? base : undefined);
      clearErrors(`edit ${this.tab}`);
      this.#lost.clear();
      revision = done.revision;
      if (!this.merges && theirs !== text)
        notify(t("Somebody else wrote “{theirs}” where you wrote “{text}”. Yours is kept.", {theirs, text}));
      if (done.conflict) notify(t("Somebody else changed the same words: the text now contains both versions."));
    } catch (error) {
      if (this.#dropped) return;
      if (error instanceof RequestError && error.kind === "offline") this.#keep(base, text);
      else this.#refuse(error);
    } finally {
      this.#unanswered -= 1;
    }
    // If the document is older than the answer, a newer one will arrive in `take`.
    if (!this.busy && (store.documents.get(this.tab)?.revision ?? 0) >= revision) this.#settle();
  }

  /** Forget the typed text: the document is closed. */
  drop() {
    clearTimeout(this.#timer);
    this.#dropped = true;
    this.typed = false;
    unsaved.delete(this.key);
  }

  /** Keep a text that may not have arrived, to send it again. @param {string} base @param {string} text */
  #keep(base, text) {
    if (!this.#lost.size) this.#base = base; // the base of the first text that was sent
    this.#lost.add(text);
    this.typed = true;
    unsaved.set(this.key, this);
  }

  /** @param {unknown} error */
  #refuse(error) {
    notifyError(error, {tab: this.tab, about: `edit ${this.tab}`});
    if (this.#unanswered < 2) return;
    // Texts sent meanwhile are based on one that the server refused: the whole text is sent again.
    this.#base = this.known;
    this.type(this.text);
  }

  /** Show the text of the document. */
  #settle() {
    unsaved.delete(this.key);
    this.#base = this.known;
    if (this.text !== this.known) {
      this.text = this.known;
      this.show();
    }
    this.settled();
  }
}

/** The text of a field, which shows one piece of text after the other. */
export class Draft {
  #show;
  #settled;
  #piece = new Piece(0, "", "", () => Promise.reject(new Error("there is no piece of text")));

  /**
   * @param {(text: string, whole: boolean) => void} show shows another text; `whole`: of another piece
   * @param {() => void} [settled] the document has what stands in the field
   */
  constructor(show, settled = () => {}) {
    this.#show = show;
    this.#settled = settled;
  }

  /** The text in the field. */
  get text() {
    return this.#piece.text;
  }

  /** Whether the document does not yet have what stands in the field. */
  get busy() {
    return this.#piece.busy;
  }

  /**
   * Set the text of the document.
   *
   * @param {number} tab
   * @param {string} key which piece of text it is
   * @param {string} text @param {Send} send
   */
  take(tab, key, text, send, merges = true) {
    const whole = `${tab} ${key}`;
    if (whole === this.#piece.key) {
      Object.assign(this.#piece, {send, merges});
      if (text !== this.#piece.known) this.#piece.take(text);
      return;
    }
    this.flush();
    this.#piece.show = this.#piece.settled = () => {};
    // Continue with a piece that was left before the server had it.
    const piece = (this.#piece = unsaved.get(whole) ?? new Piece(tab, whole, text, send));
    piece.merges = merges;
    piece.take(text);
    piece.show = () => this.#show(piece.text, false);
    piece.settled = this.#settled;
    this.#show(piece.text, true);
  }

  /** Report the typed text. @param {string} text */
  type(text) {
    if (text !== this.#piece.text) this.#piece.type(text);
  }

  /** Send the typed text, if there is any. */
  flush() {
    return this.#piece.flush();
  }
}
