/**
 * The component that this window follows: how it is chosen, and how to steer it.
 *
 * One component, or one recording, is followed at a time. `shown-run.js` has what views read of it, `followed.js` what is
 * known of it, `own-runs.js` what this window has started.
 *
 * @import {Answers, FieldsOf, Followed as Reported, LiveSnapshot, LiveStructure, Requests} from "../data/protocol.js"
 * @import {StartedPush, Workspace} from "../data/protocol.js"
 * @import {MonitorEvents} from "./shown-run.js"
 * @typedef {{component: string, awaited?: boolean, tab?: number, structure?: LiveStructure}} Next
 */

import {notify, notifyError, clearErrors} from "../kit/notices.js";
import {page} from "../data/page.js";
import {started} from "../data/component-status.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";
import {Breakpoints} from "./breakpoints.js";
import {Followed} from "./followed.js";
import {ShownRun} from "./shown-run.js";
import {RobotFacts} from "./structure.js";

/** `ComponentStatus` of interfaces/hfsm.idl. */
export const STATUS = ["running", "paused", "halted"];
/** A status in words. @param {number} status */
export const spokenStatus = (status) => [t("Running"), t("Paused"), t("Halted")][status];
/** `TransitionKind` of interfaces/hfsm.idl. */
export const ON_TIME = 1;
export const ON_EVENT = 2;

/** Chooses what is followed, takes what it sends, and steers it. */
class Monitor extends ShownRun {
  breakpoints = new Breakpoints(this);
  robot = new RobotFacts();
  /** Whether the canvas follows the deepest active automaton. */
  follows = false;

  /**
   * What is followed next: it was asked for, or is `awaited`, until it is present again. The component of a `tab` is known
   * when that starts; a structure may come before the answer.
   *
   * @type {Next | undefined}
   */
  #next;
  /** What the user follows no more, until its next run or until a document is shown. */
  #left = "";

  constructor() {
    super();
    store.addEventListener("snapshot", ({detail}) => detail.component === this.component && this.#take(detail.value));
    store.addEventListener("structure", ({detail}) => {
      if (detail.component === this.component) this.#learn(detail.value);
      else if (detail.component === this.#next?.component) this.#next.structure = detail.value;
    });
    store.addEventListener("stale", ({detail}) => detail.component === this.component && this.#lose(detail.since));
    store.addEventListener("workspace", ({detail}) => this.#look(detail.former));
    page.addEventListener("tab", () => this.#look());
    store.addEventListener("connection", () => this.#reconnect());
    store.addEventListener("started", ({detail}) => this.#takeStarted(detail));
    store.addEventListener("closed", ({detail}) => this.#closed(detail.tab));
  }

  /**
   * Start the component of a tab, and follow it by the answer.
   *
   * @template {Answers["start"] | null | undefined} Answer
   * @param {number} tab
   * @param {() => Promise<Answer>} request that starts it
   */
  start(tab, request) {
    return this.#turn({component: "", tab}, request);
  }

  /** The tab whose component this window is about to start; 0 without one. */
  get starting() {
    return this.#next?.tab ?? 0;
  }

  /**
   * Follow a component; a run that this window did not start is only watched until the user allows more.
   *
   * @param {string} component
   */
  async follow(component) {
    if (this.component === component && !this.recording) return true;
    await this.#turn({component}, () => store.request("follow", {component}).catch(notifyError));
    return this.component === component;
  }

  /**
   * Turn to what a request asks for, unless something else was asked for meanwhile, or it has ended.
   *
   * @template {Reported | null | undefined | void} Answer
   * @param {Next} next
   * @param {() => Promise<Answer>} request
   */
  async #turn(next, request) {
    this.#next = next;
    const answer = await request();
    const isNext = this.#next === next;
    if (isNext) this.#next = undefined;
    if (!answer) return answer;
    const {component} = next;
    if (!isNext) {
      if (![this.component, this.#next?.component].includes(component))
        store.request("unfollow", {component}).catch(() => {}); // it is gone already
      return answer;
    }
    if (this.component !== component) {
      this.unfollow();
    } else if (next.tab) {
      this.lookAt(undefined); // its next run is followed, too
      return answer;
    }
    this.followed.component = component;
    this.followed.writable = this.starts.running.has(component);
    this.#begin({...answer, structure: next.structure ?? answer.structure});
    return answer;
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
    await this.unfollow();
    this.#next = undefined;
    const {followed} = this;
    const {component, shortened, tab, world, cameras, body} = found;
    followed.component = component;
    followed.writable = false;
    followed.recording = {file: path, shortened, tab, world, cameras, body};
    this.#begin(found);
    followed.looking = found.snapshot ?? undefined;
    this.#emit("mode", "shown");
  }

  /** Follow nothing, as the user wants it, until there is a reason. */
  leave() {
    this.#left = this.component;
    return this.unfollow();
  }

  /** Follow nothing. */
  async unfollow() {
    const {component} = this;
    if (!component) return;
    this.followed = new Followed();
    this.breakpoints = new Breakpoints(this);
    this.#emit("structure", "shown");
    this.#emit("mode", "shown");
    if (store.online) await store.request("unfollow", {component}).catch(() => {}); // it is gone already
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

  /** What was found for a moment of the past, and the component time of that: it lasts until the next snapshot. */
  #moment = {snapshot: /** @type {LiveSnapshot | undefined} */ (undefined), time: 0};

  /** The component time that is shown, s. */
  get time() {
    const {snapshot, time} = this.#moment;
    return this.looking && this.looking === snapshot ? time : this.snapshot?.component.time;
  }

  /**
   * Show a moment of the past, or with undefined what happens now.
   *
   * @param {LiveSnapshot | undefined} snapshot @param {number} [time] for which it was found
   */
  lookAt(snapshot, time = snapshot?.component.time ?? 0) {
    this.#moment = {snapshot, time};
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
    return store.request(op, .../** @type {any} */ ([{component: this.component, ...fields}]));
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
    this.breakpoints.catchUp();
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
    this.breakpoints.catchUp();
  }

  /** @param {LiveSnapshot} value */
  #take(value) {
    const {first, restarted, changed} = this.followed.take(value);
    if (restarted && this.followed.isAhead) this.breakpoints.keep();
    if (first || restarted) {
      this.#judge(value.component.startedAt);
      this.breakpoints.catchUp();
    }
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
          "Another run of {component} has begun, which this window did not start: it is only watched until you take control.",
          {component: this.component},
        ),
      );
  }

  /** A component was started from a tab, or has ended. @param {StartedPush} run */
  #takeStarted(run) {
    const {tab, component, status} = run;
    this.starts.tabs.set(component, tab);
    const begins = !["stopping", "ended"].includes(status); // a slow window may not see each status
    if (begins && this.#next?.tab === tab) {
      this.#next.component = component;
      this.starts.running.add(component);
    }
    if (begins && component === this.component) this.followed.begun = true;
    if (status !== "ended") return;
    if (component === this.#next?.component) this.#next = undefined;
    this.starts.running.delete(component);
    if (component === this.component) this.end(run.place || !this.ended ? started.endOf(run) : this.ended.message);
  }

  /** A component ends with the tab from which it was started, a recording with its own. @param {number} tab */
  #closed(tab) {
    if ((this.recording ? this.recording.tab : this.starts.tabs.get(this.component)) === tab) this.unfollow();
  }

  /** @param {number} since */
  #lose(since) {
    if (since === this.since) return;
    this.followed.since = since;
    this.#emit("mode", "shown");
  }

  /**
   * Follow again what is present again, and the component of the shown document whenever it runs: when the document is
   * shown, when the run begins, when what was followed has ended. Viewers start nothing: they see any document that runs.
   *
   * @param {Pick<Workspace, "present">} [former]
   */
  #look(former) {
    const {present} = this;
    const next = this.#next;
    if (!former || !present.includes(this.#left)) this.#left = "";
    const isFree = !this.component || this.since || this.ended;
    /** @param {string} name */
    const begun = (name) => !former?.present.some(({component}) => component === name);
    const shown = page.tabState?.component ?? "";
    const others = viewing.on && isFree ? store.workspace.tabs.map(({component}) => component).filter(begun) : [];
    const wanted = isFree || begun(shown) ? [shown, ...others] : others;
    const found = wanted.find((name) => present.includes(name) && name !== this.#left);
    if (next?.awaited && present.includes(next.component)) this.#followAside({...next, awaited: false});
    else if (found && found !== this.component && !this.recording && !this.looking && (!next || next.awaited))
      this.#followAside({component: found});
    this.#emit("present");
  }

  /** Follow what nobody has asked for: if it is gone by now, nothing is said. @param {Next} next */
  #followAside(next) {
    const failed = () => this.#emit("mode", "shown");
    this.#turn(next, () => store.request("follow", {component: next.component}).catch(failed));
  }

  #reconnect() {
    if (this.recording) return;
    if (store.online) {
      this.#look();
      return;
    }
    this.starts.running.clear(); // components may end unseen while offline
    if (this.component) {
      this.followed.since ||= Date.now() / 1000;
      this.#next = {component: this.component, awaited: true};
      this.#emit("mode", "shown");
    }
  }

  /** @param {...keyof MonitorEvents} kinds */
  #emit(...kinds) {
    for (const kind of kinds) this.dispatchEvent(new Event(kind));
  }
}

/** The component that this window follows. */
export const monitor = new Monitor();
