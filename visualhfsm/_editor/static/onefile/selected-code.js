/** The code of the selected element, or the text of a note, in pages that change nothing. */

import {html} from "lit";

import {PageElement} from "../data/element.js";
import {page} from "../data/page.js";
import {automatonPart, notePart, statePart, transitionPart} from "./print.js";
import {t} from "../kit/texts.js";

/** A double click on an element leads there. */
export class SelectedCode extends PageElement {
  connectedCallback() {
    super.connectedCallback();
    this.listen(page, "edit", () => this.scrollIntoView({block: "nearest"}));
  }

  render() {
    const {automaton, state, transition, annotation} = page;
    if (automaton && state) return statePart(automaton, state);
    if (automaton && transition) return transitionPart(automaton, transition, 3);
    if (annotation) return notePart(annotation);
    const hint = html`<p class="empty">${t("Select a state or a transition to read its code.")}</p>`;
    return automaton ? html`${hint}${automatonPart(automaton)}` : hint;
  }
}

customElements.define("hfsm-selected-code", SelectedCode);
