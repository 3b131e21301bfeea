/** Typed text that did not reach the server, and could not be put back later: it can at least be copied. */

import {html, nothing} from "lit";

import {notify, notifyError} from "../kit/notices.js";
import {windowStorage} from "../kit/location.js";
import {store} from "./store.js";
import {t} from "../kit/texts.js";

const KEPT = "visualhfsm.unsent";

/** Offer a text that no document took. @param {string} text */
export function leaveUnsent(text) {
  const former = windowStorage.getItem(KEPT);
  windowStorage.setItem(KEPT, former ? `${former}\n\n${text}` : text);
}

/** A button to copy the unsent text. */
export function copyUnsent() {
  const texts = [...store.unsaved.values()].filter((piece) => piece.typed).map((piece) => piece.text);
  if (!texts.length) return nothing;
  return html`<button type="button" @click=${() => copyText(texts.join("\n\n"))}>
    ${t("Copy what was not sent")}
  </button>`;
}

/** The text that was not sent before the editor was restarted. @param {() => void} redraw */
export function unsentBanner(redraw) {
  const text = windowStorage.getItem(KEPT);
  if (!text) return nothing;
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
