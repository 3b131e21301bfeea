/** Lines between two areas that can be dragged, or moved with the arrows. */

import {html} from "lit";

const STEP = 24;
const root = document.documentElement;
/** Sizes that are known already: to ask the style makes the browser work it out for the whole page. @type {Map<string, number>} */
const sizes = new Map();
window.addEventListener("resize", () => sizes.clear());

/** Let the areas be as large as they were made in this browser. */
export function restoreSizes() {
  for (const variable of ["--left", "--side", "--bottom"]) {
    const size = Number(localStorage.getItem(`visualhfsm.size${variable}`));
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
    if (!sizes.has(variable)) sizes.set(variable, Number.parseFloat(getComputedStyle(root).getPropertyValue(variable)));
    return sizes.get(variable);
  };
  const set = (element, wanted) => {
    const next = Math.round(Math.min(largest, Math.max(smallest, wanted)));
    root.style.setProperty(variable, `${next}px`);
    sizes.set(variable, next);
    element.setAttribute("aria-valuenow", next);
    localStorage.setItem(`visualhfsm.size${variable}`, next);
  };
  const down = (event) => {
    const element = event.currentTarget;
    element.setPointerCapture(event.pointerId);
    const start = {at: along === "x" ? event.clientX : event.clientY, value: value()};
    element.onpointermove = (move) => set(element, start.value + ((along === "x" ? move.clientX : move.clientY) - start.at) * sign);
    element.onlostpointercapture = () => (element.onpointermove = null);
  };
  const key = (event) => {
    const step = {ArrowLeft: -STEP, ArrowUp: -STEP, ArrowRight: STEP, ArrowDown: STEP}[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    set(event.currentTarget, value() + step * sign);
  };
  return html`<div class="resizer ${along}" role="separator" tabindex="0" aria-label=${name} aria-orientation=${along === "x" ? "vertical" : "horizontal"}
    aria-valuemin=${smallest} aria-valuemax=${largest} aria-valuenow=${Math.round(value()) || smallest} @pointerdown=${down} @keydown=${key}></div>`;
}
