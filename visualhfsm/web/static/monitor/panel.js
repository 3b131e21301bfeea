/** The values of a component and its robot, beside the canvas. */

import {html, nothing} from "lit";

import {notifyError} from "../notices.js";
import {tabStrip} from "../panels/tabs.js";
import {MonitorElement} from "./element.js";
import {liveLegend} from "./legend.js";
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

class MonitorPanel extends MonitorElement {
  static properties = {context: {attribute: false}, chosen: {state: true}};

  constructor() {
    super();
    this.chosen = "variables";
    this.elements = new Map();
  }

  connectedCallback() {
    super.connectedCallback();
    this.roomy = this.parentElement.clientHeight > ROOMY;
    this.choose(this.chosen);
  }

  focusFirst() {
    this.querySelector("[role=tab][aria-selected=true]")?.focus();
  }

  render() {
    if (!monitor.component) {
      return html`<div class="empty"><p>Nothing is followed. Press F5 to run this component, or Alt+A to follow one that runs already.</p></div>`;
    }
    const errors = monitor.snapshot?.component.errors.length ?? 0;
    const tabs = TABS.map(({id, label}) => ({id, label, filled: id === "errors" && errors > 0}));
    return html`<div class="monitor-panel">
      ${tabStrip({label: "Live values", tabs, chosen: this.chosen, choose: (id) => this.choose(id), prefix: "live"})}
      <div class="tab-panel" role="tabpanel" tabindex="0" id="live-panel" aria-labelledby="live-tab-${this.chosen}">${this.elements.get(this.chosen) ?? nothing}</div>
      ${liveLegend(this.roomy)}</div>`;
  }

  /** Show one of the tabs. */
  async choose(id) {
    this.chosen = id;
    if (this.elements.has(id)) return;
    const {tag, module} = TABS.find((each) => each.id === id);
    try {
      await import(module);
    } catch (error) {
      notifyError(new Error(`${module} could not be loaded: ${error.message}`));
      return;
    }
    if (!this.elements.has(id)) this.elements.set(id, Object.assign(document.createElement(tag), {context: this.context}));
    this.requestUpdate();
  }
}

customElements.define("hfsm-monitor-panel", MonitorPanel);
