/**
 * The pointer on the canvas: gestures, tools, opening, zooming, tips and the menu.
 *
 * A tool works without holding a button: a new state or transition is placed with arrows and Enter, or with clicks.
 *
 * @import {State} from "../store.js"
 * @import {HfsmCanvas} from "./canvas.js"
 * @import {Point} from "./geometry.js"
 * @typedef {{hint: string, move: (event: PointerEvent) => void, click: (point: Point) => void,
 *   key: (event: KeyboardEvent) => boolean, cancel: () => void}} DrawingTool `key` says whether it took the key
 * @typedef {{move: (event: PointerEvent) => void, end: () => unknown, cancel: () => void}} Gesture
 */

import {applyHere} from "../commands.js";
import {page} from "../page.js";
import {distance, neighbor, RADIUS} from "./geometry.js";
import {Band, Link, Move, Pan} from "./gestures.js";
import {idOf} from "./order.js";
import {make} from "./svg.js";

const WHEEL = 600; // pixels of a wheel for a zoom by e
const LINE = 16; // pixels of a line, for wheels that count those
const STEP = 20;
/** @type {Record<string, [number, number]>} */
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

/** The state or transition at an element. @param {EventTarget | null} target @returns {SVGElement | null} */
const groupAt = (target) => (target instanceof Element ? target.closest("[data-key]") : null);

export class Pointer {
  /** @type {Gesture | undefined} */
  #gesture;
  /** The pointer of the gesture; others are ignored. @type {number | undefined} */
  #finger;
  /** What it was last pressed on. @type {EventTarget | null} */
  #pressed = null;
  #spaceHeld = false;
  /** @type {(() => void) | undefined} */
  #whenDone;

  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    const {surface} = canvas;
    surface.addEventListener("pointerdown", (event) => this.#down(event));
    surface.addEventListener(
      "pointermove",
      (event) => this.#isOther(event) || (this.#gesture ?? canvas.tool)?.move(event),
    );
    surface.addEventListener("pointerup", (event) => this.#isOther(event) || this.#up());
    surface.addEventListener("pointercancel", (event) => this.#isOther(event) || canvas.cancel());
    surface.addEventListener("pointerover", (event) => this.#showTip(event));
    surface.addEventListener("dblclick", (event) => this.#doubleClick(event));
    surface.addEventListener("contextmenu", (event) => this.#menu(event));
    surface.addEventListener("wheel", (event) => this.#wheel(event), {passive: false});
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("keyup", (event) => event.key === " " && (this.#spaceHeld = false));
    // Let go elsewhere.
    canvas.addEventListener(
      "focusout",
      (event) => canvas.contains(/** @type {Node | null} */ (event.relatedTarget)) || (this.#spaceHeld = false),
    );
  }

  /** Whether something is being dragged. */
  get isBusy() {
    return Boolean(this.#gesture);
  }

  /** Do something as soon as nothing is dragged. @param {() => void} action */
  whenFree(action) {
    if (this.#gesture) this.#whenDone = action;
    else action();
  }

  /** @param {PointerEvent} event */
  #isOther(event) {
    return Boolean(this.#gesture) && event.pointerId !== this.#finger;
  }

  /** Cancel a drag; return whether there was one. */
  cancel() {
    const gesture = this.#gesture;
    gesture?.cancel();
    this.#finish();
    return Boolean(gesture);
  }

  #finish() {
    this.#gesture = undefined;
    const action = this.#whenDone;
    this.#whenDone = undefined;
    action?.();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const {canvas} = this;
    if (event.key === " ") this.#spaceHeld = true;
    if (
      !canvas.tool ||
      event.ctrlKey ||
      event.metaKey ||
      event.target === canvas.rename.input ||
      !canvas.tool.key(event)
    )
      return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {PointerEvent} event */
  #down(event) {
    if (this.#gesture) return;
    const {canvas} = this;
    canvas.rename.commit();
    this.#pressed = event.target;
    const pans = event.button === 1 || (event.button === 0 && this.#spaceHeld);
    if (event.button !== 0 && !pans) return;
    if (canvas.tool && !pans) {
      event.preventDefault();
      canvas.tool.click(canvas.point(event));
      return;
    }
    const group = groupAt(event.target);
    if (pans) {
      event.preventDefault();
      this.#gesture = new Pan(canvas, event);
    } else if (group) {
      this.#gesture = this.#grab(event, group.dataset.key ?? "");
    } else {
      canvas.surface.focus({preventScroll: true});
      this.#gesture = new Band(canvas, event);
    }
    this.#finger = event.pointerId;
    // The group itself, or a double click would go to the whole drawing.
    if (this.#gesture) (group ?? canvas.surface).setPointerCapture(event.pointerId);
  }

  /** @param {PointerEvent} event @param {string} key */
  #grab(event, key) {
    const {canvas} = this;
    if (
      event.target instanceof Element &&
      event.target.classList.contains("rim") &&
      !event.shiftKey &&
      !canvas.readOnly
    ) {
      canvas.order.select(key);
      return new Link(canvas, idOf(key));
    }
    const selected = canvas.selectedKeys().includes(key);
    if (!selected || event.shiftKey) canvas.order.select(key, event.shiftKey);
    return canvas.readOnly
      ? undefined
      : new Move(canvas, event, () => selected && !event.shiftKey && canvas.order.select(key));
  }

  /**
   * What waits for the end of the gesture is done after the answer of the server: until then, everything stays where it
   * was dragged.
   */
  async #up() {
    const gesture = this.#gesture;
    this.#gesture = undefined;
    try {
      await gesture?.end();
    } finally {
      if (!this.#gesture) this.#finish();
    }
  }

  /** @param {MouseEvent} event */
  #doubleClick(event) {
    const {canvas} = this;
    const target = this.#pressed; // that of the event is what has captured the pointer
    /** @param {KeyboardEvent} event */
    const key = groupAt(target)?.dataset.key;
    if (!(target instanceof Element) || !key) {
      const {x, y} = canvas.point(event);
      if (!canvas.readOnly && page.automaton) canvas.add("state", "addState", {x: Math.round(x), y: Math.round(y)});
      return;
    }
    const kind = key.startsWith("s") ? "state" : "transition";
    const id = idOf(key);
    const state = kind === "state" ? page.shownAutomaton.states.find((each) => each.id === id) : undefined;
    if (target.closest(".label")) canvas.beginRename(kind, id);
    else if (target.closest(".handle") && !canvas.readOnly) applyHere("resetHandles", {transitions: [id]});
    else if (state?.children.length) page.open(state.children[0]);
    else page.edit({kind, automaton: page.shownAutomaton.id, id, part: state ? "code" : "trigger"});
  }

  /** @param {MouseEvent} event */
  #menu(event) {
    event.preventDefault();
    const {canvas} = this;
    /** @param {KeyboardEvent} event */
    const key = groupAt(event.target)?.dataset.key;
    if (key && !canvas.selectedKeys().includes(key)) canvas.order.select(key);
    else if (!key) page.select({});
    const detail = {x: event.clientX, y: event.clientY, point: canvas.point(event)};
    canvas.dispatchEvent(new CustomEvent("hfsm-menu", {bubbles: true, detail}));
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const {viewport} = this.canvas;
    const unit = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE : 1;
    if (event.shiftKey) {
      viewport.pan(-(event.deltaX || event.deltaY) * unit, 0);
      return;
    }
    const {left, top} = this.canvas.getBoundingClientRect();
    const factor = Math.exp((-event.deltaY * unit) / (event.ctrlKey ? WHEEL / 4 : WHEEL)); // a pinch comes with Ctrl
    viewport.zoom(factor, event.clientX - left, event.clientY - top);
  }

  /**
   * Only the element below the pointer has a tip; otherwise screen readers would say everything twice.
   *
   * @param {PointerEvent} event
   */
  #showTip(event) {
    const {tip, drawing} = this.canvas;
    const group = groupAt(event.target);
    if (tip.parentNode === group) return;
    tip.remove();
    if (!group) return;
    tip.textContent = drawing.view(group.dataset.key ?? "")?.tip ?? "";
    group.append(tip);
  }
}

/** Place a new state. */
export class StateTool {
  hint = "New state: click, or move it with the arrows and press Enter. Esc cancels.";

  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.circle = make("circle", {class: "placed", r: RADIUS});
    canvas.sketch.append(this.circle);
    this.point = freePlace(canvas);
    this.#to(this.point);
  }

  /** @param {PointerEvent} event */
  move(event) {
    this.#to(this.canvas.point(event));
  }

  /** @param {Point} point */
  click(point) {
    this.#to(point);
    this.canvas.useTool(undefined);
    this.canvas.add("state", "addState", this.point);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const arrow = ARROWS[event.key];
    if (arrow) this.#to({x: this.point.x + arrow[0] * STEP, y: this.point.y + arrow[1] * STEP});
    else if (event.key === "Enter") this.click(this.point);
    else return false;
    this.canvas.viewport.reveal(this.point);
    return true;
  }

  cancel() {
    this.circle.remove();
  }

  /** @param {Point} point */
  #to({x, y}) {
    this.point = {x: Math.round(x), y: Math.round(y)};
    this.circle.setAttribute("cx", String(x));
    this.circle.setAttribute("cy", String(y));
  }
}

/** Connect two states; starts at the selected one, if there is one. */
export class TransitionTool {
  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** The transition that is drawn, once it is known where it begins. @type {Link | undefined} */
    this.link = undefined;
    /** The state that was chosen last. @type {State | undefined} */
    this.chosen = undefined;
    const origin = page.state;
    if (origin) this.#begin(origin);
  }

  get hint() {
    return this.link
      ? "New transition: click its destination, or choose it with the arrows and press Enter. Esc cancels."
      : "New transition: click its origin, or choose it with the arrows and press Enter. Esc cancels.";
  }

  /** @param {PointerEvent} event */
  move(event) {
    this.link?.move(event);
  }

  /** @param {Point} point */
  click(point) {
    const state = this.canvas.stateAt(point);
    if (!state) this.canvas.useTool(undefined);
    else if (this.link) this.#end(state);
    else this.#begin(state);
  }

  /** @param {KeyboardEvent} event */
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

  /** @param {State} state */
  #begin(state) {
    this.canvas.markTarget(undefined);
    this.link = new Link(this.canvas, state.id);
    this.chosen = undefined;
    this.#lead(state);
    this.canvas.showHint(this.hint);
  }

  /** The first arrow leads on from where it begins; until then it is a loop. @param {[number, number]} arrow */
  #choose(arrow) {
    const {states} = page.shownAutomaton;
    const origin = this.link?.origin;
    const from = this.chosen ?? states.find((each) => each.id === origin) ?? page.state;
    const next = from ? neighbor(states, from, arrow) : states[0];
    if (next) this.#lead(next);
  }

  /** @param {State} state */
  #lead(state) {
    this.chosen = state;
    if (this.link) this.link.lead(state, state);
    else this.canvas.markTarget(state.id);
    this.canvas.viewport.reveal(state);
    this.canvas.announce(this.link ? `to ${state.name}` : `from ${state.name}`);
  }

  /** @param {State} state */
  #end(state) {
    const {link} = this;
    link?.lead(state, state);
    this.link = undefined;
    this.canvas.useTool(undefined);
    link?.end();
  }
}

/** A free place near the middle of the visible part. @param {HfsmCanvas} canvas */
function freePlace(canvas) {
  const {left, top, right, bottom} = canvas.viewport.seen;
  const middle = {x: Math.round((left + right) / 2), y: Math.round((top + bottom) / 2)};
  const states = page.automaton?.states ?? [];
  for (let ring = 0; ring < 12; ring++) {
    const count = Math.max(1, ring * 6);
    for (let turn = 0; turn < count; turn++) {
      const angle = (turn / count) * 2 * Math.PI;
      const place = {
        x: Math.round(middle.x + Math.cos(angle) * ring * 60),
        y: Math.round(middle.y + Math.sin(angle) * ring * 60),
      };
      if (states.every((state) => distance(state, place) > RADIUS * 2.6)) return place;
    }
  }
  return middle;
}
