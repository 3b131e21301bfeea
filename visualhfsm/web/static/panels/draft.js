/**
 * Texts that are being typed.
 *
 * What is typed is sent to the server after a short pause; the server makes one step for undo of what belongs
 * together. Changes from elsewhere (undo, another window) are shown at once, but never replace what is being typed.
 *
 * @import {Done} from "../store.js"
 */

import {notifyError} from "../notices.js";
import {RequestError, store} from "../store.js";

const PAUSE = 250; // ms

/** @type {Set<Draft>} */
const waiting = new Set();

/** Send everything that was typed and is not sent yet; resolves when the document has it. */
export async function flushEdits() {
  await Promise.all([...waiting].map((draft) => draft.flush()));
}

// What was typed goes before saving, running, undo and other commands, so that it is part of what they work on.
store.addEventListener("request", () => flushEdits());
addEventListener("pagehide", () => flushEdits());
// What was typed while the server was offline is sent after reconnecting.
store.addEventListener("connection", () => store.online && flushEdits());

export class Draft {
  /** What stands in the field. */
  text = "";

  #show;
  /** @type {(tab: number, text: string) => Promise<Done>} */
  #send = () => Promise.reject(new Error("there is no piece of text"));
  #tab = 0;
  #key = "";
  #known = "";
  #typed = false;
  #timer = 0;
  #sending = 0;

  /** @param {(text: string, whole: boolean) => void} show show another text; `whole`: it is another piece altogether */
  constructor(show) {
    this.#show = show;
  }

  /**
   * Say what the document has.
   *
   * @param {number} tab
   * @param {string} key which piece of text it is
   * @param {string} text
   * @param {(tab: number, text: string) => Promise<Done>} send
   */
  take(tab, key, text, send) {
    if (tab !== this.#tab || key !== this.#key) {
      this.flush();
      this.#tab = tab;
      this.#key = key;
      this.#send = send;
      this.#known = text;
      this.#replace(text, true);
      return;
    }
    this.#send = send;
    if (text === this.#known) return;
    this.#known = text;
    if (!this.busy) this.#replace(text, false);
  }

  /** Say what was typed. @param {string} text */
  type(text) {
    if (text === this.text) return;
    this.text = text;
    this.#typed = true;
    waiting.add(this);
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.flush(), PAUSE);
  }

  /** Send what was typed, if anything was. */
  async flush() {
    clearTimeout(this.#timer);
    waiting.delete(this);
    if (!this.#typed) return;
    this.#typed = false;
    const [tab, key] = [this.#tab, this.#key];
    this.#sending += 1;
    let revision = 0;
    try {
      revision = (await this.#send(tab, this.text)).revision;
    } catch (error) {
      if (error instanceof RequestError && error.kind === "offline") this.#keep(tab, key);
      else notifyError(error);
    } finally {
      this.#sending -= 1;
    }
    const isSame = tab === this.#tab && key === this.#key;
    // A document that is older than the answer is still on its way, and shown by `take`.
    if (isSame && !this.busy && (store.documents.get(tab)?.revision ?? 0) >= revision)
      this.#replace(this.#known, false);
  }

  /** Go on waiting with what could not be sent. @param {number} tab @param {string} key */
  #keep(tab, key) {
    if (tab !== this.#tab || key !== this.#key) return;
    this.#typed = true;
    waiting.add(this);
  }

  /** Whether the document does not yet have what stands in the field. */
  get busy() {
    return this.#typed || this.#sending > 0;
  }

  /** @param {string} text @param {boolean} whole */
  #replace(text, whole) {
    if (text === this.text && !whole) return;
    this.text = text;
    this.#show(text, whole);
  }
}
