/**
 * Lines between two areas that can be dragged, or moved with the arrows.
 *
 * @import {From} from "../data/element.js"
 */

import {html} from "lit";

import {browserStorage} from "./location.js";

const RESIZE_STEP = 24;
const root = document.documentElement;
/** Known sizes: reading the style makes the browser compute it for the whole page. @type {Map<string, number>} */
const sizes = new Map();
window.addEventListener("resize", () => sizes.clear());

/** Restore the sizes of the areas in this browser. */
export function restoreSizes() {
  for (const variable of ["--left", "--shelf", "--side", "--bottom", "--dock-height"]) {
    const size = Number(browserStorage.getItem(`visualhfsm.size${variable}`));
    if (size > 0) root.style.setProperty(variable, `${Math.min(size, innerWidth)}px`);
  }
}

/**
 * A line that sets a variable of the style.
 *
 * @param {{name: string, variable: string, along: "x" | "y", sign: 1 | -1, smallest: number, largest: number}} options
 *   `sign` says whether the area grows with the coordinate
 */
export function resizer({name, variable, along, sign, smallest, largest}) {
  const value = () => {
    const size = sizes.get(variable) ?? Number.parseFloat(getComputedStyle(root).getPropertyValue(variable));
    sizes.set(variable, size);
    return size;
  };
  /** @param {HTMLElement} element @param {number} wanted */
  const set = (element, wanted) => {
    const next = Math.round(Math.min(largest, Math.max(smallest, wanted)));
    root.style.setProperty(variable, `${next}px`);
    sizes.set(variable, next);
    element.setAttribute("aria-valuenow", String(next));
    browserStorage.setItem(`visualhfsm.size${variable}`, String(next));
  };
  /** @param {PointerEvent & From<HTMLElement>} event */
  const down = (event) => {
    const element = event.currentTarget;
    element.setPointerCapture(event.pointerId);
    const start = {at: along === "x" ? event.clientX : event.clientY, value: value()};
    element.onpointermove = (move) =>
      set(element, start.value + ((along === "x" ? move.clientX : move.clientY) - start.at) * sign);
    element.onlostpointercapture = () => (element.onpointermove = null);
  };
  /** @param {KeyboardEvent & From<HTMLElement>} event */
  const key = (event) => {
    const step = /** @type {Record<string, number>} */ ({
      ArrowLeft: -RESIZE_STEP,
      ArrowUp: -RESIZE_STEP,
      ArrowRight: RESIZE_STEP,
      ArrowDown: RESIZE_STEP,
    })[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    set(event.currentTarget, value() + step * sign);
  };
  return html`<div
    class="resizer ${along}"
    role="separator"
    tabindex="0"
    aria-label=${name}
    aria-orientation=${along === "x" ? "vertical" : "horizontal"}
    aria-valuemin=${smallest}
    aria-valuemax=${largest}
    aria-valuenow=${Math.round(value()) || smallest}
    @pointerdown=${down}
    @keydown=${key}
  ></div>`;
}
