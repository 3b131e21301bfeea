/** Navigation in lists of rows with the arrow keys. */

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
