/**
 * The changes of state, from the timeline of the server and from later snapshots.
 *
 * @import {ComponentSnapshot, Fault, Timeline} from "../data/protocol.js"
 */

const MOST = 20_000; // changes, and spans of all automata together, that are kept
const MOST_AUTOMATA = 2_000; // automata that are distinguished

/**
 * @typedef {{time: number, automaton: number, origin: number, destination: number, transition: number}} Change
 * @typedef {{state: number, ghost: boolean, start: number, end: number, faults?: Fault[]}} Span when a state was the
 *   current one, or when `faults` were what failed
 */

export class StateChanges {
  /**
   * @param {Timeline} [timeline] as the server reports it
   */
  constructor(timeline) {
    /** Component times of the first and the last moment, s. */
    this.start = timeline?.start ?? Infinity;
    this.end = timeline?.end ?? 0;
    /** @type {Change[]} */
    this.changes = (timeline?.changes ?? []).map(([time, automaton, origin, destination, transition]) => ({
      time,
      automaton,
      origin,
      destination,
      transition,
    }));
    /**
     * The spans of the current states of each automaton.
     *
     * @type {Map<number, Span[]>}
     */
    this.spans = new Map();
    for (const [automaton, state, ghost, start, end] of timeline?.spans ?? [])
      this.#of(automaton).push({state, ghost, start, end});
    this.#count = timeline?.spans.length ?? 0;
    /** When something failed. @type {Span[]} */
    this.failures = (timeline?.failures ?? []).map((each) => ({...each, state: 0, ghost: false}));
    this.#failing = this.failures.findLast(({end}) => end === this.end);
    /** Names of all numbers that can be plotted. @type {Set<string>} */
    this.numbers = new Set(timeline?.numbers ?? []);
    /** @type {Map<number, {state: number, ghost: boolean, enteredAt?: number}>} */
    this.#before = new Map();
  }

  #before;
  #failing;
  #count = 0; // of all spans

  /** Take the next moment. @param {ComponentSnapshot} component @param {Fault[]} [faults] what fails then */
  add({time, automata}, faults = []) {
    if (time < this.end) return;
    this.#noteFailures(time, faults);
    this.start = Math.min(this.start, time);
    this.end = time;
    for (const {id, state, ghost, enteredAt, lastTransition} of automata) {
      if (!this.spans.has(id) && this.spans.size >= MOST_AUTOMATA) continue;
      const spans = this.#of(id);
      const last = spans.at(-1);
      const before = this.#before.get(id) ?? (last && {state: last.state, ghost: last.ghost});
      const changed =
        before &&
        (before.state !== state ||
          (!before.ghost && !ghost && before.enteredAt !== undefined && before.enteredAt !== enteredAt));
      if (changed)
        this.changes.push({
          time: enteredAt > 0 && enteredAt <= time ? enteredAt : time,
          automaton: id,
          origin: before.state,
          destination: state,
          transition: lastTransition,
        });
      this.#before.set(id, {state, ghost, enteredAt});
      if (last && last.state === state && last.ghost === ghost && !changed) last.end = time;
      else {
        if (last) last.end = time;
        spans.push({state, ghost, start: time, end: time});
        this.#count += 1;
      }
    }
    if (this.#count > MOST) this.#forgetSpans();
    if (this.changes.length > MOST) this.changes.splice(0, MOST / 10);
  }

  /** @param {number} time @param {Fault[]} faults */
  #noteFailures(time, faults) {
    if (this.#failing) this.#failing.end = time;
    if (JSON.stringify(faults) === JSON.stringify(this.#failing?.faults ?? [])) return;
    this.#failing = faults.length ? {state: 0, ghost: false, start: time, end: time, faults} : undefined;
    if (this.#failing) this.failures = [...this.failures.slice(-MOST), this.#failing];
  }

  /** The latest change of an automaton at a time. @param {number} automaton @param {number} time */
  latest(automaton, time) {
    return this.changes.findLast((each) => each.automaton === automaton && each.time <= time + 1e-6);
  }

  /** Forget the oldest tenth of the spans of all automata together. */
  #forgetSpans() {
    const ends = [...this.spans.values()].flatMap((spans) => spans.map(({end}) => end)).sort((a, b) => a - b);
    const before = ends[Math.floor(ends.length / 10)];
    this.#count = 0;
    for (const spans of this.spans.values()) {
      const first = spans.findIndex(({end}) => end > before);
      spans.splice(0, first < 0 ? spans.length - 1 : first); // the present span stays
      this.#count += spans.length;
    }
  }

  /** @param {number} automaton */
  #of(automaton) {
    let found = this.spans.get(automaton);
    if (!found) this.spans.set(automaton, (found = []));
    return found;
  }
}
