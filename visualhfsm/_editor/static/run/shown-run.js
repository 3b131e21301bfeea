/**
 * What views read of the component or recording that is followed.
 *
 * `snapshot` is what is shown: the newest moment, or one of the past while looking back.
 *
 * @import {Target} from "../kit/events.js"
 * @typedef {{mode: null, structure: null, snapshot: null, shown: null, present: null}} MonitorEvents
 */

import {store} from "../data/store.js";
import {Followed} from "./followed.js";
import {OwnRuns} from "./own-runs.js";

/**
 * Events: `mode` when it is followed or no longer, lost or found, or when permission to steer it changes; `structure` when
 * that or breakpoints change; `snapshot` at each new moment of the component; `shown` when the `snapshot` changes.
 */
export class ShownRun extends /** @type {new () => Target<MonitorEvents>} */ (EventTarget) {
  followed = new Followed();
  starts = new OwnRuns();

  get component() {
    return this.followed.component;
  }

  get recording() {
    return this.followed.recording;
  }

  get structure() {
    return this.followed.structure;
  }

  get newest() {
    return this.followed.newest;
  }

  get looking() {
    return this.followed.looking;
  }

  get snapshot() {
    return this.followed.snapshot;
  }

  get past() {
    return this.followed.past;
  }

  get body() {
    return this.followed.body;
  }

  get since() {
    return this.followed.since;
  }

  get ended() {
    return this.followed.ended;
  }

  get writable() {
    return this.followed.writable;
  }

  get hanging() {
    return this.followed.hanging;
  }

  get late() {
    return this.followed.late;
  }

  /** Whether the cycles of an automaton take longer than its period now. @param {number} id */
  isLate(id) {
    return this.followed.isLate(id);
  }

  get isDryRun() {
    return this.followed.isDryRun;
  }

  get dryRunBody() {
    return this.followed.dryRunBody;
  }

  get isLive() {
    return this.followed.isLive;
  }

  get isLost() {
    return this.followed.isLost;
  }

  get isOver() {
    return this.followed.isOver;
  }

  /** An automaton as it is shown now. @param {number} id */
  now(id) {
    return this.followed.now(id);
  }

  /** An automaton of the structure. @param {number} id */
  automaton(id) {
    return this.followed.known.automaton(id);
  }

  /** A transition of the structure. @param {number} automaton @param {number} id */
  transition(automaton, id) {
    return this.followed.known.transition(automaton, id);
  }

  /** The name of a state. @param {number} automaton @param {number} id */
  stateName(automaton, id) {
    return this.followed.stateName(automaton, id);
  }

  /** Whether its automata and its state are known, of the same run. */
  get isKnown() {
    return Boolean(this.structure && this.newest) && !this.followed.isAhead;
  }

  /** Whether there is a robot to see: that of a recording, of a dry run, or the present one, until it is given up. */
  get hasRobot() {
    const {recording} = this;
    if (recording) return Boolean(recording.body || recording.cameras.length);
    return Boolean(this.dryRunBody) || ["present", "lost"].includes(store.robot.status);
  }

  /** Whether it can be steered now. */
  get steers() {
    return this.followed.steers && store.online;
  }

  /** Whether it is shown with a document; after its end, only with its own document. @param {number} tab */
  isShownBeside(tab) {
    return Boolean(this.component) && !(this.isOver && this.tab && this.tab !== tab);
  }

  /** The components that are present in the realm. @returns {string[]} */
  get present() {
    return (store.workspace.present ?? []).map((each) => each.component);
  }

  /** When the current recording of it began, s since 1970; 0 without one. */
  get recordedSince() {
    return store.workspace.present?.find((each) => each.component === this.component)?.since ?? 0;
  }

  /** The tab of the document of the component, first of all the one that it was started from; 0 without one. */
  get tab() {
    if (this.recording) return this.recording.tab;
    const name = this.structure?.name ?? this.component;
    const fitting = store.workspace.tabs.filter((each) => each.component === name).map((each) => each.tab);
    const origin = this.starts.tabs.get(name) ?? 0;
    // After a run a document may be saved under another name.
    if (this.ended && store.documents.has(origin)) return origin;
    return fitting.includes(origin) ? origin : (fitting.at(0) ?? 0);
  }
}
