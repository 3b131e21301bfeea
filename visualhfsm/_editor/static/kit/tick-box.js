import {html, live, nothing} from "lit";

/**
 * A box to tick, with its words.
 *
 * @param {string} words @param {boolean} checked @param {(event: import("../data/element.js").From<HTMLInputElement>) => unknown} change
 * @param {{disabled?: boolean, title?: string}} [more]
 */
export const tickBox = (words, checked, change, {disabled = false, title} = {}) =>
  html`<label title=${title ?? nothing}
    ><input type="checkbox" .checked=${live(checked)} ?disabled=${disabled} @change=${change} /> ${words}</label
  >`;
