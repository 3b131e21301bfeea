/**
 * Dialogs: the browser's own, which hold the focus, close with Esc and give the focus back.
 *
 * @typedef {[value: string, label: string, kind?: string]} Choice
 */

/**
 * @template T
 * @typedef {(value?: T) => void} Close a dialog
 */

import {html, nothing, render} from "lit";

import {pressHeld} from "./waiting-keys.js";
import {iconButton} from "./icons.js";
import {laterStyles} from "./theme.js";
import {t} from "./texts.js";

/**
 * Show a dialog until it is closed.
 *
 * @template T
 * @param {{title: string, content: (close: Close<T>, redraw: () => void) => unknown,
 *   footer?: (close: Close<T>) => unknown, wide?: boolean}} options
 * @returns {Promise<T | undefined>} the value passed to `close`, undefined after Esc
 */
export function showDialog({title, content, footer, wide = false}) {
  const dialog = document.createElement("dialog");
  dialog.className = wide ? "wide" : "";
  dialog.setAttribute("aria-labelledby", "dialog-title");
  dialog.style.opacity = "0";
  laterStyles().then(() => (dialog.style.opacity = ""));
  const before = /** @type {HTMLElement | null} */ (document.activeElement);
  return new Promise((resolve) => {
    /** @type {T | undefined} */
    let value;
    /** @type {Close<T>} */
    const close = (given) => {
      value = given;
      dialog.close();
    };
    const redraw = () =>
      render(
        html` <header>
            <h2 id="dialog-title">${title}</h2>
            ${iconButton("close", t("Close"), () => close())}
          </header>
          <div
            class="content"
            tabindex=${wide ? 0 : nothing}
            role=${wide ? "group" : nothing}
            aria-labelledby=${wide ? "dialog-title" : nothing}
          >
            ${content(close, redraw)}
          </div>
          ${footer ? html`<footer>${footer(close)}</footer>` : ""}`,
        dialog,
      );
    redraw();
    dialog.addEventListener("close", () => {
      dialog.remove();
      before?.focus?.({preventScroll: true});
      resolve(value);
    });
    dialog.addEventListener("pointerdown", (event) => event.target === dialog && close());
    document.body.append(dialog);
    dialog.showModal();
    /** @type {HTMLElement | null} */
    const first = dialog.querySelector("[autofocus]");
    first?.focus();
    if (first instanceof HTMLInputElement) first.select(); // what is typed replaces a suggestion
    pressHeld();
  });
}

/**
 * Ask for a decision. The last choice has the focus: the one that loses nothing.
 *
 * @param {{title: string, text: string, choices: Choice[]}} options
 * @returns {Promise<string | undefined>}
 */
export function confirm({title, text, choices}) {
  return showDialog({
    title,
    content: () => html`<p>${text}</p>`,
    footer: (/** @type {Close<string>} */ close) =>
      html`<button type="button" class="button" @click=${() => close()}>${t("Cancel")}</button> ${choices.map(
          ([value, label, kind = ""], index) =>
            html`<button
              type="button"
              class="button ${kind}"
              ?autofocus=${index === choices.length - 1}
              @click=${() => close(value)}
            >
              ${label}
            </button>`,
        )}`,
  });
}
