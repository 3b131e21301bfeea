/**
 * Put the selected states on the shelf of the project, where others find them.
 *
 * @import {From} from "../data/element.js"
 * @typedef {import("../kit/dialog.js").Close<string>} Close
 */

import {html, nothing} from "lit";

import {showDialog} from "../kit/dialog.js";
import {messageOf, notify} from "../kit/notices.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";

export async function putOnShelf() {
  const {tab} = page;
  const automaton = page.shownAutomaton.id;
  const states = [...page.states];
  const name = page.state?.name ?? "";
  const asked = {title: name.slice(0, 1).toUpperCase() + name.slice(1), category: "", words: "", description: ""};
  let error = "";
  let draw = () => {};

  /** @param {Close} close */
  const put = async (close) => {
    try {
      const {path} = await store.request("putOnShelf", {tab, automaton, states, ...asked});
      close(path);
    } catch (reason) {
      error = messageOf(reason);
      draw();
    }
  };

  /** @param {KeyboardEvent} event @param {Close} close */
  const enter = (event, close) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    put(close);
  };

  /** @param {keyof typeof asked} key @param {string} label @param {Close} close */
  const field = (key, label, close) =>
    html`<div class="field">
      <label for="shelf-${key}">${label}</label
      ><input
        id="shelf-${key}"
        list=${key === "category" ? "shelf-categories" : nothing}
        ?autofocus=${key === "title"}
        .value=${asked[key]}
        @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (asked[key] = target.value)}
        @keydown=${(/** @type {KeyboardEvent} */ event) => enter(event, close)}
      />
    </div>`;

  const path = await showDialog({
    title: t("Put on the shelf"),
    content: (/** @type {Close} */ close, redraw) => {
      draw = redraw;
      return html`${error ? html`<p role="alert">${error}</p>` : nothing}${field("title", t("Title"), close)}
        ${field("category", t("Below the heading"), close)}${field("description", t("What it does"), close)}
        ${field("words", t("Words to find it by"), close)}
        <datalist id="shelf-categories">
          ${[...new Set(store.shelf.map(({category}) => category))].map((each) => html`<option value=${each}></option>`)}
        </datalist>
        <p class="explain">
          ${t("It becomes a document in the folder shelf of the project, with a copy of all below. This document stays as it is.")}
        </p>`;
    },
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close()}>${t("Cancel")}</button
        ><button type="button" class="button primary" @click=${() => put(close)}>${t("Put on the shelf")}</button>`,
  });
  if (path) notify(t("{title} is on the shelf, as {path}.", {title: asked.title, path}));
}
