/**
 * The component that this window follows: how it is chosen, and how to steer it.
 *
 * One component, or one recording, is followed at a time. `shown.js` has what views read of it, `followed.js` what is
 * known of it, `starts.js` what this window has started.
 *
 * @import {Answers, FieldsOf, Followed as Reported} from "../data/messages.js"
 * @import {LiveSnapshot, LiveStructure, Requests, RunPush} from "../data/protocol.js"
 * @import {MonitorEvents} from "./shown.js"
 */

import {notify, notifyError, clearErrors} from "../kit/notices.js";
import {runs} from "../data/runs.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewing.js";
import {Breakpoints} from "./breakpoints.js";
import {Followed} from "./followed.js";
import {Shown} from "./shown.js";
import {RobotFacts} from "./structure.js";

/** `ComponentStatus` of interfaces/hfsm.idl. */
export const STATUS = ["running", "paused", "halted"];
/** A status in words. @param {number} status */
export const spokenStatus = (status) => [t("Running"), t("Paused"), t("Halted")][status];
/** `TransitionKind` of interfaces/hfsm.idl. */
export const ON_TIME = 1;
export const ON_EVENT = 2;

/** Chooses what is followed, takes what it sends, and steers it. */
class Monitor extends Shown {
  breakpoints = new Breakpoints(this);
  robot = new RobotFacts();
  /** Whether the canvas follows the deepest active automaton. */
  follows = false;

  #expected = ""; // a component that was just started
  #lost = ""; // the component that was followed when the connection was lost
  /**
   * The component to follow, and its pushes before the answer.
   *
   * @type {{component: string, structure: LiveStructure | undefined} | undefined}
   */
  #attaching;

  /**
   * The components of open documents that ran when a viewer last looked.
   *
   * @type {readonly string[]}
   */
  #seen = [];

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

  /**
   * Follow a component as soon as it runs: this window has started it.
   *
   * @param {string} component
   */
  expect(component) {
    this.#expected = component;
    this.starts.begin(component);
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
    this.followed.component = component;
    this.followed.writable = this.starts.has(component);
    this.#begin({...found, structure: asked.structure ?? found.structure});
    return true;
  }

  /** The component that is followed has ended. @param {string} message how */
  end(message) {
    this.followed.ended = {at: Date.now() / 1000, message};
    this.followed.begun = false;
    this.#emit("mode", "shown");
  }

  /**
   * Show a recording in the same views; `found` is the answer of the server.
   *
   * @param {string} path
   * @param {Answers["recording"]} found
   */
  async lookAtRecording(path, found) {
    await this.detach();
    this.#attaching = undefined;
    const {followed} = this;
    const {component, shortened, tab, world, cameras, body} = found;
    followed.component = component;
    followed.writable = false;
    followed.recording = {file: path, shortened, tab, world, cameras, body};
    this.#begin(found);
    followed.looking = found.snapshot ?? undefined;
    this.#emit("mode", "shown");
  }

  /** Follow nothing. */
  async detach() {
    const {component} = this;
    if (!component) return;
    this.followed = new Followed();
    this.breakpoints = new Breakpoints(this);
    this.#emit("structure", "shown");
    this.#emit("mode", "shown");
    if (store.online) await store.request("detach", {component}).catch(() => {}); // it is gone already
  }

  /** @param {boolean} allowed */
  allowSteering(allowed) {
    const startedAt = allowed ? this.newest?.component.startedAt : undefined;
    this.followed.writable = startedAt !== undefined;
    this.starts.allow(this.component, startedAt);
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
    this.followed.looking = snapshot;
    if (differs) this.#emit("mode");
    this.#emit("shown");
  }

  /** Request the constants of a present robot, unless they are known. @param {string[]} [joints] that it has */
  async learnRobot(joints) {
    if (await this.robot.complete(joints, () => store.request("facts"))) this.#emit("structure");
  }

  /**
   * Send a request about the component.
   *
   * @template {keyof Requests} Op
   * @param {Op} op
   * @param {FieldsOf<Omit<Requests[Op], "component">>} fields
   */
  ask(op, ...[fields]) {
    const all = /** @type {FieldsOf<Requests[Op]>} */ ([{component: this.component, ...fields}]);
    return store.request(op, ...all);
  }

  /**
   * The same for an action of the user, with refusals shown; answered with undefined then.
   *
   * @template {keyof Requests} Op
   * @param {Op} op
   * @param {FieldsOf<Omit<Requests[Op], "component">>} fields
   */
  async steer(op, ...fields) {
    if (!this.steers) return undefined;
    try {
      const done = (await this.ask(op, ...fields)) ?? null;
      clearErrors(`steer ${op}`);
      return done;
    } catch (error) {
      notifyError(error, {about: `steer ${op}`});
      return undefined;
    }
  }

  /** End the component, which somebody else has started. */
  async stop() {
    if ((await this.steer("stopPresent")) !== undefined) this.end(t("it was stopped"));
  }

  /** @param {Reported} reported */
  #begin({structure, facts, ...reported}) {
    this.followed.begin(reported);
    this.robot.take(facts);
    if (structure) this.#learn(structure);
    if (this.newest) this.#judge(this.newest.component.startedAt);
    this.#emit("mode", "shown");
  }

  /** @param {LiveStructure} value */
  #learn(value) {
    const renewed = this.followed.learn(value);
    if (renewed) this.breakpoints.keep();
    this.breakpoints.all = value.breakpoints;
    if (value.cameras.length) this.robot.cameras = value.cameras;
    this.#emit("structure", "shown");
    // A restarted component has no breakpoints.
    if (renewed && !this.breakpoints.all.length) this.breakpoints.restore(this.followed.known);
  }

  /** @param {LiveSnapshot} value */
  #take(value) {
    const {first, restarted, changed} = this.followed.take(value);
    if (restarted) this.breakpoints.keep();
    if (first || restarted) this.#judge(value.component.startedAt);
    if (!this.looking) this.#emit("shown");
    this.#emit("snapshot");
    if (changed) this.#emit("mode");
    const names = Object.keys(value.robot.joints);
    if (names.length) this.learnRobot(names);
  }

  /** Decide whether a run that has begun may be steered. @param {number} startedAt which run it is */
  #judge(startedAt) {
    const before = this.writable;
    this.followed.writable = this.starts.maySteer(this.component, startedAt);
    if (before && !this.writable && !viewing.on)
      notify(
        t(
          "Another run of {component} has begun, which this window did not start: it is only watched until you switch Steering on.",
          {component: this.component},
        ),
      );
  }

  /** A component was started from a tab, or has ended. @param {RunPush} run */
  #ran(run) {
    const {tab, component, status} = run;
    this.starts.from(component, tab);
    if (status === "starting" && component === this.component) this.followed.begun = true;
    if (status !== "ended") return;
    if (component === this.#expected) this.#expected = "";
    this.starts.end(component);
    if (component === this.component) this.end(run.place || !this.ended ? runs.endOf(run) : this.ended.message);
  }

  /** A component ends with the tab from which it was started, a recording with its own. @param {number} tab */
  #closed(tab) {
    if ((this.recording ? this.recording.tab : this.starts.tabOf(this.component)) === tab) this.detach();
  }

  /** @param {number} since */
  #lose(since) {
    if (since === this.since) return;
    this.followed.since = since;
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
      this.followed.component = "";
      this.attach(component).then((done) => done || this.#emit("mode", "shown"));
    } else if (viewing.on) {
      this.#lookOn();
    }
    this.#emit("running");
  }

  /** Viewers start nothing: they follow a shown document that begins to run, unless what they follow still does. */
  #lookOn() {
    const {tabs} = store.workspace;
    const running = this.running.filter((component) => tabs.some((each) => each.component === component));
    const begun = running.find((component) => !this.#seen.includes(component));
    this.#seen = running;
    if (begun && (!this.component || this.since || this.ended)) this.attach(begun);
  }

  #reconnect() {
    if (this.recording) return;
    if (!this.component) {
      if (store.online) this.#look();
    } else if (!store.online) {
      this.followed.since ||= Date.now() / 1000;
      this.starts.forget(); // components may end unseen while offline
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
