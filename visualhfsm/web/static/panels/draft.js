/**
 * Texts that are being typed.
 *
 * What is typed is sent to the server after a short pause; the server makes one step for undo of what belongs
 * together. Changes from elsewhere (undo, another window) are shown at once, but never replace what is being typed: the
 * server is sent the text over which it was typed, too, and merges.
 *
 * @import {Done} from "../store.js"
 * @typedef {(tab: number, text: string, base?: string) => Promise<Done>} Send with the text over which it was typed,
 *   if both are to be merged
 */

import {notify, notifyError} from "../notices.js";
import {RequestError, store} from "../store.js";

const PAUSE = 250; // ms
const LONGEST = 1_000_000; // characters, as the server has it (`Code` of visualhfsm/web/protocol.py)

/** @type {Map<string, Piece>} */
const unsaved = (store.unsaved = new Map());

/** Send everything that was typed and is not sent yet; resolves when the document has it. */
export async function flushEdits() {
  await Promise.all([...unsaved.values()].map((piece) => piece.flush()));
}

/**
 * Whether a text is too long to be typed or pasted; says so. What grows beyond is refused in the field.
 *
 * @param {number} length
 */
export function isTooLong(length) {
  if (length <= LONGEST) return false;
  const [count, most] = [length, LONGEST].map((each) => each.toLocaleString("en"));
  notify(
    `That would be ${count} characters, and a text here holds at most ${most}: nothing was changed. ` +
      "Put large code or data into a Python module, and import that as a library.",
    "error",
  );
  return true;
}

// What was typed goes before saving, running, undo and other commands, so that it is part of what they work on.
store.addEventListener("request", () => flushEdits());
addEventListener("pagehide", () => flushEdits());
// What was typed while the server was offline is sent after reconnecting.
store.addEventListener("connection", () => store.online && flushEdits());
store.addEventListener("closed", ({detail}) => {
  for (const piece of unsaved.values()) if (piece.tab === detail.tab) piece.drop();
});

/** One piece of text, until the server has all that was typed. */
class Piece {
  /** Whether something was typed that is not sent. */
  typed = false;
  /** The text of the server of which `text` was made. */
  #base;
  /** Whether it is merged with what others typed; a number or a name is not, letter by letter. */
  merges = true;
  #unanswered = 0;
  #dropped = false;
  /** What was sent when the connection was lost: the document may have it. @type {Set<string>} */
  #lost = new Set();
  #timer = 0;

  /** @param {number} tab @param {string} key @param {string} text @param {Send} send */
  constructor(tab, key, text, send) {
    this.tab = tab;
    this.key = key;
    /** What stands in the field. */
    this.text = text;
    /** What the document has. */
    this.known = text;
    this.#base = text;
    this.send = send;
    /** Show another text; set by the field that shows the piece. @type {() => void} */
    this.show = () => {};
  }

  /** Whether the document does not yet have what stands in the field. */
  get busy() {
    return this.typed || this.#unanswered > 0;
  }

  /** @param {string} text */
  type(text) {
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

  async flush() {
    clearTimeout(this.#timer);
    if (!this.typed || !store.online) return;
    this.typed = false;
    if (this.#lost.has(this.known)) this.#base = this.known;
    const [base, text] = [this.#base, this.text];
    const theirs = this.#unanswered || this.known === base ? text : this.known;
    this.#base = text;
    this.#unanswered += 1;
    let revision = 0;
    try {
      const done = await this.send(this.tab, text, this.merges ? base : undefined);
      this.#lost.clear();
      revision = done.revision;
      if (!this.merges && theirs !== text)
        notify(`Somebody else had written “${theirs}” where you wrote “${text}”, which stays.`);
      if (done.conflict) notify("Somebody else has changed the same words: both versions stand in the text now.");
    } catch (error) {
      if (this.#dropped) return;
      if (error instanceof RequestError && error.kind === "offline") this.#keep(base, text);
      else this.#refuse(error);
    } finally {
      this.#unanswered -= 1;
    }
    // A document that is older than the answer is still on its way, and comes to `take`.
    if (!this.busy && (store.documents.get(this.tab)?.revision ?? 0) >= revision) this.#settle();
  }

  /** Forget what was typed: the document is closed. */
  drop() {
    clearTimeout(this.#timer);
    this.#dropped = true;
    this.typed = false;
    unsaved.delete(this.key);
  }

  /** Go on waiting with what may not have arrived. @param {string} base @param {string} text */
  #keep(base, text) {
    if (!this.#lost.size) this.#base = base; // that of what was sent first
    this.#lost.add(text);
    this.typed = true;
    unsaved.set(this.key, this);
  }

  /** @param {unknown} error */
  #refuse(error) {
    notifyError(error);
    if (this.#unanswered < 2) return;
    // What was sent meanwhile builds on what the server does not have: the text is sent again as a whole.
    this.#base = this.known;
    this.type(this.text);
  }

  /** Show what the document has. */
  #settle() {
    unsaved.delete(this.key);
    this.#base = this.known;
    if (this.text === this.known) return;
    this.text = this.known;
    this.show();
  }
}

/** What a field shows: one piece of text after the other. */
export class Draft {
  #show;
  #piece = new Piece(0, "", "", () => Promise.reject(new Error("there is no piece of text")));

  /** @param {(text: string, whole: boolean) => void} show show another text; `whole`: it is another piece altogether */
  constructor(show) {
    this.#show = show;
  }

  /** What stands in the field. */
  get text() {
    return this.#piece.text;
  }

  /** Whether the document does not yet have what stands in the field. */
  get busy() {
    return this.#piece.busy;
  }

  /**
   * Say what the document has.
   *
   * @param {number} tab
   * @param {string} key which piece of text it is
   * @param {string} text
   * @param {Send} send
   */
  take(tab, key, text, send, merges = true) {
    const whole = `${tab} ${key}`;
    if (whole === this.#piece.key) {
      Object.assign(this.#piece, {send, merges});
      if (text !== this.#piece.known) this.#piece.take(text);
      return;
    }
    this.flush();
    this.#piece.show = () => {};
    // One that was left before the server had it is gone on with.
    const piece = (this.#piece = unsaved.get(whole) ?? new Piece(tab, whole, text, send));
    piece.merges = merges;
    piece.take(text);
    piece.show = () => this.#show(piece.text, false);
    this.#show(piece.text, true);
  }

  /** Say what was typed. @param {string} text */
  type(text) {
    if (text !== this.#piece.text) this.#piece.type(text);
  }

  /** Send what was typed, if anything was. */
  flush() {
    return this.#piece.flush();
  }
}
