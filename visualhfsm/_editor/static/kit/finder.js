/**
 * The field above a list in a dialog: what is typed there leaves out entries, the arrow keys choose one of the others.
 *
 * @import {From} from "../data/element.js"
 * @typedef {{label: string, count: number, press: (event: KeyboardEvent) => boolean, redraw: () => void}} Field `count`
 *   is that of the entries that are left, `press` says whether it did something for another key
 */

import {html, nothing} from "lit";

import {n} from "./texts.js";

export class Finder {
  /** What is typed. */
  text = "";
  /** The index of the chosen entry. */
  chosen = 0;

  /** @param {string} id the beginning of the ids of its elements */
  constructor(id) {
    this.id = id;
  }

  /** The id of the list. */
  get listId() {
    return `${this.id}-list`;
  }

  /** The id of an entry. @param {number} index */
  entryId(index) {
    return `${this.id}-${index}`;
  }

  /** Begin with all entries again. */
  clear() {
    this.text = "";
    this.chosen = 0;
  }

  /** Choose an entry. @param {number} index @param {() => void} redraw */
  choose(index, redraw) {
    this.chosen = index;
    redraw();
    document.getElementById(this.entryId(index))?.scrollIntoView({block: "nearest"});
  }

  /** @param {Field} field */
  field({label, count, press, redraw}) {
    const id = `${this.id}-text`;
    /** @param {KeyboardEvent} event */
    const key = (event) => {
      if (event.isComposing) return;
      const step = /** @type {Record<string, number>} */ ({ArrowDown: 1, ArrowUp: -1})[event.key];
      if (step && count) this.choose((this.chosen + step + count) % count, redraw);
      else if (!press(event)) return;
      event.preventDefault();
    };
    return html`<div class="field">
      <label for=${id}>${label}</label>
      <input
        id=${id}
        role="combobox"
        aria-expanded="true"
        aria-controls=${this.listId}
        aria-activedescendant=${count ? this.entryId(this.chosen) : nothing}
        autocomplete="off"
        spellcheck="false"
        autofocus
        .value=${this.text}
        @input=${(/** @type {From<HTMLInputElement>} */ {target}) => {
          this.text = target.value;
          this.chosen = 0;
          redraw();
        }}
        @keydown=${key}
      />
      <span class="for-readers" role="status">${this.text ? n("{count} found", "{count} found", count) : ""}</span>
    </div>`;
  }
}
