/**
 * The drawing tools: a new state or transition is placed with arrows and Enter, or with clicks; with a held button, a
 * transition is drawn from one state to another.
 *
 * @import {State} from "../data/protocol.js"
 * @import {HfsmCanvas} from "./canvas.js"
 * @import {Point} from "../measures/geometry.js"
 * @typedef {{hint: string, move: (event: PointerEvent) => void, click: (point: Point) => void,
 *   release?: (point: Point) => void, key: (event: KeyboardEvent) => boolean, cancel: () => void}} DrawingTool `key` says
 *   whether it took the key
 */

import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {boxOf, distance, neighbor, RADIUS, wider} from "../measures/geometry.js";
import {Link} from "./gestures.js";
import {make, set} from "./svg.js";

const GAP = 8; // pixels between what is new and what is there
const STEP = 20; // pixels of an arrow key
/** @type {Record<string, [number, number]>} */
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

/** Place something new: with a click, or with arrows and Enter. */
export class PlacingTool {
  /** @param {HfsmCanvas} canvas @param {SVGElement} shape which shows where it would be */
  constructor(canvas, shape) {
    this.canvas = canvas;
    this.shape = shape;
    /** @type {Point} */
    this.point = canvas.viewport.middle;
    canvas.sketch.append(shape);
  }

  /** @param {PointerEvent} event */
  move(event) {
    this.to(this.canvas.point(event));
  }

  /** @param {Point} point */
  click(point) {
    this.to(point);
    this.canvas.useTool(undefined);
    this.put();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const arrow = ARROWS[event.key];
    if (arrow) {
      this.to({x: this.point.x + arrow[0] * STEP, y: this.point.y + arrow[1] * STEP});
      this.canvas.announce(spokenPlace(this.point));
    } else if (event.key === "Enter") this.click(this.point);
    else return false;
    this.canvas.viewport.reveal(this.point);
    return true;
  }

  cancel() {
    this.shape.remove();
  }

  /** Show it elsewhere. @param {Point} point */
  to({x, y}) {
    this.point = {x: Math.round(x), y: Math.round(y)};
  }

  /** Add it where it is. */
  put() {}
}

/** Place a new state. */
export class StateTool extends PlacingTool {
  hint = t("New state: click, or move it with the arrows and press Enter. Esc cancels.");

  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    super(canvas, make("circle", {class: "placed", r: RADIUS}));
    this.to(freePlace(canvas));
  }

  /** @param {Point} point @override */
  to(point) {
    super.to(point);
    set(this.shape, "transform", `translate(${point.x},${point.y})`);
  }

  /** @override */
  put() {
    const covers = page.automaton?.states.some((state) => distance(state, this.point) < 2 * RADIUS);
    this.canvas.add("state", "addState", covers ? freePlace(this.canvas, this.point) : this.point);
  }
}

/** Connect two states; starts at the selected one, if there is one. */
export class TransitionTool {
  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** The transition that is drawn, once its origin is known. @type {Link | undefined} */
    this.link = undefined;
    /** The name of its origin. */
    this.origin = "";
    /** The last chosen state. @type {State | undefined} */
    this.chosen = undefined;
    /** The state on which the pointer was pressed. @type {State | undefined} */
    this.pressed = undefined;
    const origin = page.state;
    if (origin) this.#begin(origin);
  }

  get hint() {
    return this.link
      ? t(
          "New transition from {state}: click its destination, or the ground for a new state, or choose with the arrows and press Enter. Esc cancels.",
          {state: this.origin},
        )
      : t("New transition: click its origin, or choose it with the arrows and press Enter. Esc cancels.");
  }

  /** @param {PointerEvent} event */
  move(event) {
    this.link?.move(event);
  }

  /** @param {Point} point */
  click(point) {
    const state = this.canvas.stateAt(point);
    if (this.link && !state) this.#end(state, point);
    else if (this.link) this.pressed = state;
    else if (state) this.#begin(state);
    else this.canvas.useTool(undefined);
  }

  /** End where the pointer is let go: it may be drawn from one state to another. @param {Point} point */
  release(point) {
    const {link, pressed} = this;
    const state = this.canvas.stateAt(point);
    if (!link || !(pressed ?? (state && state.id !== link.origin))) return;
    if (pressed && state?.id !== pressed.id) {
      link.cancel();
      this.#begin(pressed);
    }
    this.#end(state, point);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const arrow = ARROWS[event.key];
    if (arrow) this.#choose(arrow);
    else if (event.key === "." || event.key === ",") this.#goOn(event.key === "." ? 1 : -1);
    else if (event.key === "Enter") {
      const chosen = this.chosen ?? page.state;
      if (!chosen) return true;
      if (this.link) this.#end(chosen, chosen);
      else this.#begin(chosen);
    } else return false;
    return true;
  }

  cancel() {
    this.link?.cancel();
    this.canvas.markTarget(undefined);
  }

  /** @param {State} state */
  #begin(state) {
    this.canvas.markTarget(undefined);
    this.link = new Link(this.canvas, state.id);
    this.origin = state.name;
    this.chosen = undefined;
    this.#lead(state);
    this.canvas.showHint(this.hint);
  }

  /** Choose the neighbor of the chosen state, or first of the origin. @param {[number, number]} arrow */
  #choose(arrow) {
    const {states} = page.shownAutomaton;
    const origin = this.link?.origin;
    const from = this.chosen ?? states.find((each) => each.id === origin) ?? page.state;
    const next = from ? neighbor(states, from, arrow) : states[0];
    if (next) this.#lead(next);
  }

  /** Choose the next state of the document: by arrows, one in a crowd may be out of reach. @param {number} step */
  #goOn(step) {
    const {states} = page.shownAutomaton;
    const index = states.findIndex(({id}) => id === (this.chosen?.id ?? this.link?.origin ?? page.state?.id));
    const next = states.at((index + step) % states.length);
    if (next) this.#lead(next);
  }

  /** @param {State} state */
  #lead(state) {
    this.chosen = state;
    if (this.link) this.link.lead(state, state);
    else this.canvas.markTarget(state.id);
    this.canvas.viewport.reveal(state);
    const {name} = state;
    this.canvas.announce(this.link ? t("to {name}", {name}) : t("from {name}", {name}));
  }

  /** @param {State | undefined} state @param {Point} point */
  #end(state, point) {
    const {link} = this;
    link?.lead(state, point);
    this.link = undefined;
    this.canvas.useTool(undefined);
    link?.end();
  }
}

/** A place in words, from the nearest state. @param {Point} point */
function spokenPlace(point) {
  const near = (page.automaton?.states ?? []).toSorted((one, other) => distance(one, point) - distance(other, point));
  if (!near.length) return `${point.x}, ${point.y}`;
  const [{name, x, y}] = near;
  const [right, down] = [point.x - x, point.y - y];
  const parts = [
    right && `${Math.abs(right)} ${right > 0 ? t("to the right") : t("to the left")}`,
    down && `${Math.abs(down)} ${down > 0 ? t("down") : t("up")}`,
  ].filter(Boolean);
  return t("{place} of {state}", {place: parts.join(", ") || t("in the middle"), state: name});
}

/**
 * A free place near a point, for what is put there without a pointer.
 *
 * @param {HfsmCanvas} canvas
 * @param {Point} [near] by default the middle of the visible part
 * @param {{width: number, height: number}} [size] of what is put there, by default a state's
 */
export function freePlace(canvas, near, {width, height} = {width: 2 * RADIUS, height: 2 * RADIUS}) {
  const {left, top, right, bottom} = canvas.viewport.seen;
  const middle = near ?? {x: Math.round((left + right) / 2), y: Math.round((top + bottom) / 2)};
  for (let ring = 0; ring < 12; ring++) {
    const count = Math.max(1, ring * 6);
    for (let turn = 0; turn < count; turn++) {
      const angle = (turn / count) * 2 * Math.PI;
      const place = {
        x: Math.round(middle.x + Math.cos(angle) * ring * 60),
        y: Math.round(middle.y + Math.sin(angle) * ring * 60),
      };
      if (canvas.drawing.isFree(wider(boxOf([place]), width / 2 + GAP, height / 2 + GAP))) return place;
    }
  }
  return middle;
}
