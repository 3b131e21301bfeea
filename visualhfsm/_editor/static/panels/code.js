/**
 * The code and the other data of the selected state or transition.
 *
 * @import {At} from "../data/page.js"
 * @import {Place, State} from "../data/protocol.js"
 * @import {CodeField} from "../code/code-field.js"
 * @import {TextField} from "../code/text-field.js"
 */

import {html} from "lit";
import {PageElement} from "../data/element.js";
import {page} from "../data/page.js";
import {FAILED} from "../data/problems.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {problemsOf} from "../data/places.js";
import {leave} from "./fields.js";
import {annotationEditor} from "./annotation-editor.js";
import {PARTS, isSetByArguments, stateEditor} from "./state-editor.js";
import {transitionEditor} from "./transition-editor.js";

class CodePanel extends PageElement {
  static properties = {place: {attribute: false}, shownPart: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["document", "problems"]};

  constructor() {
    super();
    /** The part of a state that is shown. */
    this.shownPart = "code";
  }

  /** Show a piece of code; set by the page to edit it. @param {Place & At} place */
  set place(place) {
    if (place) this.revealed = this.#reveal(place);
  }

  /** Resolves when the requested piece of code has the focus, to undefined if it has not. @type {Promise<true | void>} */
  revealed = Promise.resolve();

  /** The state that was shown last. */
  #seen = "";

  willUpdate() {
    this.#followSelection();
  }

  /** Show the arguments of another state without code: they are all that can be set there. */
  #followSelection() {
    const {tab, document, automaton, state} = page;
    const seen = `${tab} ${automaton?.id} ${state?.id}`;
    if (seen === this.#seen) return;
    this.#seen = seen;
    if (document && state && isSetByArguments(document, state)) this.shownPart = "argument";
    else this.shownPart = this.#filled(state) ?? (/^(argument|result)$/.test(this.shownPart) ? "code" : this.shownPart);
  }

  /** The shown part of a state if it has code there, else the first one that has. @param {State | undefined} state */
  #filled(state) {
    const filled = PARTS.filter((part) => state?.[part].trim());
    return filled.find((part) => part === this.shownPart) ?? filled[0];
  }

  render() {
    const {document, automaton, state, transition, annotation} = page;
    if (!document || !automaton) return this.#hint();
    const readonly = Boolean(automaton.imported) || store.isRecorded(page.tab);
    const about = {tab: page.tab, document, automaton, readonly};
    const editor = state
      ? stateEditor({...about, state, part: this.shownPart, choose: (part) => this.#choose(part)})
      : transition
        ? transitionEditor({...about, transition})
        : annotation && annotationEditor({...about, annotation});
    if (!editor) return this.#hint();
    const {id = 0} = state ?? transition ?? {};
    const shown = problemsOf(document.problems, {kind: state ? "state" : "transition", automaton: automaton.id, id});
    const failed = shown.some(({code}) => code === FAILED);
    return html`<div class="code-panel ${failed ? "failed" : ""}" @keydown=${leave}>${editor}</div>`;
  }

  #hint() {
    const count = page.selectedCount;
    return html`<div class="code-panel">
      <p class="empty">
        ${
          count > 1
            ? t("Several things are selected. Select one state or one transition to edit its code.")
            : t("Nothing is selected. Select one state or one transition to edit its code.")
        }
      </p>
    </div>`;
  }

  /** @param {string} part */
  async #choose(part) {
    this.shownPart = part;
    await this.updateComplete;
  }

  /** @param {Place & At} place */
  async #reveal({kind, part, name, line, column, length, selects, focus = true}) {
    this.#followSelection();
    if (kind === "state") part ??= this.#filled(page.state) ?? "code";
    if (kind === "state" && part && part !== "name") this.shownPart = part;
    this.requestUpdate();
    await this.updateComplete;
    /** @type {NodeListOf<CodeField | TextField>} */
    const all = this.querySelectorAll("[data-part]");
    const fields = [...all].filter((each) => each.dataset.part === part);
    const field = fields.find((each) => (each.dataset.name ?? "") === (name ?? "")) ?? fields[0];
    if (!field) return undefined;
    field.scrollIntoView({block: "nearest"});
    if ("goTo" in field && line) await field.goTo(line, column, {length, focus});
    else if ("selectValue" in field && selects) await field.selectValue();
    else if (focus) await field.focus();
    return field.matches(":focus-within") || undefined;
  }
}

customElements.define("hfsm-code-panel", CodePanel);
