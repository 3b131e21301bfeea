/** The last lines that the components of the open tabs wrote; they are kept while nothing shows them. */

import {store} from "../store.js";

const KEPT = 5000; // lines of a tab
/** The pattern of an error in the component's log: the text before the message, and the file and line after it. */
const BEFORE = /^[\d-]+ [\d:.]+ ERROR +[^:]+: /;
const BEHIND = / at \S+:\d+ \(\S+:\d+\)$/;
/** The line below a traceback. */
const EXCEPTION = /^[A-Za-z_][\w.]*(Error|Exception|Interrupt|Exit)\b/;

/**
 * @typedef {{lines: {tab: number, lines: Line[]}, reset: {tab: number}}} LogEvents
 * @typedef {{text: string, stream: "out" | "err", place?: import("../store.js").Place | null, line?: number}} Line
 */

/** Events: `lines` {tab, lines}, `reset` {tab}. */
class OutputLog extends /** @type {new () => import("../store.js").Target<LogEvents>} */ (EventTarget) {
  /** @type {Map<number, Line[]>} */
  #lines = new Map();

  constructor() {
    super();
    store.addEventListener("output", ({detail}) => this.#take(detail));
    store.addEventListener("closed", ({detail}) => this.#lines.delete(detail.tab));
  }

  /** The lines of a tab. @returns {Line[]} @param {number} tab */
  of(tab) {
    return this.#lines.get(tab) ?? [];
  }

  /**
   * The last error that the component of a tab reported, with its place in the code if it has one.
   *
   * @returns {Line | undefined}
   * @param {number} tab
   */
  lastError(tab) {
    const lines = this.of(tab);
    const logged =
      lines.findLast(({text, place}) => place && BEFORE.test(text)) ?? lines.findLast(({text}) => EXCEPTION.test(text));
    return logged && {...logged, text: logged.text.replace(BEFORE, "").replace(BEHIND, "")};
  }

  /** @param {number} tab */
  clear(tab) {
    this.#lines.delete(tab);
    this.#emit("reset", {tab});
  }

  /** @param {import("../store.js").Output} output */
  #take({tab, lines, dropped = 0, whole = false}) {
    if (whole) this.clear(tab);
    /** @type {Line[]} */
    const fresh = dropped ? [{text: `… ${dropped} lines left out …`, stream: "err"}, ...lines] : lines;
    const kept = this.of(tab);
    kept.push(...fresh);
    if (kept.length > KEPT) kept.splice(0, kept.length - KEPT);
    this.#lines.set(tab, kept);
    this.#emit("lines", {tab, lines: fresh});
  }

  /** @param {keyof LogEvents} kind @param {object} detail */
  #emit(kind, detail) {
    this.dispatchEvent(new CustomEvent(kind, {detail}));
  }
}

export const outputLog = new OutputLog();
