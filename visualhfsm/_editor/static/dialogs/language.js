/** Choose the language of the page, which is then loaded again. */

import {html} from "lit";

import {notifyError} from "../kit/notices.js";
import {flushEdits} from "../code/draft.js";
import {browserStorage} from "../kit/location.js";
import {store} from "../data/store.js";
import {CHOSEN, language, languages, t} from "../kit/texts.js";
import {showDialog} from "../kit/dialog.js";

/** A language in its own words. @param {string} code */
function nameOf(code) {
  const name = new Intl.DisplayNames(code, {type: "language"}).of(code) ?? code;
  return name[0].toLocaleUpperCase(code) + name.slice(1);
}

/** Let the user choose a language. */
export async function showLanguages() {
  const chosen = await showDialog({
    title: t("Language"),
    content: (/** @type {import("../kit/dialog.js").Close<string>} */ close) =>
      html`<div class="choices" role="radiogroup" aria-labelledby="dialog-title">
        ${languages.map(
          (code) =>
            html`<button
              type="button"
              role="radio"
              class="button ${code === language ? "primary" : ""}"
              lang=${code}
              aria-checked=${code === language}
              ?autofocus=${code === language}
              @click=${() => close(code)}
            >
              ${nameOf(code)}
            </button>`,
        )}
      </div>`,
  });
  if (chosen && chosen !== language) await change(chosen);
}

/** @param {string} code */
async function change(code) {
  await flushEdits();
  if (!store.online || store.unsaved.size) {
    // Loading the page again would lose what was typed.
    notifyError(
      new Error(t("The language changes once the editor is connected and has what you typed. Try it again.")),
    );
    return;
  }
  browserStorage.setItem(CHOSEN, code);
  location.reload();
}
