/**
 * The breakpoints of the followed component, those that it had before a restart, and those for components that do not
 * run yet.
 */

import {Sequence} from "../kit/sequence.js";
import {browserStorage} from "../kit/location.js";
import {store} from "../data/store.js";

/** @import {Breakpoint} from "../data/protocol.js" */

const KEPT = "visualhfsm.breakpoints";
const MOST_DOCUMENTS = 50;

/**
 * Breakpoints of the followed component, which are `all`, and those that are planned for the component of another tab.
 */
export class Breakpoints {
  /** @type {Breakpoint[]} */
  all = [];
  /** @type {Breakpoint[]} */
  #former = [];
  #monitor;
  /** The changes: each begins with the result of the one before it. */
  #changes = new Sequence();

  /** @param {typeof import("./monitor.js").monitor} monitor */
  constructor(monitor) {
    this.#monitor = monitor;
  }

  /** Whether those of a tab are kept for later: its component is not known yet, or has ended. @param {number} tab */
  arePlanned(tab) {
    const {isKnown, isOver, tab: followed} = this.#monitor;
    return !isKnown || isOver || followed !== tab;
  }

  /** The breakpoints of the component of a tab, or those planned for it. @param {number} tab */
  of(tab) {
    return this.arePlanned(tab) ? planned.of(tab) : this.all;
  }

  /**
   * Set a breakpoint with a condition, "" for always, or remove it with undefined.
   *
   * @param {"state" | "transition"} kind
   * @param {number} tab
   * @param {number} automaton
   * @param {number} id
   * @param {string | undefined} condition
   */
  set(tab, automaton, kind, id, condition) {
    return this.#changes.add(async () => {
      const all = withBreakpoint(this.of(tab), automaton, kind, id, condition);
      if (!this.arePlanned(tab)) {
        await this.#replace(all);
        return;
      }
      planned.set(tab, all);
      planned.late.push({tab, automaton, kind, id});
      this.#notify();
    });
  }

  /** Set those that were planned for the component after its start, once it is known. */
  catchUp() {
    const {tab, steers} = this.#monitor;
    if (!steers || this.arePlanned(tab)) return;
    for (const {automaton, kind, id} of planned.takeLate(tab))
      this.set(tab, automaton, kind, id, breakpointAt(planned.of(tab), automaton, kind, id)?.condition);
  }

  /** @param {Breakpoint[]} breakpoints */
  async #replace(breakpoints) {
    const monitor = this.#monitor;
    if ((await monitor.steer("setBreakpoints", {breakpoints})) === undefined) return;
    if (monitor.breakpoints !== this) return; // another component is followed by now
    this.all = breakpoints;
    if (monitor.tab) planned.set(monitor.tab, breakpoints);
    this.#notify();
  }

  #notify() {
    for (const kind of ["structure", "shown"]) this.#monitor.dispatchEvent(new Event(kind));
  }

  /** Keep the breakpoints of a component that has ended. */
  keep() {
    if (this.all.length) this.#former = this.all;
    this.all = [];
  }

  /**
   * Restore the kept breakpoints whose elements still exist.
   *
   * @param {{has: (breakpoint: Breakpoint) => boolean}} structure
   */
  restore(structure) {
    return this.#changes.add(async () => {
      const kept = this.#former.filter(
        (each) => structure.has(each) && !this.all.some((other) => areAtOne(each, other)),
      );
      if (kept.length) await this.#replace([...this.all, ...kept]);
    });
  }
}

/** @param {Breakpoint} one @param {Breakpoint} other */
const areAtOne = (one, other) =>
  one.automaton === other.automaton && one.state === other.state && one.transition === other.transition;

/**
 * The breakpoint of a state or transition.
 *
 * @param {Breakpoint[]} all @param {"state" | "transition"} kind
 * @param {number} automaton
 * @param {number} id
 */
export const breakpointAt = (all, automaton, kind, id) =>
  all.find((each) => each.automaton === automaton && each[kind] === id);

/**
 * All breakpoints and a new one with a condition, "" for always; with undefined, all except that one.
 *
 * @param {Breakpoint[]} all
 * @param {number} automaton
 * @param {"state" | "transition"} kind
 * @param {number} id
 * @param {string | undefined} condition
 */
function withBreakpoint(all, automaton, kind, id, condition) {
  const rest = all.filter((each) => !(each.automaton === automaton && each[kind] === id));
  return condition === undefined ? rest : [...rest, {automaton, state: 0, transition: 0, condition, [kind]: id}];
}

/** The breakpoints of documents for later runs; they are kept when the page is closed. */
class Planned {
  /** @type {Map<number, {key: string, all: Breakpoint[]}>} */
  #tabs = new Map();
  /**
   * Where some were set or removed since the component of their tab was started with those that it had then.
   *
   * @type {{tab: number, automaton: number, kind: "state" | "transition", id: number}[]}
   */
  late = [];

  constructor() {
    store.addEventListener("workspace", () => this.#follow());
    store.addEventListener("closed", ({detail}) => this.#tabs.delete(detail.tab));
  }

  /** The breakpoints of a tab whose elements still exist. @returns {Breakpoint[]} @param {number} tab */
  of(tab) {
    const {automata} = store.documents.get(tab) ?? {};
    return this.#of(tab).filter(({automaton, state, transition}) => {
      const found = automata?.get(automaton);
      return (state ? found?.states : found?.transitions)?.some(({id}) => id === (state || transition));
    });
  }

  /** Whether a tab has any, even if its document has not arrived yet. @param {number} tab */
  has(tab) {
    return this.#of(tab).length > 0;
  }

  /** @param {Breakpoint[]} all @param {number} tab */
  set(tab, all) {
    this.#tabs.set(tab, {key: keyOf(tab), all});
    this.#write(tab);
  }

  /** Return those of a tab that are late, and forget them. @param {number} tab */
  takeLate(tab) {
    const {late} = this;
    this.late = late.filter((each) => each.tab !== tab);
    return late.filter((each) => each.tab === tab);
  }

  /** @param {number} tab */
  #of(tab) {
    let found = this.#tabs.get(tab);
    if (!found && keyOf(tab)) this.#tabs.set(tab, (found = {key: keyOf(tab), all: read()[keyOf(tab)] ?? []}));
    return found?.all ?? [];
  }

  /** A document that is saved to a file, or to another file, keeps its breakpoints. */
  #follow() {
    for (const [tab, known] of this.#tabs) {
      const key = keyOf(tab);
      if (!key || key === known.key) continue;
      known.key = key;
      if (known.all.length) this.#write(tab);
    }
  }

  /** @param {number} tab */
  #write(tab) {
    const {key, all} = this.#tabs.get(tab) ?? {key: "", all: []};
    const {[key]: _, ...others} = read();
    const kept = Object.entries(all.length ? {...others, [key]: all} : others).slice(-MOST_DOCUMENTS);
    browserStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(kept)));
  }
}

/**
 * The key of a document: its file, or its title as long as it has none; "" before the server has reported its root
 * directory.
 *
 * @param {number} tab
 */
function keyOf(tab) {
  const found = store.workspace.tabs.find((each) => each.tab === tab);
  const {root} = store.greeting;
  return found && root ? `${root} ${found.path || `new ${found.title}`}` : "";
}

/** @returns {Record<string, Breakpoint[]>} */
function read() {
  try {
    const found = JSON.parse(browserStorage.getItem(KEPT) ?? "{}");
    return Object.fromEntries(
      Object.entries(found).filter(
        ([, all]) => Array.isArray(all) && all.every((each) => each && typeof each.condition === "string"),
      ),
    );
  } catch {
    return {}; // invalid: written by another program
  }
}

export const planned = new Planned();
