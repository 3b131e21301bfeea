/** The data of the shown automaton and of the component, beside the canvas. */

import {html} from "lit";
import {PageElement} from "../element.js";
import {page} from "../page.js";
import "./code-field.js";
import "./entries.js";
import "./text-field.js";
import {automatonData} from "./automaton-data.js";
import {componentData} from "./component-data.js";
import {known, loadIdentities, loadInterfaces} from "./known-interfaces.js";
import {placeOf} from "./places.js";
import {tabStrip} from "./tabs.js";

const OF_AUTOMATON = new Set(["timing", "period", "variables", "functions", "inputs", "import"]);

class DataPanel extends PageElement {
  static properties = {section: {attribute: false}, place: {attribute: false}, half: {state: true}};
  static watches = {page: ["change"], store: ["document", "problems"]};

  #wanted = 0;

  constructor() {
    super();
    /** @type {"automaton" | "component"} */
    this.half = "automaton";
    this.context = undefined;
  }

  connectedCallback() {
    super.connectedCallback();
    for (const loaded of [loadInterfaces(), loadIdentities()]) loaded.then(() => this.requestUpdate());
  }

  /** Show a section; set by the page when somebody wants to see it, and followed by `place`. */
  set section(section) {
    if (section) this.revealed = this.#reveal({part: section});
  }

  /** Show a place in a section. */
  set place(place) {
    if (place) this.revealed = this.#reveal(place);
  }

  /** Resolves when what was asked for has the focus. */
  revealed = Promise.resolve();

  render() {
    const {document, automaton} = page;
    if (!document || !automaton) return html`<div class="data-panel"><p class="empty">No document is open.</p></div>`;
    const problems = document.problems;
    const ofAutomaton = problems.filter((each) => placeOf(each).kind === "automaton" && placeOf(each).automaton === automaton.id);
    const ofComponent = problems.filter((each) => placeOf(each).kind === "document" && placeOf(each).part);
    const tabs = [
      {id: "automaton", label: `Automaton ${page.title()}`, problems: ofAutomaton},
      {id: "component", label: "Component", problems: ofComponent},
    ];
    const about = {tab: page.tab, document, automaton};
    return html`<div class="data-panel" @keydown=${this.#press}>
      ${tabStrip({label: "Whose data", tabs, chosen: this.half, choose: (half) => (this.half = half), prefix: "data"})}
      <div class="tab-panel scrolling" role="tabpanel" id="data-panel" aria-labelledby="data-tab-${this.half}">
        ${this.half === "automaton" ? automatonData(about) : componentData({...about, known: known(), showProblems: () => this.context?.app.showBottom("hfsm-problems")})}
      </div></div>`;
  }

  async #reveal(place) {
    const part = place.part === "timing" ? "period" : place.part;
    this.half = OF_AUTOMATON.has(place.part) ? "automaton" : "component";
    const number = ++this.#wanted;
    this.requestUpdate();
    await this.updateComplete;
    if (number !== this.#wanted) return;
    const section = this.querySelector(`[data-section="${part}"]`);
    if (!section) return;
    section.scrollIntoView({block: "start"});
    const {line, column, focus = true} = place;
    if (section.reveal) await (place.index === undefined ? focusFirst(section) : section.reveal(place.index, place.name));
    else if (section.goTo && line) await section.goTo(line, column, {focus});
    else if (focus) await (section.goTo ? section : section.querySelector("hfsm-text-field, hfsm-code-field") ?? section).focus();
  }

  #press = (event) => {
    if (event.key !== "Escape" || event.defaultPrevented) return;
    event.preventDefault();
    page.dispatchEvent(new Event("focus-canvas"));
  };
}

async function focusFirst(list) {
  await list.updateComplete;
  list.querySelector("input, button.add")?.focus();
}

customElements.define("hfsm-data-panel", DataPanel);
