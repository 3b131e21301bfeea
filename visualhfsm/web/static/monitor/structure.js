/** The automata of a component by their ids, as it told them. */

export class Structure {
  /** @param {{automata: object[]} | undefined} told `ComponentStructure` of interfaces/hfsm.idl */
  constructor(told) {
    this.automata = new Map((told?.automata ?? []).map((each) => [each.id, each]));
    this.transitions = new Map();
    for (const {id, transitions} of this.automata.values()) for (const each of transitions) this.transitions.set(`${id}/${each.id}`, each);
  }

  automaton(id) {
    return this.automata.get(id);
  }

  transition(automaton, id) {
    return this.transitions.get(`${automaton}/${id}`);
  }

  /** What a state is called. */
  stateName(automaton, id) {
    return this.automaton(automaton)?.states.find((each) => each.id === id)?.name ?? `state ${id}`;
  }

  /** Whether there is what a breakpoint stands at. @param {import("./monitor.js").Breakpoint} breakpoint */
  has({automaton, state, transition}) {
    const found = this.automaton(automaton);
    return Boolean(found) && (!state || found.states.some((each) => each.id === state)) && (!transition || this.transitions.has(`${automaton}/${transition}`));
  }
}
