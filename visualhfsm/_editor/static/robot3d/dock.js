/**
 * The robot beside the drawing, above all code: in 3D, or as one of its cameras sees it.
 *
 * @import {From} from "../data/element.js"
 * @import {PropertyValues} from "lit"
 */

import {html, nothing} from "lit";

import {iconButton} from "../kit/icons.js";
import {messageOf, notifyError} from "../kit/notices.js";
import {resizer} from "../kit/resizer.js";
import {browserStorage} from "../kit/location.js";
import {t} from "../kit/texts.js";
import {Camera, cameraNames, titleOf} from "./cameras.js";
import {MonitorElement} from "../run/element.js";
import {monitor} from "../run/monitor.js";
import {store} from "../data/store.js";

const IN_3D = "3D";
const OUTSIDE = "CameraOutside";
const FOLDED = "visualhfsm.robotFolded";
const SHOWS = "visualhfsm.robotShows";
/** Whether it is open unless the user has folded it: in a window that is wide, or high as that of a phone. */
const isRoomy = () => innerWidth >= 700 || innerHeight >= 1.5 * innerWidth;
const SMALLEST = 120;
const LARGEST = 800;

export class RobotDock extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "structure"];
  /** @type {typeof MonitorElement.watches} */
  static watches = {page: [], store: ["robot"]};
  static properties = {folded: {state: true}, shows: {state: true}, view: {state: true}};

  constructor() {
    super();
    const folded = browserStorage.getItem(FOLDED);
    /** Whether it is hidden. */
    this.folded = folded ? folded === "yes" : !isRoomy();
    /** What is shown: `IN_3D`, or the name of a camera. */
    this.shows = browserStorage.getItem(SHOWS) ?? IN_3D;
    /** The robot in 3D, once it has loaded. @type {import("./robot-view.js").RobotView | undefined} */
    this.view = undefined;
    /** The picture of a camera. @type {Camera | undefined} */
    this.camera = undefined;
  }

  #loading = false;

  /** The cameras from which it can be shown; a dry run has no pictures. */
  get #cameras() {
    return monitor.isDryRun ? [] : cameraNames();
  }

  get #shown() {
    const cameras = this.#cameras;
    const [camera = IN_3D] = [this.shows, OUTSIDE, ...cameras].filter((each) => cameras.includes(each));
    return camera === this.shows || this.view?.impossible ? camera : IN_3D;
  }

  /** Whether the panel has the robot in 3D, which exists once. */
  get #elsewhere() {
    return this.#shown === IN_3D && Boolean(this.view?.isConnected && !this.contains(this.view));
  }

  render() {
    if (!monitor.hasRobot || this.folded || this.#elsewhere) return nothing;
    const shown = this.#shown;
    return html`<section class="dock" aria-label=${t("The robot")}>
      <div class="dock-head">
        <select
          aria-label=${t("Picture of the robot")}
          @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => this.#choose(target.value)}
        >
          <option value=${IN_3D} ?disabled=${this.view?.impossible} .selected=${shown === IN_3D}>
            ${t("{robot} in 3D", {robot: (monitor.recording || monitor.isDryRun ? this.view?.robotTitle : store.robot.title) || t("Robot")})}
          </option>
          ${this.#cameras.map(
            (name) => html`<option value=${name} .selected=${name === shown}>${titleOf(name)}</option>`,
          )}
        </select>
        ${iconButton("expand", t("Larger, in the panel"), () => this.context.app.showLive(shown === IN_3D ? "view" : "cameras"))}
        ${iconButton("minus", t("Fold the robot's picture"), () => this.fold(true), {title: t("Fold"), kind: "dock-fold"})}
      </div>
      <div class="dock-picture"></div>
      ${resizer({
        name: t("Height of the robot's picture"),
        variable: "--dock-height",
        along: "y",
        sign: 1,
        smallest: SMALLEST,
        largest: LARGEST,
      })}
    </section>`;
  }

  /** @param {PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    if (monitor.hasRobot && !monitor.component) monitor.learnRobot(); // which cameras it has
    /** @type {HTMLElement | null} */
    const place = this.querySelector(".dock-picture");
    if (place) this.#fill(place);
    this.context.app.requestUpdate(); // its button says whether it is there
  }

  connectedCallback() {
    super.connectedCallback();
    this.requestUpdate();
  }

  /** Fold it away, or show it; the browser remembers it. @param {boolean} folded */
  async fold(folded) {
    const hadFocus = this.contains(document.activeElement);
    this.folded = folded;
    browserStorage.setItem(FOLDED, folded ? "yes" : "no");
    await this.updateComplete;
    /** @type {HTMLElement | null} */
    const button = this.context.app.querySelector(".second-row [data-action=robotDock]");
    if (hadFocus) button?.focus();
  }

  /** @param {string} shows */
  #choose(shows) {
    this.shows = shows;
    browserStorage.setItem(SHOWS, shows);
  }

  /** Put the picture into its place. @param {HTMLElement} place */
  #fill(place) {
    const shown = this.#shown;
    if (shown !== IN_3D) {
      this.camera ??= new Camera();
      Object.assign(this.camera, {name: shown, past: Boolean(monitor.looking)});
      if (this.camera.parentElement !== place) place.replaceChildren(this.camera);
    } else if (!this.view) this.#load();
    else if (!this.view.isConnected) place.replaceChildren(this.view);
  }

  async #load() {
    if (this.#loading) return;
    this.#loading = true;
    try {
      const {theView} = await import("./robot-view.js");
      this.view = theView();
      for (const kind of ["moved", "impossible"]) this.view.addEventListener(kind, () => this.requestUpdate());
    } catch (error) {
      notifyError(
        new Error(t("{file} could not be loaded: {reason}", {file: "robot-view.js", reason: messageOf(error)})),
      );
    }
  }
}

customElements.define("hfsm-robot-dock", RobotDock);
