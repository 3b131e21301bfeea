/**
 * The values of a component and its robot, beside the canvas.
 *
 * @import {From} from "../data/element.js"
 */

import {html, svg} from "lit";

import {messageOf, notifyError} from "../kit/notices.js";
import {page} from "../data/page.js";
import {tabStrip} from "../kit/tabs.js";
import {required} from "../kit/existence.js";
import {browserStorage} from "../kit/location.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {MonitorElement, nothingRuns} from "./element.js";
import {monitor} from "./monitor.js";

/**
 * The tabs, with element and module, loaded when first chosen. Those of the `robot` alone need no component.
 *
 * @type {{id: string, label: string, tag: string, module: string, robot?: boolean}[]}
 */
const TABS = [
  {id: "dryRun", label: t("Try it"), tag: "hfsm-dry-run", module: "./dry-run.js"},
  {id: "variables", label: t("Variables"), tag: "hfsm-live-variables", module: "./variables.js"},
  {id: "plots", label: t("Plots"), tag: "hfsm-plots", module: "./plots.js"},
  {id: "cameras", label: t("Cameras"), tag: "hfsm-cameras", module: "../robot3d/cameras.js", robot: true},
  // Translators: a tab of the narrow panel, with the joints and the health of the robot: the shortest word
  {id: "robot", label: t("Joints"), tag: "hfsm-joints", module: "../robot3d/joints.js"},
  {id: "view", label: "3D", tag: "hfsm-robot-view", module: "../robot3d/robot-view.js", robot: true},
  {id: "cycles", label: t("Cycles"), tag: "hfsm-cycles", module: "./cycles.js"},
  {id: "errors", label: t("Errors"), tag: "hfsm-live-errors", module: "./errors.js"},
];

const SIGNS_SHOWN = "visualhfsm.signsShown";

/* The legend of the signs on the canvas while a component is followed. */

/** @param {string} kind */
const circle = (kind) =>
  svg`<g class="state ${kind}" transform="translate(15,12)"><circle class="body" r="8"></circle></g>`;
const SIGNS = [
  [t("current"), circle("active")],
  [t("ghost: kept while its state above is not current"), circle("ghost")],
  [t("just left"), circle("trail")],
  [
    t("finished"),
    svg`<g class="state active finished" transform="translate(15,12)">
      <circle class="body" r="8"></circle><path class="finished-sign" d="M-3.500 0L-1 2.500L3.500-2.500"></path></g>`,
  ],
  [t("hanging: its code does not end"), circle("active hanging")],
  [
    t("fired last"),
    svg`<g class="transition fired">
      <path class="glow" d="M2 14Q15 2 28 14"></path><path class="line" d="M2 14Q15 2 28 14"></path></g>`,
  ],
  [
    t("remaining time"),
    svg`<g class="transition waiting"><g transform="translate(15,12)">
      <circle class="knob" r="7"></circle>
      <circle class="timer" r="9" pathLength="1" stroke-dasharray="0.65 1"></circle></g></g>`,
  ],
  [t("breakpoint"), svg`<circle class="legend-break" cx="15" cy="12" r="5.5"></circle>`],
];

/** The signs; the browser remembers whether they are explained. */
const liveLegend = () =>
  html`<details
    class="live-legend"
    ?open=${browserStorage.getItem(SIGNS_SHOWN) === "yes"}
    @toggle=${(/** @type {From<HTMLDetailsElement>} */ {currentTarget}) =>
      browserStorage.setItem(SIGNS_SHOWN, currentTarget.open ? "yes" : "no")}
  >
    <summary>${t("Signs on the canvas")}</summary>
    <ul>
      ${SIGNS.map(
        ([words, sign]) =>
          html`<li>
            <svg width="30" height="24" viewBox="0 0 30 24" aria-hidden="true">${sign}</svg><span>${words}</span>
          </li>`,
      )}
    </ul>
  </details>`;

export class MonitorPanel extends MonitorElement {
  static properties = {chosen: {state: true}};
  /** @type {typeof MonitorElement.watches} */
  static watches = {page: ["tab"], store: ["robot"]};

  constructor() {
    super();
    this.chosen = "variables";
    /** The elements of the tabs that were chosen. @type {Map<string, HTMLElement>} */
    this.elements = new Map();
  }

  connectedCallback() {
    super.connectedCallback();
    this.choose(this.chosen);
  }

  focusFirst() {
    /** @type {HTMLElement | null} */ (this.querySelector("[role=tab][aria-selected=true]"))?.focus();
  }

  /** Whether a component is followed, and not over while another document is shown. */
  get #hasRun() {
    return monitor.isShownBeside(page.tab);
  }

  /**
   * The tabs that have something to show; without a component, those of a present robot. A dry run has no pictures of the
   * robot's cameras.
   */
  get #tabs() {
    if (this.#hasRun) return TABS.filter(({id}) => id !== (monitor.isDryRun ? "cameras" : "dryRun"));
    return TABS.filter(({robot}) => robot && store.robot.status === "present");
  }

  /** The shown tab: the chosen one, if it has something to show. */
  get #shown() {
    const tabs = this.#tabs;
    return (tabs.find(({id}) => id === this.chosen) ?? tabs.at(this.#hasRun ? 0 : -1))?.id ?? "";
  }

  render() {
    const tabs = this.#tabs.map(({id, label}) => ({id, label, filled: id === "errors" && hasErrors()}));
    if (!tabs.length) return html`<div class="empty">${nothingRuns(this.context)}</div>`;
    const shown = this.#shown;
    return html`<div class="monitor-panel">
      ${tabStrip({label: t("Live values"), tabs, chosen: shown, choose: (id) => this.choose(id), prefix: "live"})}
      <div class="tab-panel" role="tabpanel" tabindex="0" id="live-panel" aria-labelledby="live-tab-${shown}"></div>
      ${this.#hasRun ? liveLegend() : html`<div class="live-legend">${nothingRuns(this.context)}</div>`}
    </div>`;
  }

  /** @param {import("lit").PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    if (!this.#hasRun && this.#tabs.length) monitor.learnRobot();
    const element = this.elements.get(this.#shown);
    const place = this.querySelector("#live-panel");
    // The robot in 3D may have been above the panel meanwhile.
    if (place && place.firstElementChild !== (element ?? null)) place.replaceChildren(...(element ? [element] : []));
    this.#load(this.#shown);
  }

  /** Show one of the tabs. @param {string} id */
  async choose(id) {
    this.chosen = id;
    await this.#load(id);
  }

  /** @param {string} id */
  async #load(id) {
    if (!id || this.elements.has(id)) return;
    const {tag, module} = required(
      TABS.find((each) => each.id === id),
      "such tab",
    );
    /** @type {{theView?: () => HTMLElement}} */
    let loaded;
    try {
      loaded = await import(module);
    } catch (error) {
      notifyError(new Error(t("{file} could not be loaded: {reason}", {file: module, reason: messageOf(error)})));
      return;
    }
    if (!this.elements.has(id)) this.elements.set(id, loaded.theView?.() ?? document.createElement(tag));
    this.requestUpdate();
  }
}

const hasErrors = () => Boolean(monitor.snapshot?.component.errors.length);

customElements.define("hfsm-monitor-panel", MonitorPanel);
