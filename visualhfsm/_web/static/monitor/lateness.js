/**
 * Which automata are late: for some time most of their cycles have taken longer than the period.
 *
 * @import {ComponentSnapshot} from "../protocol.js"
 */

const LOOKED_AT = 3; // s of component time
const FEW = 3; // cycles that were too long; fewer may happen on any busy machine

export class Lateness {
  /** The counts of each automaton at the moments that are looked at. @type {Map<number, {time: number, cycles: number, overruns: number}[]>} */
  #moments = new Map();

  /** Take the next moment of a run. @param {Pick<ComponentSnapshot, "time" | "automata">} component */
  take({time, automata}) {
    for (const {id, cycles, overruns} of automata) {
      const kept = (this.#moments.get(id) ?? []).filter((each) => each.time > time - LOOKED_AT);
      kept.push({time, cycles, overruns});
      this.#moments.set(id, kept);
    }
  }

  /** Whether an automaton is late. @param {number} id */
  has(id) {
    const moments = this.#moments.get(id) ?? [];
    const [first, last] = [moments.at(0), moments.at(-1)];
    if (!first || !last) return false;
    const [cycles, overruns] = [last.cycles - first.cycles, last.overruns - first.overruns];
    return overruns >= FEW && overruns * 2 >= cycles;
  }
}
