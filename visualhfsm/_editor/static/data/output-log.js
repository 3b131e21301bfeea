/** The last lines that the components of the open tabs wrote; they are kept while nothing shows them. */

import {store} from "./store.js";
import {decimal, n} from "../kit/texts.js";

const KEPT = 5000; // lines of a tab
const LONGEST = 1_000_000; // characters of these lines
/** The beginning of the line with which a component says why it cannot start. */
const REFUSED = /^[^ :]+: error: /;
/** The line below a traceback. */
const EXCEPTION = /^[A-Za-z_][\w.]*(Error|Exception|Interrupt|Exit)\b/;

/**
 * @typedef {{lines: {tab: number, lines: Line[]}, reset: {tab: number}}} LogEvents
 * @typedef {{text: string, stream: "out" | "err", place?: import("./protocol.js").Place | null, line?: number}} Line
 */

/** Events: `lines` {tab, lines}, `reset` {tab}. */
class OutputLog extends /** @type {new () => import("../kit/events.js").Target<LogEvents>} */ (EventTarget) {
  /** @type {Map<number, Line[]>} */
  #lines = new Map();
  /** Characters of the lines of a tab. @type {Map<number, number>} */
  #sizes = new Map();

  constructor() {
    super();
    store.addEventListener("output", ({detail}) => this.#take(detail));
    store.addEventListener("closed", ({detail}) => this.#forget(detail.tab));
  }

  /** The lines of a tab. @returns {Line[]} @param {number} tab */
  of(tab) {
    return this.#lines.get(tab) ?? [];
  }

  /**
   * The message of the last error that the component of a tab reported, wherever that is.
   *
   * @returns {string | undefined}
   * @param {number} tab
   */
  lastError(tab) {
    const found = this.of(tab).findLast(({text}) => REFUSED.test(text) || EXCEPTION.test(text));
    return found?.text.replace(REFUSED, "");
  }

  /** @param {number} tab */
  clear(tab) {
    this.#forget(tab);
    this.#emit("reset", {tab});
  }

  /** @param {import("./protocol.js").OutputPush} output */
  #take({tab, lines, dropped = 0, whole = false}) {
    if (whole) this.clear(tab);
    /** @type {Line[]} */
    const fresh = dropped ? [{text: leftOut(dropped), stream: "err"}, ...lines] : lines;
    const kept = this.of(tab);
    kept.push(...fresh);
    let size = (this.#sizes.get(tab) ?? 0) + sizeOf(fresh);
    let excess = Math.max(0, kept.length - KEPT);
    size -= sizeOf(kept.slice(0, excess));
    while (size > LONGEST) size -= kept[excess++].text.length;
    kept.splice(0, excess);
    this.#lines.set(tab, kept);
    this.#sizes.set(tab, size);
    this.#emit("lines", {tab, lines: fresh});
  }

  /** @param {number} tab */
  #forget(tab) {
    this.#lines.delete(tab);
    this.#sizes.delete(tab);
  }

  /** @param {keyof LogEvents} kind @param {object} detail */
  #emit(kind, detail) {
    this.dispatchEvent(new CustomEvent(kind, {detail}));
  }
}

/** @param {number} lines */
const leftOut = (lines) =>
  n("… {lines} line left out …", "… {lines} lines left out …", lines, {lines: decimal(lines, 0)});

/** @param {Line[]} lines */
const sizeOf = (lines) => lines.reduce((size, {text}) => size + text.length, 0);

export const outputLog = new OutputLog();
