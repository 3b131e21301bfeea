/** The menu of the robot: start a simulation, change it, put it upright, end it, or connect to a real robot. */

import {html, nothing} from "lit";

import {showDialog} from "../kit/dialog.js";
import {PageElement} from "../data/element.js";
import {icon} from "../kit/icons.js";
import {notifyError} from "../kit/notices.js";
import {bodies, chooseBody, chosenBody, simulate} from "../data/robot.js";
import {browserStorage} from "../kit/location.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";

/** @import {Close} from "../kit/dialog.js" */
/** @import {From} from "../data/element.js" */
/** @import {Requests} from "../data/protocol.js" */

const SPEEDS = ["0.5", "1", "2", "5", "max"];
const ADDRESS = "visualhfsm.robot";
/** The first action of a real robot, as `naoserver-naoqi --start`. @type {[string, string][]} */
const STARTS = [
  ["leave", t("stays as it is")],
  ["stiffen", t("holds its joints where they are")],
  ["stand", t("stands up; it crouches when the connection ends")],
];

class RobotMenu extends PageElement {
  static properties = {world: {state: true}, speed: {state: true}, body: {state: true}, balls: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["robot"]};

  constructor() {
    super();
    /** Choices that are not running yet. @type {string | undefined} */
    this.world = undefined;
    /** @type {string | undefined} */
    this.speed = undefined;
    /** @type {string | undefined} */
    this.body = undefined;
    /** @type {boolean | undefined} */
    this.balls = undefined;
    this.addEventListener("toggle", ({newState}) => newState === "open" && this.#open());
  }

  /** Forget what was chosen and not begun, and take the focus. */
  #open() {
    this.world = this.speed = this.body = this.balls = undefined;
    /** @type {HTMLElement} */
    const first = this.querySelector("select, input, button") ?? this;
    first.focus();
  }

  /** The present choices. */
  get wanted() {
    const {simulation} = store.robot;
    const {world = simulation.world, speed = simulation.speed, body = chosenBody(), balls = simulation.balls} = this;
    return {world, speed, body, balls};
  }

  render() {
    const {status, started, simulated, simulation} = store.robot;
    const {world, speed, body, balls} = this.wanted;
    const worlds = store.greeting.worlds ?? [];
    const known = worlds.find((each) => each.name === world);
    const isHere = status === "present";
    const isForeign = isHere && !started;
    const runs = started === "simulation";
    const changed = world !== simulation.world || speed !== simulation.speed || body !== simulation.body;
    const speeds = SPEEDS.includes(speed) ? SPEEDS : [...SPEEDS, speed];
    return html`
      ${
        isForeign
          ? html`<p class="hint">
              ${t("This robot was not started here. To simulate another one, end it where it was started.")}
            </p>`
          : [
              choice(
                t("Robot"),
                body,
                bodies().map(({name, title}) => [name, title, name]),
                (chosen) => {
                  this.body = chosen;
                  chooseBody(chosen);
                },
              ),
              choice(
                t("World"),
                world,
                worlds.map(({name, description}) => [name, name, description]),
                (chosen) => (this.world = chosen),
              ),
              choice(
                t("Speed"),
                speed,
                speeds.map((each) => [each, each === "max" ? t("as fast as possible") : `${each} x`]),
                (chosen) => (this.speed = chosen),
              ),
            ]
      }
      ${
        (isForeign ? store.robot.hasBalls : known?.balls)
          ? html`<label
              ><span>${t("Balls move")}</span
              ><input
                type="checkbox"
                .checked=${balls}
                @change=${(/** @type {From<HTMLInputElement>} */ {target}) => this.#moveBalls(target.checked)}
            /></label>`
          : nothing
      }
      ${
        runs && changed
          ? html`<p class="hint" role="status">
              ${t("Robot, world and speed change with a restart: the robot stands where it began.")}
            </p>`
          : nothing
      }
      ${
        isForeign
          ? nothing
          : this.#button(
              runs ? "reload" : "run",
              !runs
                ? t("Start a simulation")
                : changed
                  ? t("Restart the simulation with these")
                  : t("Restart the simulation"),
              () => simulate(this.wanted),
              changed || !runs ? "primary" : "",
            )
      }
      ${isHere && store.robot.others.length ? this.#others() : nothing}
      ${isHere && simulated ? this.#button("up", t("Put the robot upright"), () => store.request("standRobot")) : nothing}
      ${isHere && store.robot.stopped ? this.#button("reload", t("Reset the emergency stop"), () => store.request("resetEmergencyStop")) : nothing}
      ${
        started
          ? this.#button("stop", runs ? t("Stop the simulation") : t("End the connection"), () =>
              store.request("endRobot"),
            )
          : nothing
      }
      ${
        isForeign
          ? nothing
          : html`<div role="separator"></div>
              ${this.#button("add", t("Your own robot"), async () => (await import("../dialogs/own-robot.js")).makeRobot())}
              ${this.#button("link", t("Connect to a real robot"), connect)}`
      }
    `;
  }

  /** The other robots of its world. */
  #others() {
    return html`<p class="title">${t("Also in this world")}</p>
      ${store.robot.others.map(({realm, title}) =>
        this.#button("robot", t("Look at {name} ({title})", {name: realm, title}), async () => {
          const {theView} = await import("../robot3d/robot-view.js");
          const view = theView();
          view.watched = realm;
          if (!view.isConnected) await this.context.app.showLive("view");
        }),
      )}
      <div role="separator"></div>`;
  }

  /** @param {string} image @param {string} label @param {() => Promise<unknown>} work */
  #button(image, label, work, kind = "") {
    return html`<button type="button" class="action ${kind}" @click=${() => this.#do(work)}>
      ${icon(image)}<span class="text">${label}</span>
    </button>`;
  }

  /** @param {() => Promise<unknown>} work */
  async #do(work) {
    this.hidePopover();
    await work().catch(notifyError);
  }

  /** @param {boolean} moving */
  async #moveBalls(moving) {
    this.balls = moving;
    if (store.robot.hasBalls) await store.request("moveBalls", {moving}).catch(notifyError);
  }
}

/**
 * A choice among options, each with its label and its title.
 *
 * @param {string} label @param {string} chosen @param {[string, string, string?][]} options
 * @param {(chosen: string) => void} choose
 */
const choice = (label, chosen, options, choose) =>
  html`<label
    ><span>${label}</span
    ><select @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => choose(target.value)}>
      ${options.map(([value, words, title = ""]) => html`<option value=${value} .selected=${value === chosen} title=${title}>${words}</option>`)}
    </select></label
  >`;

/** Ask for the address of a real robot, and whether it may move; then connect to it. */
export async function connect() {
  let address = browserStorage.getItem(ADDRESS) ?? "nao.local";
  /** @type {Requests["connectRobot"]["start"]} */
  let start = "leave";
  let isSafe = false;
  const agreed = await showDialog({
    title: t("Connect to a real robot"),
    content: (/** @type {Close<boolean>} */ close, redraw) =>
      html`<form
        class="robot-form"
        id="robot-form"
        @submit=${(/** @type {Event} */ event) => {
          event.preventDefault();
          if (isSafe && address.trim()) close(true);
        }}
      >
        <label
          ><span>${t("Address")}</span
          ><input
            type="text"
            autofocus
            spellcheck="false"
            .value=${address}
            @input=${(/** @type {From<HTMLInputElement>} */ {target}) => {
              address = target.value;
              redraw();
            }}
        /></label>
        <label
          ><span>${t("At first it")}</span
          ><select
            @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => (start = /** @type {Requests["connectRobot"]["start"]} */ (target.value))}
          >
            ${STARTS.map(([value, label]) => html`<option value=${value}>${label}</option>`)}
          </select></label
        >
        <label class="check"
          ><input
            type="checkbox"
            .checked=${isSafe}
            @change=${(/** @type {From<HTMLInputElement>} */ {target}) => {
              isSafe = target.checked;
              redraw();
            }}
          /><span
            >${t("The robot has free space around it, somebody stands beside it, and nobody is within reach of its arms.")}</span
          ></label
        >
        <div class="submit">
          <button type="submit" class="button primary" ?disabled=${!isSafe || !address.trim()}>${t("Connect")}</button>
        </div>
      </form>`,
  });
  if (!agreed) return;
  browserStorage.setItem(ADDRESS, address.trim());
  await store.request("connectRobot", {address: address.trim(), start});
}

customElements.define("hfsm-robot-menu", RobotMenu);
