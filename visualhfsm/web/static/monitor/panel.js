/** The values of a component and its robot, beside the canvas. */

import {html, nothing, svg} from "lit";

import {keyOf} from "../keys.js";
import {messageOf, notifyError} from "../notices.js";
import {tabStrip} from "../panels/tabs.js";
import {required} from "../required.js";
import {MonitorElement} from "./element.js";
import {monitor} from "./monitor.js";

/** What each tab shows, and its module; loaded when it is first chosen. */
const TABS = [
  {id: "variables", label: "Variables", tag: "hfsm-live-variables", module: "./variables.js"},
  {id: "plots", label: "Plots", tag: "hfsm-plots", module: "./plots.js"},
  {id: "cameras", label: "Cameras", tag: "hfsm-cameras", module: "./cameras.js"},
  {id: "robot", label: "Joints", tag: "hfsm-joints", module: "./joints.js"},
  {id: "view", label: "3D", tag: "hfsm-robot-view", module: "./robot-view.js"},
  {id: "cycles", label: "Cycles", tag: "hfsm-cycles", module: "./cycles.js"},
  {id: "errors", label: "Errors", tag: "hfsm-live-errors", module: "./errors.js"},
];

const ROOMY = 480; // px of height from which on the signs are explained without being asked for

/* What the signs on the canvas mean while a component is followed. */

/** @param {string} kind */
const circle = (kind) =>
  svg`<g class="state ${kind}" transform="translate(15,12)">
    <circle class="glow" r="10.5"></circle><circle class="body" r="8"></circle></g>`;
const SIGNS = [
  ["current", circle("active")],
  ["ghost: kept while its state above is not current", circle("ghost")],
  ["just left", circle("trail")],
  [
    "finished",
    svg`<g class="state active finished" transform="translate(15,12)">
      <circle class="body" r="8"></circle><path class="finished-sign" d="M-3.500 0L-1 2.500L3.500-2.500"></path></g>`,
  ],
  [
    "fired last",
    svg`<g class="transition fired">
      <path class="glow" d="M2 14Q15 2 28 14"></path><path class="line" d="M2 14Q15 2 28 14"></path></g>`,
  ],
  [
    "remaining time",
    svg`<g class="transition waiting"><g transform="translate(15,12)">
      <circle class="knob" r="7"></circle>
      <circle class="timer" r="9" pathLength="1" stroke-dasharray="0.65 1"></circle></g></g>`,
  ],
  ["breakpoint", svg`<circle class="legend-break" cx="15" cy="12" r="5.5"></circle>`],
];

/** @param {boolean} open */
const liveLegend = (open) =>
  html`<details class="live-legend" ?open=${open}>
    <summary>Signs on the canvas</summary>
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

  constructor() {
    super();
    this.chosen = "variables";
    /** The elements of the tabs that were chosen. @type {Map<string, HTMLElement>} */
    this.elements = new Map();
    /** Whether there is room to explain the signs. */
    this.roomy = false;
  }

  connectedCallback() {
    super.connectedCallback();
    this.roomy = (this.parentElement?.clientHeight ?? 0) > ROOMY;
    this.choose(this.chosen);
  }

  focusFirst() {
    /** @type {HTMLElement | null} */ (this.querySelector("[role=tab][aria-selected=true]"))?.focus();
  }

  render() {
    if (!monitor.component) {
      return html`<div class="empty">
        <p>Nothing is followed. Press F5 to run this component, or ${keyOf("attach")} to follow a running one.</p>
      </div>`;
    }
    const errors = monitor.snapshot?.component.errors.length ?? 0;
    const tabs = TABS.map(({id, label}) => ({id, label, filled: id === "errors" && errors > 0}));
    return html`<div class="monitor-panel">
      ${tabStrip({label: "Live values", tabs, chosen: this.chosen, choose: (id) => this.choose(id), prefix: "live"})}
      <div class="tab-panel" role="tabpanel" tabindex="0" id="live-panel" aria-labelledby="live-tab-${this.chosen}">
        ${this.elements.get(this.chosen) ?? nothing}
      </div>
      ${liveLegend(this.roomy)}
    </div>`;
  }

  /** Show one of the tabs. @param {string} id */
  async choose(id) {
    this.chosen = id;
    if (this.elements.has(id)) return;
    const {tag, module} = required(
      TABS.find((each) => each.id === id),
      "such tab",
    );
    try {
      await import(module);
    } catch (error) {
      notifyError(new Error(`${module} could not be loaded: ${messageOf(error)}`));
      return;
    }
    if (!this.elements.has(id)) this.elements.set(id, document.createElement(tag));
    this.requestUpdate();
  }
}

customElements.define("hfsm-monitor-panel", MonitorPanel);
