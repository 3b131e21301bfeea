/**
 * Carry a ready state from the shelf to the canvas with a mouse, a pen or a finger. A finger that moves up or down
 * scrolls the shelf; one that moves sideways carries.
 *
 * @import {HfsmCanvas} from "../canvas/canvas.js"
 * @import {ReadyState, State} from "../data/protocol.js"
 * @import {Where} from "./ready-states.js"
 */

import {RADIUS} from "../measures/geometry.js";
import {t} from "../kit/texts.js";
import {canDraw} from "./ready-states.js";

const FAR = 6; // pixels; a shorter move is a click

export class Carrying {
  /** The state below it, which a transition will connect with it. @type {State | undefined} */
  #after;
  /** @type {HTMLElement | undefined} */
  #carried;
  #stop = new AbortController();

  /**
   * @param {HfsmCanvas} canvas @param {ReadyState} ready
   * @param {PointerEvent & {currentTarget: HTMLElement}} event which pressed it
   * @param {{began: () => void, ended: (where?: Where) => void}} report `ended` gets where to draw it: anywhere when
   *   it was only clicked, and not at all when it was dropped elsewhere
   */
  constructor(canvas, ready, event, report) {
    this.canvas = canvas;
    this.ready = ready;
    this.start = {x: event.clientX, y: event.clientY};
    this.report = report;
    const {pointerId} = event;
    const source = event.currentTarget;
    source.setPointerCapture(pointerId);
    const {signal} = this.#stop;
    /** @param {(event: PointerEvent) => void} act */
    const mine = (act) => (/** @type {PointerEvent} */ other) => other.pointerId === pointerId && act(other);
    source.addEventListener(
      "pointermove",
      mine((other) => this.#move(other)),
      {signal},
    );
    source.addEventListener(
      "pointerup",
      mine((other) => this.#drop(other)),
      {signal},
    );
    source.addEventListener(
      "pointercancel",
      mine(() => this.cancel()),
      {signal},
    );
    addEventListener("keydown", (other) => this.#key(other), {signal, capture: true});
  }

  cancel() {
    this.#stop.abort();
    this.#carried?.remove();
    this.canvas.markTarget(undefined);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const {clientX, clientY} = event;
    const moved = Math.hypot(clientX - this.start.x, clientY - this.start.y);
    if (!this.#carried && (moved < FAR || this.ready.trouble || !canDraw(this.canvas))) return;
    if (!this.#carried) this.report.began();
    this.#carried ??= this.#made();
    const over = this.#isOver(event);
    this.#after = over ? this.canvas.stateAt(this.canvas.point(event)) : undefined;
    this.canvas.markTarget(this.#after?.id);
    const size = over && !this.#after ? 2 * RADIUS * this.canvas.viewport.scale : 0;
    this.#carried.classList.toggle("over", size > 0);
    this.#carried.style.setProperty("--size", `${size}px`);
    this.#carried.style.transform = `translate(${clientX}px, ${clientY}px)`;
    const label = this.#carried.lastElementChild;
    if (label)
      label.textContent = this.#after
        ? t("{title} after {name}", {title: this.ready.title, name: this.#after.name})
        : this.ready.title;
  }

  /** @param {PointerEvent} event */
  #drop(event) {
    const over = this.#isOver(event);
    const where = this.#after ? {after: this.#after} : {point: this.canvas.point(event)};
    this.cancel();
    if (!this.#carried) this.report.ended({});
    else this.report.ended(over ? where : undefined);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.key !== "Escape" || !this.#carried) return;
    event.preventDefault();
    event.stopPropagation();
    this.cancel();
  }

  /** Whether the pointer is over the canvas, and not over what covers it. @param {PointerEvent} event */
  #isOver({clientX, clientY}) {
    const below = document.elementFromPoint(clientX, clientY);
    return Boolean(below?.closest("hfsm-canvas"));
  }

  #made() {
    const made = document.createElement("div");
    made.className = "carried";
    made.setAttribute("aria-hidden", "true");
    made.append(document.createElement("span"), document.createElement("span"));
    document.body.append(made);
    return made;
  }
}
