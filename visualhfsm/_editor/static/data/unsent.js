/** Typed text that did not reach the server: it is sent after reconnecting, or can at least be copied. */

import {html, nothing} from "lit";

import {notify, notifyError} from "../kit/notices.js";
import {windowStorage} from "../kit/location.js";
import {store} from "./store.js";
import {t} from "../kit/texts.js";

const KEPT = "visualhfsm.unsent";

/** The texts that could not be sent, while the server is offline. */
const waiting = () => [...store.unsaved.values()].filter((piece) => piece.typed).map((piece) => piece.text);

// After a restart of the editor the page is loaded again: its documents are not the same ones.
store.addEventListener("restarted", () => {
  const texts = waiting();
  if (texts.length) windowStorage.setItem(KEPT, texts.join("\n\n"));
});

/** A button to copy the unsent text. */
export function copyUnsent() {
  const texts = waiting();
  if (!texts.length) return nothing;
  return html`<button type="button" @click=${() => copyText(texts.join("\n\n"))}>
    ${t("Copy what was not sent")}
  </button>`;
}

/** The text that was not sent before the editor was restarted. @param {() => void} redraw */
export function unsentBanner(redraw) {
  const text = windowStorage.getItem(KEPT);
  if (!text || store.restarted) return nothing; // a click would be lost with the page that is about to be loaded again
  const drop = () => {
    windowStorage.removeItem(KEPT);
    redraw();
  };
  return html`<div class="banner" role="alert">
    ${t("What you typed while the editor was offline did not reach a document:")} <code>${shortened(text)}</code>
    <button type="button" @click=${() => copyText(text)}>${t("Copy it")}</button>
    <button type="button" @click=${drop}>${t("Discard it")}</button>
  </div>`;
}

/** @param {string} text */
const shortened = (text) => (text.length > 80 ? `${text.slice(0, 80)}…` : text);

/** Copy a text; called while a button is clicked, as Safari asks. @param {string} text */
export async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    notify(t("Copied to the clipboard."));
  } catch (error) {
    notifyError(error);
  }
}
