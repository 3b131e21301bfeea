/** The steps that can be undone and redone; a click goes to that point. */

import {html, nothing} from "lit";
import {ask} from "../data/commands.js";
import {PageElement} from "../data/element.js";
import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {moveAmongRows} from "../kit/rows.js";

class UndoSteps extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab"], store: ["document"]};

  focusFirst() {
    /** @type {HTMLElement | null} */ (this.querySelector('[aria-current="step"]'))?.focus();
  }

  updated() {
    this.querySelector('[aria-current="step"]')?.scrollIntoView({block: "nearest"});
  }

  render() {
    const {document} = page;
    if (!document) return html`<p class="empty">${t("No document is open.")}</p>`;
    const {undo, redo} = document;
    // The latest first: steps to redo, then the present, then steps to undo.
    const steps = [
      ...redo.toReversed().map(({name, revision}) => ({name, to: revision, title: t("Redo up to here")})),
      ...undo.map(({name}, index) => ({
        name,
        to: undo[index - 1]?.revision,
        title: index ? t("Undo to here") : t("The document as it is now"),
      })),
      {
        name: undo.length >= 100 ? t("100 steps ago") : t("As it was opened"),
        to: undo.at(-1)?.revision,
        title: t("Undo everything"),
      },
    ];
    const now = redo.length;
    return html`<div class="list-panel">
      <ol class="rows undo-steps" aria-label=${t("Steps, the latest first")} @keydown=${moveAmongRows}>
        ${steps.map(
          ({name, to, title}, index) =>
            html`<li>
              <button
                type="button"
                class="row ${index < now ? "undone" : ""}"
                aria-current=${index === now ? "step" : nothing}
                @click=${() => this.#go(to)}
                title=${title}
              >
                <span class="message ${index === steps.length - 1 ? "faint" : ""}">${name}</span
                >${index <= now ? html`<span class="where">${index < now ? t("undone") : t("now")}</span>` : nothing}
              </button>
            </li>`,
        )}
      </ol>
    </div>`;
  }

  /** @param {number | undefined} revision that of the document to go to; undefined for the present one */
  async #go(revision) {
    if (revision !== undefined) await ask("goTo", {tab: page.tab, revision});
  }
}

customElements.define("hfsm-undo-steps", UndoSteps);
