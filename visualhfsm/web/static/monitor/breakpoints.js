/** The breakpoints of a component, and those that it had before it was started anew. */

/** @typedef {{automaton: number, state: number, transition: number, condition: string}} Breakpoint */

export class Breakpoints {
  /** @type {Breakpoint[]} */
  all = [];
  /** @type {Breakpoint[]} */
  #former = [];

  /** The breakpoint of a state or transition. @param {"state" | "transition"} kind */
  of(automaton, kind, id) {
    return this.all.find((each) => each.automaton === automaton && each[kind] === id);
  }

  /** All with another one, which has a condition or "" for always; with undefined all without it. */
  with(automaton, kind, id, condition) {
    const rest = this.all.filter((each) => !(each.automaton === automaton && each[kind] === id));
    return condition === undefined ? rest : [...rest, {automaton, state: 0, transition: 0, condition, [kind]: id}];
  }

  /** Keep them: the component that had them has ended. */
  keep() {
    if (this.all.length) this.#former = this.all;
    this.all = [];
  }

  /** Those that were kept, as far as there is still what they stand at. @param {import("./structure.js").Structure} structure */
  keptIn(structure) {
    return this.#former.filter((each) => structure.has(each));
  }
}
