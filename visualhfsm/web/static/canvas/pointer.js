/**
 * What the pointer does on the canvas: begins gestures, uses tools, opens things, zooms, and shows tips and the menu.
 *
 * A tool draws without holding a button: a new state or transition is placed with arrows and Enter, or with clicks.
 * It has `hint`, `move(event)`, `click(event)`, `key(event)` that says whether it took the key, and `cancel()`.
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
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

const keyOf = (element) => element.closest?.("[data-key]")?.dataset.key;

export class Pointer {
  #gesture;
  #finger; // the pointer of the gesture; others are not heard
  #pressed; // what it was last pressed on
  #spaceHeld = false;
  #whenDone;

  constructor(canvas) {
    this.canvas = canvas;
    const {svg} = canvas;
    svg.addEventListener("pointerdown", (event) => this.#down(event));
    svg.addEventListener("pointermove", (event) => this.#isOther(event) || (this.#gesture ?? canvas.tool)?.move(event));
    svg.addEventListener("pointerup", (event) => this.#isOther(event) || this.#up());
    svg.addEventListener("pointercancel", (event) => this.#isOther(event) || canvas.cancel());
    svg.addEventListener("pointerover", (event) => this.#showTip(event));
    svg.addEventListener("dblclick", (event) => this.#doubleClick(event));
    svg.addEventListener("contextmenu", (event) => this.#menu(event));
    svg.addEventListener("wheel", (event) => this.#wheel(event), {passive: false});
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("keyup", (event) => event.key === " " && (this.#spaceHeld = false));
    // Let go elsewhere.
    canvas.addEventListener("focusout", (event) => canvas.contains(event.relatedTarget) || (this.#spaceHeld = false));
  }

  /** Whether something is being dragged. */
  get isBusy() {
    return Boolean(this.#gesture);
  }

  /** Do something as soon as nothing is dragged. */
  whenFree(action) {
    if (this.#gesture) this.#whenDone = action;
    else action();
  }

  #isOther(event) {
    return Boolean(this.#gesture) && event.pointerId !== this.#finger;
  }

  /** Let what is dragged be where it was; returns whether there was anything. */
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

  #down(event) {
    if (this.#gesture) return;
    const {canvas} = this;
    canvas.rename.commit();
    this.#pressed = event.target;
    const pans = event.button === 1 || (event.button === 0 && this.#spaceHeld);
    if (event.button !== 0 && !pans) return;
    if (canvas.tool && !pans) {
      event.preventDefault();
      canvas.tool.click(event);
      return;
    }
    const group = event.target.closest?.("[data-key]");
    if (pans) {
      event.preventDefault();
      this.#gesture = new Pan(canvas, event);
    } else if (group) {
      this.#gesture = this.#grab(event, group.dataset.key);
    } else {
      canvas.svg.focus({preventScroll: true});
      this.#gesture = new Band(canvas, event);
    }
    this.#finger = event.pointerId;
    // The group itself, or a double click would go to the whole drawing.
    if (this.#gesture) (group ?? canvas.svg).setPointerCapture(event.pointerId);
  }

  #grab(event, key) {
    const {canvas} = this;
    if (event.target.classList.contains("rim") && !event.shiftKey && !canvas.readOnly) {
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
   * What waits for the end of the gesture is done when the server has answered: until then, all stays where it was put.
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

  #doubleClick(event) {
    const {canvas} = this;
    const target = this.#pressed; // that of the event is what has captured the pointer
    const key = keyOf(target);
    if (!key) {
      const {x, y} = canvas.point(event);
      if (!canvas.readOnly && page.automaton) canvas.add("state", "addState", {x: Math.round(x), y: Math.round(y)});
      return;
    }
    const [kind, id] = [key.startsWith("s") ? "state" : "transition", idOf(key)];
    const state = kind === "state" ? page.automaton.states.find((each) => each.id === id) : undefined;
    if (target.closest(".label")) canvas.beginRename(kind, id);
    else if (target.closest(".handle") && !canvas.readOnly) applyHere("resetHandles", {transitions: [id]});
    else if (state?.children.length) page.open(state.children[0]);
    else page.edit({kind, automaton: page.automaton.id, id, part: state ? "code" : "trigger"});
  }

  #menu(event) {
    event.preventDefault();
    const {canvas} = this;
    const key = keyOf(event.target);
    if (key && !canvas.selectedKeys().includes(key)) canvas.order.select(key);
    else if (!key) page.select({});
    const detail = {x: event.clientX, y: event.clientY, point: canvas.point(event)};
    canvas.dispatchEvent(new CustomEvent("hfsm-menu", {bubbles: true, detail}));
  }

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

  /** Only what the pointer is on has a tip, or screen readers would say everything twice. */
  #showTip(event) {
    const {tip, scene} = this.canvas;
    const group = event.target.closest?.("[data-key]") ?? null;
    if (tip.parentNode === group) return;
    tip.remove();
    if (!group) return;
    tip.textContent = scene.view(group.dataset.key)?.tip ?? "";
    group.append(tip);
  }
}

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

  #place() {
    this.canvas.useTool(undefined);
    this.canvas.add("state", "addState", this.point);
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

/** A place near the middle of what is seen, where no state stands. */
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
