/**
 * The followed component: its state, and how to steer it.
 *
 * One component, or one recording, is followed at a time. `snapshot` is what is shown: the newest moment, or one of the
 * past while looking back.
 *
 * @import {Target} from "../events.js"
 * @import {Controls, Followed} from "../messages.js"
 * @import {AutomatonSnapshot, ComponentStructure, LiveSnapshot, LiveStructure} from "../protocol.js"
 * @import {Moment} from "./robot-drawing.js"
 * @import {WorldShape} from "./world-drawing.js"
 * @typedef {{mode: null, structure: null, snapshot: null, shown: null, running: null}} MonitorEvents
 */

import {notify, notifyError} from "../notices.js";
import {store} from "../store.js";
import {Breakpoints} from "./breakpoints.js";
import {Past} from "./past.js";
import {RobotFacts, Structure} from "./structure.js";

/** `ComponentStatus` of interfaces/hfsm.idl. */
export const STATUS = ["Running", "Paused", "Halted"];
/** `TransitionKind` of interfaces/hfsm.idl. */
export const ON_TIME = 1;
export const ON_EVENT = 2;

/**
 * Events: `mode` when it is attached, detached, lost or found, or when permission to steer it changes; `structure` when
 * that or breakpoints change; `snapshot` at each new moment of the component; `shown` when the `snapshot` changes.
 */
class Monitor extends /** @type {new () => Target<MonitorEvents>} */ (EventTarget) {
  /** Name of the followed component or recording, "" for none. */
  component = "";
  /** @type {ComponentStructure | undefined} */
  structure = undefined;
  breakpoints = new Breakpoints(this);
  robot = new RobotFacts();
  /** The newest moment. @type {LiveSnapshot | undefined} */
  newest = undefined;
  /** A moment of the past that is shown instead. @type {LiveSnapshot | undefined} */
  looking = undefined;
  past = new Past();
  /** Since when it is silent, s since 1970; 0 while it sends. */
  since = 0;
  /**
   * How it ended, as requested or after an error.
   *
   * @type {{at: number, message: string} | undefined}
   */
  ended = undefined;
  /** Whether it may be steered; stopping it is always allowed. */
  writable = false;
  /**
   * The recording that is shown; `tab` is that of its document, 0 for none.
   *
   * @type {{file: string, complete: boolean, tab: number, world: WorldShape[], cameras: string[]} | undefined}
   */
  recording = undefined;
  /** Whether the canvas follows the deepest active automaton. */
  follows = false;

  #expected = ""; // a component that was just started
  /** The tab from which each component was started last. @type {Map<string, number>} */
  #origins = new Map();
  #known = new Structure(undefined);
  /**
   * The component to follow, and its pushes before the answer.
   *
   * @type {{component: string, structure: LiveStructure | undefined} | undefined}
   */
  #attaching;
  #run = 0; // how many times the component was started
  #lost = ""; // the component that was followed when the connection was lost
  /** The components that this window has started and that have not ended. @type {Set<string>} */
  #started = new Set();
  /** The run of each component that this window may steer, by when it was started. @type {Map<string, number>} */
  #steered = new Map();

  constructor() {
    super();
    store.addEventListener("snapshot", ({detail}) => detail.component === this.component && this.#take(detail.value));
    store.addEventListener("structure", ({detail}) => {
      if (detail.component === this.component) this.#learn(detail.value);
      else if (detail.component === this.#attaching?.component) this.#attaching.structure = detail.value;
    });
    store.addEventListener("stale", ({detail}) => detail.component === this.component && this.#lose(detail.since));
    store.addEventListener("workspace", () => this.#look());
    store.addEventListener("connection", () => this.#reconnect());
    store.addEventListener("run", ({detail}) => this.#ran(detail));
    store.addEventListener("closed", ({detail}) => this.#closed(detail.tab));
  }

  get snapshot() {
    return this.looking ?? this.newest;
  }

  /** Whether it is tried without a robot. */
  get isTrial() {
    return Boolean(this.newest?.component.speed);
  }

  /** The places of the robot and the things around it, at a moment of the past or in a trial. */
  get body() {
    const moment = this.isTrial ? this.snapshot : this.looking;
    if (!moment) return undefined;
    const {joints, health, torso, objects} = moment.robot;
    /** @type {Moment} */
    const body = {joints, tilt: health?.torsoTilt ?? null, torso, objects};
    return body;
  }

  get isLive() {
    return Boolean(this.component) && !this.recording && !this.looking;
  }

  /** Whether it can be steered now. */
  get steers() {
    return this.isLive && this.writable && !this.since && !this.ended && store.online;
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

  /** Whether it is shown with a document; after its end, only with its own document. @param {number} tab */
  isShownBeside(tab) {
    return Boolean(this.component) && !(this.isOver && this.tab && this.tab !== tab);
  }

  /** The components that run in the realm. @returns {string[]} */
  get running() {
    return (store.workspace.running ?? []).map((each) => each.component);
  }

  /** When the current recording of it began, s since 1970; 0 without one. */
  get recordedSince() {
    return store.workspace.running?.find((each) => each.component === this.component)?.since ?? 0;
  }

  /** The tab of the document of the component, first of all the one that it was started from; 0 without one. */
  get tab() {
    if (this.recording) return this.recording.tab;
    const name = this.structure?.name ?? this.component;
    const fitting = store.workspace.tabs.filter((each) => each.component === name).map((each) => each.tab);
    const origin = this.#origins.get(name) ?? 0;
    return fitting.includes(origin) ? origin : (fitting.at(0) ?? 0);
  }

  /** An automaton as it is shown now. @returns {AutomatonSnapshot | undefined} @param {number} id */
  now(id) {
    return this.snapshot?.component.automata.find((each) => each.id === id);
  }

  /** An automaton of the structure. @param {number} id */
  automaton(id) {
    return this.#known.automaton(id);
  }

  /** A transition of the structure. @param {number} automaton @param {number} id */
  transition(automaton, id) {
    return this.#known.transition(automaton, id);
  }

  /** The name of a state. @param {number} automaton @param {number} id */
  stateName(automaton, id) {
    return this.#known.stateName(automaton, id);
  }

  /**
   * Follow a component as soon as it runs: this window has started it.
   *
   * @param {string} component
   */
  expect(component) {
    this.#expected = component;
    this.#started.add(component);
    if (this.component === component) {
      this.lookAt(undefined);
    } else if (this.since) {
      this.detach(); // a lost component gives way at once
    }
    this.#look();
  }

  /** Watch a component if it runs when the connection is back; the followed one is anyway. @param {string} component */
  lookFor(component) {
    if (component !== this.component) this.#expected = component;
  }

  /**
   * Follow a component; a run that this window did not start is only watched until the user allows more.
   *
   * @param {string} component
   */
  async attach(component) {
    if (this.component === component && !this.recording) return true;
    await this.detach();
    const asked = (this.#attaching = {component, structure: undefined});
    let found;
    try {
      found = await store.request("attach", {component});
    } catch (error) {
      if (this.#attaching === asked) this.#attaching = undefined;
      notifyError(error);
      return false;
    }
    if (this.#attaching !== asked) {
      // another component was chosen meanwhile
      if (![this.component, this.#attaching?.component].includes(component))
        store.request("detach", {component}).catch(() => {}); // it is gone already
      return false;
    }
    this.#attaching = undefined;
    this.component = component;
    this.writable = this.#started.has(component);
    this.#begin({...found, structure: asked.structure ?? found.structure});
    return true;
  }

  /** The component that is followed has ended. @param {string} message how */
  end(message) {
    this.ended = {at: Date.now() / 1000, message};
    this.#emit("mode", "shown");
  }

  /**
   * Show a recording in the same views; `found` is the answer of the server.
   *
   * @param {string} path
   * @param {import("../messages.js").Answers["recording"]} found
   */
  async lookAtRecording(path, found) {
    await this.detach();
    this.#attaching = undefined;
    this.component = found.component;
    this.writable = false;
    const {complete, tab, world, cameras} = found;
    this.recording = {file: path, complete, tab, world, cameras};
    this.#begin(found);
    this.looking = found.snapshot ?? undefined;
    this.#emit("mode", "shown");
  }

  /** Follow nothing. */
  async detach() {
    const {component} = this;
    if (!component) return;
    Object.assign(this, {
      component: "",
      structure: undefined,
      newest: undefined,
      looking: undefined,
      breakpoints: new Breakpoints(this),
      since: 0,
      ended: undefined,
      writable: false,
      recording: undefined,
      past: new Past(),
    });
    this.#learn(undefined);
    this.#emit("mode", "shown");
    if (store.online) await store.request("detach", {component}).catch(() => {}); // it is gone already
  }

  /** @param {boolean} allowed */
  allowSteering(allowed) {
    const {startedAt} = this.newest?.component ?? {};
    this.writable = allowed && startedAt !== undefined;
    if (this.writable) this.#steered.set(this.component, startedAt ?? 0);
    else this.#steered.delete(this.component);
    this.#emit("mode");
  }

  /** @param {boolean} follows */
  setFollows(follows) {
    this.follows = follows;
    this.#emit("mode", "shown");
  }

  /** Show a moment of the past, or with undefined what happens now. @param {LiveSnapshot | undefined} snapshot */
  lookAt(snapshot) {
    const differs = Boolean(this.looking) !== Boolean(snapshot);
    this.looking = snapshot;
    if (differs) this.#emit("mode");
    this.#emit("shown");
  }

  /** Request the constants of a present robot, unless they are known. */
  async learnRobot() {
    if (await this.robot.complete(() => this.control("facts"))) this.#emit("structure");
  }

  /**
   * Send a control request to the component.
   *
   * @template {keyof Controls} Action
   * @param {Action} action
   * @param {Record<string, unknown>} args
   * @returns {Promise<Controls[Action]>} its result; rejected with a RequestError
   */
  control(action, args = {}) {
    return /** @type {Promise<Controls[typeof action]>} */ (
      store.request("control", {component: this.component, action, arguments: args})
    );
  }

  /**
   * The same for an action of the user, with refusals shown.
   *
   * @template {keyof Controls} Action
   * @param {Action} action
   * @param {Record<string, unknown>} args
   * @returns {Promise<Controls[Action] | null | undefined>} undefined then
   */
  async steer(action, args = {}) {
    if (!this.steers) return undefined;
    try {
      return (await this.control(action, args)) ?? null;
    } catch (error) {
      notifyError(error);
      return undefined;
    }
  }

  /** End the component, which somebody else has started. */
  async stop() {
    if ((await this.steer("stop")) !== undefined) this.end("it was stopped");
  }

  /** @param {Followed} followed */
  #begin({structure, snapshot, timeline, since = 0, facts}) {
    this.since = since ?? 0;
    this.ended = undefined;
    this.past = new Past(timeline ?? undefined);
    this.robot.take(facts);
    this.newest = undefined;
    this.looking = undefined;
    if (structure) this.#learn(structure);
    if (snapshot) {
      this.newest = snapshot;
      this.#judge(snapshot.component.startedAt);
    }
    this.#emit("mode", "shown");
  }

  /** @param {LiveStructure | null | undefined} value */
  #learn(value) {
    const renewed = value && this.#run > 0 && value.run !== this.#run;
    if (renewed) this.breakpoints.keep();
    this.#run = value?.run ?? 0;
    this.structure = value?.structure;
    this.breakpoints.all = value?.breakpoints ?? [];
    if (value?.cameras?.length) this.robot.cameras = value.cameras;
    this.#known = new Structure(this.structure);
    this.#emit("structure", "shown");
    // A restarted component has no breakpoints.
    if (renewed && !this.breakpoints.all.length) this.breakpoints.restore(this.#known);
  }

  /** @param {LiveSnapshot} value */
  #take(value) {
    const restarted = this.newest && value.component.startedAt !== this.newest.component.startedAt;
    if (restarted) {
      this.ended = undefined;
      this.past = new Past();
      this.breakpoints.keep();
    }
    const wasLost = this.since !== 0;
    const status = this.newest?.component.status;
    if (!this.newest || restarted) this.#judge(value.component.startedAt);
    this.since = 0;
    this.newest = value;
    this.past.add(value.component);
    if (!this.looking) this.#emit("shown");
    this.#emit("snapshot");
    if (wasLost || restarted || status !== value.component.status) this.#emit("mode");
    if (Object.keys(value.robot.joints).length) this.learnRobot();
  }

  /** Decide whether a run that has begun may be steered. @param {number} startedAt which run it is */
  #judge(startedAt) {
    const before = this.writable;
    if (this.#started.has(this.component)) this.#steered.set(this.component, startedAt);
    this.writable = this.#steered.get(this.component) === startedAt;
    if (before && !this.writable)
      notify(
        `Another run of ${this.component} has begun, which this window did not start: ` +
          "it is only watched until you switch Steering on.",
      );
  }

  /** A component was started from a tab, or has ended. @param {import("../protocol.js").RunPush} run */
  #ran({tab, component, status, message}) {
    this.#origins.set(component, tab);
    if (status !== "ended") return;
    if (component === this.#expected) this.#expected = "";
    this.#started.delete(component);
    if (component === this.component) this.end(this.ended?.message ?? message);
  }

  /** A component ends with the tab from which it was started, a recording with its own. @param {number} tab */
  #closed(tab) {
    if ((this.recording ? this.recording.tab : this.#origins.get(this.component)) === tab) this.detach();
  }

  /** @param {number} since */
  #lose(since) {
    if (since === this.since) return;
    this.since = since;
    this.#emit("mode", "shown");
  }

  /** Attach to the component that was just started, as soon as it is present. */
  #look() {
    if (this.#expected && this.running.includes(this.#expected)) {
      const component = this.#expected;
      this.#expected = "";
      this.attach(component);
    } else if (this.running.includes(this.#lost)) {
      const component = this.#lost;
      this.#lost = "";
      this.component = "";
      this.attach(component).then((done) => done || this.#emit("mode", "shown"));
    }
    this.#emit("running");
  }

  #reconnect() {
    if (!this.component || this.recording) return;
    if (!store.online) {
      this.since ||= Date.now() / 1000;
      this.#started.clear(); // components may end unseen while offline
      this.#lost = this.component;
      this.#emit("mode", "shown");
    } else {
      this.#look();
    }
  }

  /** @param {...keyof MonitorEvents} kinds */
  #emit(...kinds) {
    for (const kind of kinds) this.dispatchEvent(new Event(kind));
  }
}

/** The component that this window follows. */
export const monitor = new Monitor();
