/**
 * What is followed, from when it is chosen until another is: its automata, and the moments of its run.
 *
 * @import {AutomatonSnapshot, ComponentStructure, Followed as Reported, LiveSnapshot} from "../data/protocol.js"
 * @import {LiveStructure} from "../data/protocol.js"
 * @import {Moment} from "../robot3d/robot-drawing.js"
 * @import {WorldShape} from "../robot3d/world-drawing.js"
 */

import {t} from "../kit/texts.js";
import {StateChanges} from "./state-changes.js";
import {Structure} from "./structure.js";

const LOOKED_AT = 3; // s of component time in which most cycles of what is late were too long
const FEW = 3; // cycles that were too long; fewer may happen on any busy machine

export class Followed {
  /** Name of the component or recording, "" for none. */
  component = "";
  /** @type {ComponentStructure | undefined} */
  structure = undefined;
  /** The newest moment. @type {LiveSnapshot | undefined} */
  newest = undefined;
  /** A moment of the past that is shown instead. @type {LiveSnapshot | undefined} */
  looking = undefined;
  past = new StateChanges();
  /** The newest moments. @type {LiveSnapshot["component"][]} */
  #recent = [];
  /** Since when it is silent, s since 1970; 0 while it sends. */
  since = 0;
  /**
   * How it ended, as requested or after an error.
   *
   * @type {{at: number, message: string} | undefined}
   */
  ended = undefined;
  /** Whether the moments may be of another run than the automata, which come later. */
  isAhead = false;
  /** Whether the automata are those of the next run, whose moments come later. */
  #isBehind = false;
  /** Whether another run has begun since: if no moment of the former one came, the first is one of this. */
  begun = false;
  /** Whether it may be steered; stopping it is always allowed. */
  writable = false;
  /**
   * The recording that is shown; `tab` is that of its document, 0 for none.
   *
   * @type {{file: string, shortened: string, tab: number, world: WorldShape[], cameras: string[], body: string}
   *   | undefined}
   */
  recording = undefined;

  /** The automata by their ids. */
  known = new Structure(undefined);
  #body = "";
  /** The names of states by `automaton/state`. @type {Map<string, string>} */
  #names = new Map();
  #run = 0; // how many times the component was started

  get snapshot() {
    return this.looking ?? this.newest;
  }

  /** Whether it is tried without a robot. */
  get isDryRun() {
    return Boolean(this.newest?.component.speed);
  }

  /** The robot of a dry run, by the hash of its description; "" for what is no dry run. */
  get dryRunBody() {
    return this.isDryRun ? this.#body : "";
  }

  /** The places of the robot and the things around it, at a moment of the past or in a dry run. */
  get body() {
    const moment = this.isDryRun ? this.snapshot : this.looking;
    if (!moment) return undefined;
    const {joints, health, torso, objects} = moment.robot;
    /** @type {Moment} */
    const body = {joints, tilt: health?.torsoTilt ?? null, torso, objects};
    return body;
  }

  get isLive() {
    return Boolean(this.component) && !this.recording && !this.looking;
  }

  /** True while it seems to run and may be steered. */
  get steers() {
    return Boolean(this.newest) && this.isLive && this.writable && !this.since && !this.ended;
  }

  /** Whether its state is unknown: it is silent, and no end was reported. */
  get isLost() {
    return Boolean(this.since) && !this.ended && !this.looking;
  }

  /** Whether it has ended, and no moment of the past is shown. */
  get isOver() {
    return Boolean(this.ended) && !this.looking;
  }

  /** The automaton whose cycle does not end; of several, the one that has hung for the longest time. */
  get hanging() {
    if (!this.isLive || this.ended || this.since) return undefined;
    const hanging = (this.newest?.component.automata ?? []).filter((each) => each.hangsFor);
    return hanging.toSorted((one, other) => other.hangsFor - one.hangsFor).at(0);
  }

  /** Whether the cycles of an automaton take longer than its period now. @param {number} id */
  isLate(id) {
    if (!this.isLive || this.ended || this.since) return false;
    const found = this.#recent.flatMap(({automata}) => automata.find((each) => each.id === id) ?? []);
    const [first, last] = [found.at(0), found.at(-1)];
    if (!first || !last) return false;
    const overruns = last.overruns - first.overruns;
    return overruns >= FEW && overruns * 2 >= last.cycles - first.cycles;
  }

  /** The first automaton that is late; none while one hangs. */
  get late() {
    if (this.hanging) return undefined;
    return (this.newest?.component.automata ?? []).find(({id, ghost}) => !ghost && this.isLate(id));
  }

  /** An automaton as it is shown now. @returns {AutomatonSnapshot | undefined} @param {number} id */
  now(id) {
    return this.snapshot?.component.automata.find((each) => each.id === id);
  }

  /** The name of a state, also of one that a reload has removed. @param {number} automaton @param {number} id */
  stateName(automaton, id) {
    return this.#names.get(`${automaton}/${id}`) ?? t("state {id}", {id});
  }

  /** Begin with what the server reports. @param {Pick<Reported, "snapshot" | "timeline" | "since">} reported */
  begin({snapshot, timeline, since}) {
    this.since = since ?? 0;
    this.ended = undefined;
    this.past = new StateChanges(timeline ?? undefined);
    this.#recent = [];
    this.newest = snapshot ?? undefined;
    this.isAhead = Boolean(snapshot);
    this.looking = undefined;
  }

  /**
   * Take the automata.
   *
   * @param {LiveStructure} value
   * @returns {boolean} whether they are those of another run than before
   */
  learn({structure, run, body = ""}) {
    this.#body = body;
    const renewed = this.#run > 0 && run !== this.#run;
    this.#run = run;
    this.#isBehind = renewed && !this.isAhead;
    this.isAhead = false;
    this.structure = structure;
    this.known = new Structure(structure);
    if (renewed) this.#names.clear();
    for (const {id, states} of structure.automata)
      for (const each of states) this.#names.set(`${id}/${each.id}`, each.name);
    return renewed;
  }

  /**
   * Take the next moment.
   *
   * @param {LiveSnapshot} value
   * @returns {{first: boolean, restarted: boolean, changed: boolean}} whether it is the first of all, the first of
   *   another run, and whether the status is not that of the moment before
   */
  take(value) {
    const {newest} = this;
    const restarted = newest !== undefined && value.component.startedAt !== newest.component.startedAt;
    if (restarted || (!newest && this.begun)) this.ended = undefined;
    if (restarted) {
      this.past = new StateChanges();
      this.#recent = [];
      this.isAhead = !this.#isBehind;
      this.#isBehind = false;
    }
    const {component} = value;
    this.#recent = [...this.#recent.filter(({time}) => time > component.time - LOOKED_AT), component];
    const changed = this.since !== 0 || restarted || newest?.component.status !== value.component.status;
    this.since = 0;
    this.newest = value;
    this.past.add(value.component, value.robot.failing);
    return {first: !newest, restarted, changed};
  }
}
