/**
 * Drawing without holding a button: a new state or transition is placed with arrows and Enter, or with clicks.
 *
 * A tool has `hint`, `move(event)`, `click(event)`, `key(event)` that says whether it took the key, and `cancel()`.
 */

import {addState} from "../commands.js";
import {page} from "../page.js";
import {distance, RADIUS} from "./geometry.js";
import {Link} from "./gestures.js";
import {make} from "./svg.js";

const STEP = 20;
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

/** Place a new state. */
export class StateTool {
  hint = "New state: click, or move it with the arrows and press Enter. Esc cancels.";

  constructor(canvas) {
    this.canvas = canvas;
    this.circle = make("circle", {class: "placed", r: RADIUS});
    canvas.sketch.append(this.circle);
    this.#to(freePlace(canvas));
  }

  move(event) {
    this.#to(this.canvas.point(event));
  }

  click(event) {
    this.#to(this.canvas.point(event));
    this.#place();
  }

  key(event) {
    const arrow = ARROWS[event.key];
    if (arrow) this.#to({x: this.point.x + arrow[0] * STEP, y: this.point.y + arrow[1] * STEP});
    else if (event.key === "Enter") this.#place();
    else return false;
    this.canvas.viewport.reveal(this.point);
    return true;
  }

  cancel() {
    this.circle.remove();
  }

  #to({x, y}) {
    this.point = {x: Math.round(x), y: Math.round(y)};
    this.circle.setAttribute("cx", x);
    this.circle.setAttribute("cy", y);
  }

  async #place() {
    this.canvas.useTool(undefined);
    await this.canvas.nameAdded("state", addState(this.point));
  }
}

/** Connect two states; begins at the selected one, if there is one. */
export class TransitionTool {
  constructor(canvas) {
    this.canvas = canvas;
    const origin = page.state;
    if (origin) this.#begin(origin);
  }

  get hint() {
    return this.link
      ? "New transition: click the state where it leads, or choose it with the arrows and press Enter. Esc cancels."
      : "New transition: click the state where it begins, or choose it with the arrows and press Enter. Esc cancels.";
  }

  move(event) {
    this.link?.move(event);
  }

  click(event) {
    const state = this.canvas.stateAt(this.canvas.point(event));
    if (!state) this.canvas.useTool(undefined);
    else if (this.link) this.#end(state);
    else this.#begin(state);
  }

  key(event) {
    const arrow = ARROWS[event.key];
    if (arrow) this.#choose(arrow);
    else if (event.key === "Enter") {
      const chosen = this.chosen ?? page.state;
      if (!chosen) return true;
      if (this.link) this.#end(chosen);
      else this.#begin(chosen);
    } else return false;
    return true;
  }

  cancel() {
    this.link?.cancel();
    this.canvas.markTarget(undefined);
  }

  #begin(state) {
    this.canvas.markTarget(undefined);
    this.link = new Link(this.canvas, state.id);
    this.chosen = undefined;
    this.#lead(state);
    this.canvas.showHint(this.hint);
  }

  /** The first arrow leads on from where it begins; until then it is a loop. */
  #choose(arrow) {
    const states = page.automaton.states;
    const from = this.chosen ?? (this.link && states.find((each) => each.id === this.link.origin)) ?? page.state;
    const next = from ? neighbor(states, from, arrow) : states[0];
    if (next) this.#lead(next);
  }

  #lead(state) {
    this.chosen = state;
    if (this.link) this.link.lead(state, state);
    else this.canvas.markTarget(state.id);
    this.canvas.viewport.reveal(state);
    this.canvas.announce(this.link ? `to ${state.name}` : `from ${state.name}`);
  }

  #end(state) {
    const {link} = this;
    link.lead(state, state);
    this.link = undefined;
    this.canvas.useTool(undefined);
    link.end();
  }
}

/**
 * The nearest of some things in a direction: those straight ahead are preferred to those aside.
 *
 * @template {{x: number, y: number}} T
 * @param {T[]} things @param {T} from @param {[number, number]} direction
 * @returns {T | undefined}
 */
export function neighbor(things, from, [dx, dy]) {
  let best;
  let least = Infinity;
  for (const each of things) {
    if (each === from) continue;
    const along = (each.x - from.x) * dx + (each.y - from.y) * dy;
    const aside = Math.abs((each.x - from.x) * dy - (each.y - from.y) * dx);
    if (along <= 1 || aside > along * 2.5) continue;
    const cost = along + aside * 1.5;
    if (cost < least) [best, least] = [each, cost];
  }
  return best;
}

/** A place near the middle of what is seen, where no state stands. */
function freePlace(canvas) {
  const {left, top, right, bottom} = canvas.viewport.seen;
  const middle = {x: Math.round((left + right) / 2), y: Math.round((top + bottom) / 2)};
  const states = page.automaton?.states ?? [];
  for (let ring = 0; ring < 12; ring++) {
    const count = Math.max(1, ring * 6);
    for (let turn = 0; turn < count; turn++) {
      const angle = (turn / count) * 2 * Math.PI;
      const place = {x: Math.round(middle.x + Math.cos(angle) * ring * 60), y: Math.round(middle.y + Math.sin(angle) * ring * 60)};
      if (states.every((state) => distance(state, place) > RADIUS * 2.6)) return place;
    }
  }
  return middle;
}
