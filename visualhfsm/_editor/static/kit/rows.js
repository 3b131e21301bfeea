/** Lists of rows: places in them, and navigation with the arrow keys. */

import {html} from "lit";

/** A path in words, whose middle is left out where there is no room: its end says most. @param {string[]} words */
export function pathOf(words) {
  const start = words.slice(0, -2).map((each) => `${each} › `);
  return html`<span class="where path" title=${words.join(" › ")}
    ><bdi>${start.join("")}</bdi><bdi>${words.slice(-2).join(" › ")}</bdi></span
  >`;
}

/**
 * Move the focus to the row above or below; a handler of `keydown` of the list.
 *
 * @param {KeyboardEvent & import("../data/element.js").From<HTMLElement>} event
 */
export function moveAmongRows(event) {
  const step = /** @type {Record<string, number>} */ ({ArrowDown: 1, ArrowUp: -1, Home: -Infinity, End: Infinity})[
    event.key
  ];
  if (step === undefined || event.altKey || event.ctrlKey || event.metaKey) return;
  const rows = [.../** @type {NodeListOf<HTMLElement>} */ (event.currentTarget.querySelectorAll("button.row"))];
  const index = rows.findIndex((each) => each === document.activeElement);
  const next = rows[Math.min(rows.length - 1, Math.max(0, index + step))];
  if (index < 0 || !next) return;
  event.preventDefault();
  event.stopPropagation();
  next.focus();
}
