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
    return html`<div class="list-panel">
      <ol class="rows undo-steps" aria-label=${t("Steps, the latest first")} @keydown=${moveAmongRows}>
        ${[...redo].reverse().map(
          ({name, revision}) =>
            html`<li>
              <button type="button" class="row undone" @click=${() => this.#go(revision)} title=${t("Redo up to here")}>
                <span class="message">${name}</span><span class="where">${t("undone")}</span>
              </button>
            </li>`,
        )}
        ${undo.map(
          ({name}, index) =>
            html`<li>
              <button
                type="button"
                class="row"
                aria-current=${index === 0 ? "step" : nothing}
                @click=${() => this.#go(undo[index - 1]?.revision)}
                title=${index === 0 ? t("The document as it is now") : t("Undo to here")}
              >
                <span class="message">${name}</span
                >${index === 0 ? html`<span class="where">${t("now")}</span>` : nothing}
              </button>
            </li>`,
        )}
        <li>
          <button
            type="button"
            class="row"
            aria-current=${undo.length ? nothing : "step"}
            @click=${() => this.#go(undo.at(-1)?.revision)}
            title=${t("Undo everything")}
          >
            <span class="message faint">${undo.length >= 100 ? t("100 steps ago") : t("As it was opened")}</span
            >${undo.length ? nothing : html`<span class="where">${t("now")}</span>`}
          </button>
        </li>
      </ol>
    </div>`;
  }

  /** @param {number | undefined} revision that of the document to go to; undefined for the present one */
  async #go(revision) {
    if (revision !== undefined) await ask("goTo", {tab: page.tab, revision});
  }
}

customElements.define("hfsm-undo-steps", UndoSteps);
