/**
 * The robot and its world in 3D, at the shown moment. three.js is loaded with this module.
 *
 * @import {Other} from "./robot-drawing.js"
 * @import {WorldShape} from "./world-drawing.js"
 */

import {html, nothing} from "lit";

import {messageOf, notify, notifyError} from "../kit/notices.js";
import {required} from "../kit/existence.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";
import {bodyOf} from "./bodies.js";
import {MonitorElement, whyUnknown} from "../run/element.js";
import {receiveFrames} from "./frames.js";
import {Grabbing} from "./grabbing.js";
import {isEnabled, perform} from "../kit/registry.js";
import {monitor} from "../run/monitor.js";
import {RobotDrawing} from "./robot-drawing.js";
import {scrubbing} from "../run/scrubbing.js";
import {WhatIf} from "./what-if.js";

const IDLE = 200; // ms between two frames that are received but not shown
/** @type {WorldShape[]} */
const NOTHING = [];
const SILENT = {says: "", sound: ""};

/** @type {{id: import("./viewpoints.js").View, label: string, title: string}[]} */
const VIEWS = [
  {id: "home", label: t("Home"), title: t("The robot and all that it can reach; resets the view")},
  {id: "around", label: t("Around"), title: t("The robot and what is near it")},
  {id: "top", label: t("Top"), title: t("From above")},
  {id: "follow", label: t("Behind"), title: t("From behind the robot, wherever it walks")},
  {id: "head", label: t("Head"), title: t("As the robot's first camera sees it")},
];

/** @param {string} kind @param {string} words @param {string} title @param {boolean} pressed @param {() => unknown} act */
const toggle = (kind, words, title, pressed, act) =>
  html`<button type="button" class=${kind} title=${title} aria-pressed=${pressed} @click=${act}>${words}</button>`;

export class RobotView extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "shown"];
  /** @type {typeof MonitorElement.watches} */
  static watches = {page: ["change"], store: ["document", "robot"]};
  static properties = {
    problem: {state: true},
    message: {state: true},
    simulated: {state: true},
    pushes: {state: true},
    says: {state: true},
    sees: {state: true},
    heard: {state: true},
    films: {state: true},
    watched: {state: true},
    aims: {state: true},
  };

  constructor() {
    super();
    /** Whether a video is being made. */
    this.films = false;
    /** Why nothing is drawn. @type {string | undefined} */
    this.problem = undefined;
    /** The result of moving something. */
    this.message = "";
    /** Whether it is a simulation, whose things can be moved. */
    this.simulated = false;
    /** Whether dragging the robot pushes it. */
    this.pushes = false;
    /** Whether a click gives the selected state its place. */
    this.aims = false;
    /** Whether there is a line for what the robot is to hear. */
    this.says = false;
    /** Whether the robot has a camera. */
    this.sees = true;
    /** The text that the present robot says, and the name of the sound that it plays. */
    this.heard = SILENT;
    /** @type {ReturnType<typeof receiveFrames> | undefined} */
    this.frames = undefined;
    /** @type {RobotDrawing | undefined} */
    this.drawing = undefined;
    /** The present robot, by the hash of its description; "" while it is unknown. */
    this.body = "";
    /** Why the present robot cannot be drawn. */
    this.why = "";
    /** What the robot that is drawn is called. */
    this.robotTitle = "";
    /** The robot that is drawn, or on its way. */
    this.worn = "";
    /** The present world. @type {WorldShape[]} */
    this.world = [];
    /** The world that is drawn. @type {WorldShape[] | undefined} */
    this.shown = undefined;
    /** @type {Grabbing | undefined} */
    this.grabbing = undefined;
    /** Other robots of the world of which it is asked how they look. @type {Set<string>} */
    this.coming = new Set();
    /** Places by a click, once that has loaded. @type {import("./pointing.js").Pointing | undefined} */
    this.pointing = undefined;
    /** The other robot of the world that the view follows, until *Home* is chosen. */
    this.watched = "";
    /** What fails, and is to fail. */
    this.whatIf = new WhatIf(this);
    /** Whether this browser cannot draw in 3D. */
    this.impossible = false;
  }

  connectedCallback() {
    super.connectedCallback();
    this.dispatchEvent(new Event("moved"));
  }

  render() {
    const {problem} = this;
    return html`<div class="robot-view ${problem && monitor.looking ? "unknown" : ""}">
      <div class="view-tools" role="toolbar" aria-label=${t("View")}>
        ${VIEWS.filter(({id}) => this.sees || id !== "head").map(
          ({id, label, title}) =>
            html`<button type="button" title=${title} @click=${() => this.#look(id)}>${label}</button>`,
        )}
        ${
          this.#mayTouch && !this.asks
            ? [
                toggle(
                  "push",
                  t("Push"),
                  t("Drag the robot to push it"),
                  this.pushes,
                  () => (this.pushes = !this.pushes),
                ),
                toggle(
                  "say",
                  t("Say"),
                  t("Say something to the robot, which programs for NAOqi recognize"),
                  this.says,
                  () => (this.says = !this.says),
                ),
              ]
            : nothing
        }
        ${
          this.#mayFail
            ? toggle("what-if-button", t("What if…"), t("Let a part of the robot fail"), this.asks, () =>
                this.#toggleWhatIf(),
              )
            : nothing
        }
        ${
          monitor.looking && !store.exported
            ? toggle(
                "video",
                this.films ? t("● Stop and save") : t("Save as video"),
                t("Save what is seen here until the end, or until you pause, as a video"),
                this.films,
                () => this.#toggleVideo(),
              )
            : nothing
        }
      </div>
      <div class="stage">${this.#caption()}</div>
      ${this.#mayTouch && this.says ? this.#sentence() : nothing} ${this.whatIf.render()}
      <p class="robot-hint faint ${problem === undefined ? "" : "problem"}" role="status">
        ${problem ?? (this.message || this.#hint())}
      </p>
    </div>`;
  }

  /** Whether the robot that is shown can be pushed and spoken to, and its balls carried. */
  get #mayTouch() {
    return this.simulated && !monitor.looking && !viewing.on;
  }

  /** Whether parts of the robot that is shown can be made to fail. */
  get #mayFail() {
    return Boolean(this.whatIf.failing.can.length) && !store.exported && isEnabled("whatIf", this.context);
  }

  /** Whether the present robot is shown. */
  get isNow() {
    return !monitor.body && !monitor.isDryRun;
  }

  /** Whether it is asked what should fail, for which there is no room above the code. */
  get asks() {
    return this.whatIf.open && this.#mayFail && !this.closest(".dock");
  }

  /** Ask what should fail, in the panel, or no longer. */
  #toggleWhatIf() {
    if (!this.asks) return perform("whatIf", this.context);
    this.whatIf.open = false;
    this.message = "";
    return this.requestUpdate();
  }

  /** Whether the selected state can get a place that is pointed at. */
  get #mayPoint() {
    return !this.asks && !this.pushes && !this.watched && !monitor.looking && !monitor.recording && !viewing.on;
  }

  /** What is heard, in a region that is always there, so that screen readers read what comes into it. */
  #caption() {
    const {says, sound} = monitor.looking?.robot ?? (monitor.body || monitor.isDryRun ? SILENT : this.heard);
    return html`<div class="heard" aria-live="polite">
      ${says ? html`<p dir="auto">${t("“{text}”", {text: says})}</p>` : nothing}
      ${sound ? html`<p><span aria-hidden="true">♪</span> ${sound}</p>` : nothing}
    </div>`;
  }

  /** Make a video, or end the one that is being made. */
  async #toggleVideo() {
    if (this.films) return scrubbing.pause();
    if (!this.drawing) return undefined;
    this.films = true;
    try {
      await (await import("./video.js")).saveVideo(this.drawing);
    } catch (error) {
      notifyError(error);
    }
    this.films = false;
    return undefined;
  }

  /** The line in which somebody types what the robot is to hear. */
  #sentence() {
    return html`<form class="sentence" @submit=${this.#say}>
      <input
        name="text"
        maxlength="500"
        required
        autocomplete="off"
        placeholder=${t("Say something to the robot")}
        aria-label=${t("Say something to the robot")}
      />
      <button type="submit">${t("Say it")}</button>
    </form>`;
  }

  /** @param {SubmitEvent} event */
  async #say(event) {
    event.preventDefault();
    const form = /** @type {HTMLFormElement} */ (event.target);
    const text = String(new FormData(form).get("text"));
    try {
      const understood = await store.request("sayToRobot", {text});
      this.message = understood ? t("It understood: {words}", {words: understood}) : t("No program recognized that.");
      form.reset();
    } catch (error) {
      this.message = messageOf(error);
    }
  }

  #hint() {
    if (!monitor.looking && monitor.newest?.robot.health?.fallen && !this.simulated)
      return t("It has fallen. A real robot reports how far it is tilted, but not to which side.");
    if (this.asks) return t("Click a part of the robot to choose it, and again for what else is there.");
    if (this.watched) return t("This is {name}. Home returns to your own robot.", {name: this.watched});
    const aimed = this.aims && this.pointing?.aimed;
    if (aimed) return t("Click a place for the state “{name}”.", {name: aimed.state.name});
    if (this.pushes) return t("Drag the robot to push it, a ball to carry it.");
    return this.#mayTouch
      ? t("Drag to turn, with Shift to move, use the wheel to zoom. Drag a ball to carry it.")
      : t("Drag to turn, with Shift to move, use the wheel to zoom.");
  }

  /** @param {import("lit").PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    if (!this.frames && this.isConnected) this.#begin();
    this.#wear();
    this.#learn();
    this.#showPast();
    this.whatIf.show();
    if (this.pointing) {
      this.pointing.enabled = this.#mayPoint && store.online;
      this.pointing.show();
      this.aims = Boolean(this.pointing.aimed); // after the body, which may have come just now
    }
    if (!this.grabbing) return;
    this.grabbing.enabled = this.#mayTouch && store.online;
    this.grabbing.pushes = this.pushes && !this.asks;
  }

  /** What was drawn is kept when it moves to another place of the page. */
  disconnectedCallback() {
    super.disconnectedCallback();
    this.dispatchEvent(new Event("moved"));
    setTimeout(() => this.isConnected || this.#end());
  }

  #end() {
    this.frames?.close();
    this.grabbing?.close();
    this.pointing?.close();
    this.whatIf.end();
    this.heard = SILENT;
    this.drawing?.close();
    this.frames = this.drawing = this.grabbing = this.pointing = this.shown = undefined;
    this.worn = "";
  }

  #begin() {
    /** @type {HTMLElement | null} */
    const stage = this.querySelector(".stage");
    try {
      this.drawing = new RobotDrawing(required(stage, "place for it"));
    } catch {
      this.problem = t("This browser cannot draw in 3D: WebGL is switched off or missing. The cameras show the robot.");
      this.frames = {close() {}};
      this.impossible = true;
      this.dispatchEvent(new Event("impossible"));
      return;
    }
    this.whatIf.begin(this.drawing);
    this.grabbing = new Grabbing(this.drawing, {
      place: async (name, position) => {
        await letRest(name);
        await store.request("placeObject", {name, position});
      },
      push: (force, seconds) => store.request("pushRobot", {force, seconds}),
      report: (message) => (this.message = message),
    });
    if (!store.exported) this.#loadPointing(this.drawing);
    this.frames = receiveFrames("poses", {
      draw: async (frame) => {
        if (!this.drawing) return;
        const content = JSON.parse(new TextDecoder().decode(frame));
        if (content.body !== undefined) {
          this.body = content.body;
          this.why = content.why;
          await this.#wear();
        } else if (content.world) this.#learn(content.world);
        else if (content.heard) this.heard = content.heard;
        else if (content.failing) this.whatIf.learn(content.failing);
        else await this.#showNow(content);
      },
      lost: (reason) => {
        this.problem = reason || t("The editor is offline.");
        this.heard = SILENT;
      },
    });
  }

  /** @param {RobotDrawing} drawing */
  async #loadPointing(drawing) {
    const {Pointing} = await import("./pointing.js");
    if (this.drawing !== drawing) return;
    this.pointing = new Pointing(drawing);
    this.requestUpdate();
  }

  /** @param {import("./robot-drawing.js").Moment} moment */
  async #showNow(moment) {
    this.simulated = moment.torso !== null && !monitor.isDryRun;
    if (monitor.body) {
      this.#showPast();
      await new Promise((resolve) => setTimeout(resolve, IDLE));
      return;
    }
    await this.#wear();
    this.#meet(moment.others ?? {});
    const known = this.drawing?.pose(moment);
    this.problem = known ? undefined : this.why || whyUnknown();
    this.pointing?.show();
    if (!document.hidden) await this.drawing?.drawn();
  }

  /**
   * Show the present world, that of a recording, or none in a dry run.
   *
   * @param {WorldShape[]} [world] the present one, if it has changed
   */
  #learn(world = this.world) {
    this.world = world;
    const shown = monitor.recording?.world ?? (monitor.isDryRun ? NOTHING : world);
    if (this.shown === shown || !this.drawing) return;
    this.shown = shown;
    this.drawing.world.build(shown);
  }

  /** Draw the robot of the recording, of the dry run, or the present one. */
  async #wear() {
    const hash = monitor.recording?.body ?? (monitor.dryRunBody || this.body);
    if (hash === this.worn || !this.drawing) return;
    this.worn = hash;
    this.whatIf.painting?.clear();
    this.drawing.clear();
    if (!hash) return;
    try {
      const described = await bodyOf(hash);
      if (hash !== this.worn || !this.drawing) return;
      this.drawing.build(described);
      this.sees = described.eye !== undefined;
      this.robotTitle = described.title;
      this.requestUpdate();
      this.dispatchEvent(new Event("moved"));
      this.#showPast();
    } catch {
      if (hash === this.worn) this.worn = ""; // the next moment asks again
    }
  }

  /** Draw the other robots of the world, once it is known how they look. @param {Record<string, Other>} others */
  #meet(others) {
    const {drawing} = this;
    if (!drawing) return;
    for (const name of drawing.others.keys()) if (!others[name]) drawing.part(name);
    if (!others[this.watched]) this.watched = "";
    if (drawing.watched !== this.watched && (!this.watched || drawing.others.has(this.watched)))
      drawing.watch(this.watched);
    for (const [name, {body}] of Object.entries(others)) {
      if (drawing.others.get(name)?.hash === body || this.coming.has(name)) continue;
      this.coming.add(name);
      bodyOf(body)
        .then((described) => this.drawing?.meet(name, body, described))
        .catch(() => undefined) // the next moment asks again
        .finally(() => this.coming.delete(name));
    }
  }

  /** @param {import("./viewpoints.js").View} view */
  #look(view) {
    if (view === "home") this.watched = "";
    this.drawing?.look(view);
  }

  /** Show the moment of the past or of a dry run, never mixed with the present robot. */
  #showPast() {
    const moment = monitor.body;
    if (!moment || !this.drawing?.body) return;
    const known = this.drawing.pose(moment);
    const why = monitor.recording
      ? t("This recording does not contain the robot's joints.")
      : t("The joints at that time are unknown.");
    this.problem = known ? undefined : why;
  }
}

/** Stop balls whose motion was started here: a carried ball would return to its route. @param {string} name */
async function letRest(name) {
  if (!store.robot.simulation.balls || !name.startsWith("Ball")) return;
  await store.request("moveBalls", {moving: false});
  notify(t("The balls are at rest now: the menu of the robot starts them again."));
}

customElements.define("hfsm-robot-view", RobotView);

/** @type {RobotView | undefined} */
let only;

/** The robot in 3D, which is in one place of the page at a time: browsers limit the contexts of WebGL. */
export const theView = () => (only ??= new RobotView());
