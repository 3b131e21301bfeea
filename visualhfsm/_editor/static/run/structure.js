/**
 * The constants: the automata of a component, the limits and cameras of a robot.
 *
 * @import {Breakpoint, ComponentStructure, JointLimits, RobotFacts as Facts} from "../data/protocol.js"
 * @import {TransitionStructure} from "../data/protocol.js"
 */

const FACTS_AGAIN = 2000; // ms after which missing facts are requested again

/** The constants of a robot: the limits of its joints, and its cameras. */
export class RobotFacts {
  /** Limits of the joints by name. @type {Map<string, JointLimits>} */
  limits = new Map();
  /** @type {string[]} */
  cameras = [];

  #asked = -Infinity;

  /** @param {Facts} [facts] as the server reports them */
  take(facts) {
    this.limits = new Map((facts?.limits ?? []).map((each) => [each.name, each]));
    this.cameras = facts?.cameras ?? [];
  }

  /**
   * Request the missing facts of a present robot from time to time.
   *
   * @param {string[] | undefined} joints that it has, if they are known; another robot has others
   * @param {() => Promise<Facts>} ask
   * @returns {Promise<boolean>} whether they arrived
   */
  async complete(joints, ask) {
    const isComplete = joints ? joints.every((name) => this.limits.has(name)) : this.limits.size > 0;
    if (isComplete || performance.now() - this.#asked < FACTS_AGAIN) return false;
    this.#asked = performance.now();
    try {
      this.take(await ask());
      return true;
    } catch {
      return false; // a later moment asks again
    }
  }
}

/** The automata of a component by their ids, as it reported them. */
export class Structure {
  /** @param {ComponentStructure | undefined} reported `ComponentStructure` of interfaces/hfsm.idl */
  constructor(reported) {
    this.automata = new Map((reported?.automata ?? []).map((each) => [each.id, each]));
    /** @type {Map<string, TransitionStructure>} */
    this.transitions = new Map();
    for (const {id, transitions} of this.automata.values())
      for (const each of transitions) this.transitions.set(`${id}/${each.id}`, each);
  }

  /** @param {number} id */
  automaton(id) {
    return this.automata.get(id);
  }

  /** @param {number} automaton @param {number} id */
  transition(automaton, id) {
    return this.transitions.get(`${automaton}/${id}`);
  }

  /** Whether the element of a breakpoint exists. @param {Breakpoint} breakpoint */
  has({automaton, state, transition}) {
    const found = this.automaton(automaton);
    return (
      found !== undefined &&
      (!state || found.states.some((each) => each.id === state)) &&
      (!transition || this.transitions.has(`${automaton}/${transition}`))
    );
  }
}
