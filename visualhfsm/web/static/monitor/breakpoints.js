/**
 * The breakpoints of the followed component, those that it had before it was restarted, and those of one that is not
 * there yet.
 */

import {store} from "../store.js";

/** @typedef {{automaton: number, state: number, transition: number, condition: string}} Breakpoint */

const KEPT = "visualhfsm.breakpoints";
const MOST_DOCUMENTS = 50;
const MOST_ARGUMENTS = 80;
const LONGEST_CONDITION = 900; // characters that a command line takes here

/**
 * Where the followed component pauses, and where another one of a tab is to; `all` are those that the followed one has.
 */
export class Breakpoints {
  /** @type {Breakpoint[]} */
  all = [];
  /** @type {Breakpoint[]} */
  #former = [];
  #monitor;
  /** The newest change: the next one begins with what it leaves. @type {Promise<void>} */
  #changed = Promise.resolve();

  /** @param {typeof import("./monitor.js").monitor} monitor */
  constructor(monitor) {
    this.#monitor = monitor;
  }

  /** Whether those of a tab are kept for later: its component is not followed, or has ended. @param {number} tab */
  arePlanned(tab) {
    const {component, isOver, tab: followed} = this.#monitor;
    return !component || isOver || followed !== tab;
  }

  /** Those of the component of a tab, or those that it is to have. @param {number} tab */
  of(tab) {
    return this.arePlanned(tab) ? planned.of(tab) : this.all;
  }

  /**
   * Set one, with a condition or with "" for always, or remove it with undefined.
   *
   * @param {"state" | "transition"} kind
   * @param {number} tab
   * @param {number} automaton
   * @param {number} id
   * @param {string | undefined} condition
   */
  set(tab, automaton, kind, id, condition) {
    this.#changed = this.#changed.then(async () => {
      const all = withBreakpoint(this.of(tab), automaton, kind, id, condition);
      if (!this.arePlanned(tab)) {
        await this.#replace(all);
        return;
      }
      planned.set(tab, all);
      this.#notify();
    });
    return this.#changed;
  }

  /** @param {Breakpoint[]} breakpoints */
  async #replace(breakpoints) {
    const monitor = this.#monitor;
    if ((await monitor.steer("setBreakpoints", {breakpoints})) === undefined) return;
    if (monitor.breakpoints !== this) return; // it follows another one by now
    this.all = breakpoints;
    if (monitor.tab) planned.set(monitor.tab, breakpoints);
    this.#notify();
  }

  #notify() {
    for (const kind of ["structure", "shown"]) this.#monitor.dispatchEvent(new Event(kind));
  }

  /** Keep them: the component that had them has ended. */
  keep() {
    if (this.all.length) this.#former = this.all;
    this.all = [];
  }

  /**
   * Put those that were kept, as far as there is still what they stand at.
   *
   * @param {{has: (breakpoint: Breakpoint) => boolean}} structure
   */
  restore(structure) {
    this.#changed = this.#changed.then(async () => {
      const kept = this.#former.filter(
        (each) => structure.has(each) && !this.all.some((other) => areAtOne(each, other)),
      );
      if (kept.length) await this.#replace([...this.all, ...kept]);
    });
    return this.#changed;
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
 * All with another one, which has a condition or "" for always; with undefined all without it.
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

/** The breakpoints of the documents, for when their components run; they are kept when the page is left. */
class Planned {
  /** @type {Map<number, {key: string, all: Breakpoint[]}>} */
  #tabs = new Map();

  constructor() {
    store.addEventListener("workspace", () => this.#follow());
    store.addEventListener("closed", ({detail}) => this.#tabs.delete(detail.tab));
  }

  /** Those of a tab, as far as there is still what they stand at. @returns {Breakpoint[]} @param {number} tab */
  of(tab) {
    const {automata} = store.documents.get(tab) ?? {};
    return this.#of(tab).filter(({automaton, state, transition}) => {
      const found = automata?.get(automaton);
      return (state ? found?.states : found?.transitions)?.some(({id}) => id === (state || transition));
    });
  }

  /** Whether a tab has any, though its document may not be here yet. @param {number} tab */
  has(tab) {
    return this.#of(tab).length > 0;
  }

  /** @param {Breakpoint[]} all @param {number} tab */
  set(tab, all) {
    this.#tabs.set(tab, {key: keyOf(tab), all});
    this.#write(tab);
  }

  /** What starts a component with them. @returns {string[]} @param {number} tab */
  argumentsFor(tab) {
    const fitting = this.of(tab)
      .filter(({condition}) => condition.length < LONGEST_CONDITION)
      .slice(0, MOST_ARGUMENTS / 2);
    return fitting.flatMap(({automaton, state, transition, condition}) => [
      "--breakpoint",
      `${automaton}.${state || `t${transition}`}${condition && `:${condition}`}`,
    ]);
  }

  /** @param {number} tab */
  #of(tab) {
    let found = this.#tabs.get(tab);
    if (!found && keyOf(tab)) this.#tabs.set(tab, (found = {key: keyOf(tab), all: read()[keyOf(tab)] ?? []}));
    return found?.all ?? [];
  }

  /** A document that is saved to a file, or to another one, keeps them. */
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
    localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(kept)));
  }
}

/**
 * What a document is known by: its file, or its title as long as it has none; "" before the server said where files
 * are.
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
    const found = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return Object.fromEntries(
      Object.entries(found).filter(
        ([, all]) => Array.isArray(all) && all.every((each) => each && typeof each.condition === "string"),
      ),
    );
  } catch {
    return {}; // somebody else wrote there
  }
}

export const planned = new Planned();
