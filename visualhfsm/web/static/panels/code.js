/** What the selected state or transition does: its code, and all else that is known of it. */

import {html} from "lit";
import {PageElement} from "../element.js";
import {page} from "../page.js";
import "./code-field.js";
import "./text-field.js";
import {stateEditor} from "./state-editor.js";
import {transitionEditor} from "./transition-editor.js";

class CodePanel extends PageElement {
  static properties = {place: {attribute: false}, part: {state: true}};
  static watches = {page: ["change"], store: ["document", "problems"]};

  constructor() {
    super();
    /** The part of a state that is shown. */
    this.part = "code";
    this.context = undefined;
  }

  /** Show a piece of code; set by the page when somebody wants to edit it. */
  set place(place) {
    if (place) this.revealed = this.#reveal(place);
  }

  /** Resolves when the piece of code that was asked for has the focus. */
  revealed = Promise.resolve();

  render() {
    const {document, automaton, state, transition} = page;
    if (!document || !(state || transition)) return this.#hint();
    const readonly = Boolean(automaton.imported);
    const about = {tab: page.tab, document, automaton, readonly};
    return html`<div class="code-panel" @keydown=${this.#press}>
      ${
        state
          ? stateEditor({...about, state, part: this.part, choose: (part) => this.#choose(part)})
          : transitionEditor({...about, transition})
      }
    </div>`;
  }

  #hint() {
    const count = page.states.size + page.transitions.size;
    return html`<div class="code-panel">
      <p class="empty">
        ${count > 1 ? "Several things are selected." : "Nothing is selected."} Select one state or one transition to
        edit its code.
      </p>
    </div>`;
  }

  async #choose(part) {
    this.part = part;
    await this.updateComplete;
  }

  async #reveal({kind, part, name, line, column, focus = true}) {
    if (kind === "state" && part && part !== "name") this.part = part;
    this.requestUpdate();
    await this.updateComplete;
    const fields = [...this.querySelectorAll("[data-part]")].filter((each) => each.dataset.part === part);
    const field = fields.find((each) => (each.dataset.name ?? "") === (name ?? "")) ?? fields[0];
    if (!field) return;
    field.scrollIntoView({block: "nearest"});
    if (field.goTo && line) await field.goTo(line, column, {focus});
    else if (focus) await field.focus();
  }

  #press = (event) => {
    if (event.key !== "Escape" || event.defaultPrevented) return;
    event.preventDefault();
    page.dispatchEvent(new Event("focus-canvas"));
  };
}

customElements.define("hfsm-code-panel", CodePanel);
