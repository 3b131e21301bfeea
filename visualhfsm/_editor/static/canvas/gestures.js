/**
 * Gestures of the pointer: pan, pinch, select in a box, move, bend, connect.
 *
 * Each gesture has `move(event)`, `end(event)` and `cancel()`; the document does not change before the end.
 *
 * @import {HfsmCanvas} from "./canvas.js"
 * @import {Point} from "../measures/geometry.js"
 * @import {State} from "../data/protocol.js"
 */

import {applyHere, selected} from "../data/commands.js";
import {triggerFrom} from "../data/outline.js";
import {page} from "../data/page.js";
import {required} from "../kit/existence.js";
import {areaOf, withContent} from "../measures/areas.js";
import {contains, drawnArc, RADIUS} from "../measures/geometry.js";
import {make} from "./svg.js";

const CLICK = 3; // pixels; a shorter move is a click
const CLEAR = 2.2; // radii; a new state that is nearer would lie on the one before it

export class Pan {
  /** @param {HfsmCanvas} canvas @param {PointerEvent} event */
  constructor(canvas, event) {
    this.canvas = canvas;
    this.x = event.clientX;
    this.y = event.clientY;
    canvas.classList.add("panning");
  }

  /** @param {PointerEvent} event */
  move({clientX, clientY}) {
    this.canvas.viewport.pan(clientX - this.x, clientY - this.y);
    this.x = clientX;
    this.y = clientY;
  }

  end() {
    this.cancel();
  }

  cancel() {
    this.canvas.classList.remove("panning");
  }
}

/** Pan and zoom with two fingers. */
export class Pinch {
  /** @param {HfsmCanvas} canvas @param {Map<number, PointerEvent>} fingers their present positions, kept up to date */
  constructor(canvas, fingers) {
    this.canvas = canvas;
    this.fingers = fingers;
    this.before = this.#between();
  }

  move() {
    const {before, canvas} = this;
    const now = (this.before = this.#between());
    const {left, top} = canvas.getBoundingClientRect();
    canvas.viewport.pan(now.x - before.x, now.y - before.y);
    canvas.viewport.zoom(now.spread / before.spread, now.x - left, now.y - top);
  }

  end() {}

  cancel() {}

  /** The point between the fingers, and their distance. */
  #between() {
    const [one, other] = this.fingers.values();
    return {
      x: (one.clientX + other.clientX) / 2,
      y: (one.clientY + other.clientY) / 2,
      spread: Math.max(1, Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY)),
    };
  }
}

/** Select all states and handles in a box. */
export class Band {
  scrolls = true;

  /** @param {HfsmCanvas} canvas @param {PointerEvent} event */
  constructor(canvas, event) {
    this.canvas = canvas;
    this.start = canvas.point(event);
    this.before = event.shiftKey ? selected() : {states: [], transitions: [], annotations: []};
    if (!event.shiftKey) page.select({});
    this.box = make("rect", {class: "band"});
    canvas.sketch.append(this.box);
  }

  /** @param {PointerEvent} event */
  move(event) {
    const {start} = this;
    const point = this.canvas.point(event);
    const [left, right] = [Math.min(start.x, point.x), Math.max(start.x, point.x)];
    const [top, bottom] = [Math.min(start.y, point.y), Math.max(start.y, point.y)];
    const drawn = {x: left, y: top, width: right - left, height: bottom - top};
    for (const [name, value] of Object.entries({...drawn, "stroke-width": 1 / this.canvas.viewport.scale}))
      this.box.setAttribute(name, String(value));
    /** @param {string} key */
    const within = (key) => {
      const place = this.canvas.drawing.places.get(key); // none yet for an element that another window has just added
      return place && place.x >= left && place.x <= right && place.y >= top && place.y <= bottom;
    };
    /** @param {"states" | "transitions"} kind */
    const inside = (kind) => (page.automaton?.[kind] ?? []).map(({id}) => id).filter((id) => within(`${kind[0]}${id}`));
    const whole = (page.automaton?.annotations ?? []).filter((each) =>
      contains({left, right, top, bottom}, areaOf(each)),
    );
    page.select({
      states: new Set([...this.before.states, ...inside("states")]),
      transitions: new Set([...this.before.transitions, ...inside("transitions")]),
      annotations: new Set([...this.before.annotations, ...whole.map(({id}) => id)]),
    });
  }

  end() {
    this.box.remove();
  }

  cancel() {
    this.box.remove();
    page.select(this.before);
  }
}

/** Move what is selected, with what lies in selected frames; the other handles at these states follow. */
export class Move {
  scrolls = true;

  /**
   * @param {HfsmCanvas} canvas @param {PointerEvent} event
   * @param {() => void} click called when nothing was moved after all
   */
  constructor(canvas, event, click) {
    this.canvas = canvas;
    this.click = click;
    this.start = canvas.point(event);
    this.x = event.clientX;
    this.y = event.clientY;
    this.began = false;
    this.dx = 0;
    this.dy = 0;
    /** Keys of the transitions that move with both their states. @type {Set<string>} */
    this.carried = new Set();
    /** What moves, and which part of the way. @type {{key: string, part: number}[]} */
    this.moving = [];
    this.before = new Map(canvas.drawing.places);
  }

  /** @param {PointerEvent} event */
  move(event) {
    if (!this.began && Math.hypot(event.clientX - this.x, event.clientY - this.y) < CLICK) return;
    if (!this.began) this.#begin();
    const point = this.canvas.point(event);
    this.dx = Math.round(point.x - this.start.x);
    this.dy = Math.round(point.y - this.start.y);
    this.canvas.drawing.preview(this.#places(), {dx: this.dx, dy: this.dy, keys: this.carried});
  }

  #begin() {
    this.began = true;
    this.chosen = withContent(page.shownAutomaton, selected());
    const [states, transitions] = [new Set(this.chosen.states), new Set(this.chosen.transitions)];
    for (const id of states) this.moving.push({key: `s${id}`, part: 1});
    for (const id of this.chosen.annotations) this.moving.push({key: `a${id}`, part: 1});
    for (const {id, origin, destination} of page.shownAutomaton.transitions) {
      const key = `t${id}`;
      const ends = Number(states.has(origin)) + Number(states.has(destination));
      if (ends === 2) this.carried.add(key);
      if (transitions.has(id)) this.moving.push({key, part: 1});
      else if (ends) this.moving.push({key, part: ends / 2});
    }
  }

  /** Ids of what moves, which is decided at its beginning. @type {ReturnType<typeof withContent>} */
  chosen = {states: [], transitions: [], annotations: []};

  #places() {
    /** @type {Map<string, Point>} */
    const moved = new Map();
    for (const {key, part} of this.moving) {
      const place = this.before.get(key);
      if (place) moved.set(key, {x: place.x + this.dx * part, y: place.y + this.dy * part});
    }
    return moved;
  }

  async end() {
    if (!this.began) this.click();
    if (!this.dx && !this.dy) return;
    await applyHere("moveItems", {...this.chosen, dx: this.dx, dy: this.dy});
    this.canvas.redraw(); // even after a refusal, to move everything back
  }

  cancel() {
    if (this.began) this.canvas.drawing.preview(this.before);
  }
}

/** Draw a transition from a state to where the pointer is released. */
export class Link {
  scrolls = true;

  /** @param {HfsmCanvas} canvas @param {number} origin */
  constructor(canvas, origin) {
    this.canvas = canvas;
    this.origin = origin;
    this.from = required(canvas.drawing.places.get(`s${origin}`), "state");
    /** @type {number | undefined} */
    this.destination = undefined;
    this.point = this.from;
    this.path = make("path", {class: "line"});
    this.head = make("path", {class: "head"});
    this.group = make("g", {class: "transition drawn"}, this.path, this.head);
    canvas.sketch.append(this.group);
    canvas.classList.add("linking");
  }

  /** @param {PointerEvent} event */
  move(event) {
    this.lead(this.canvas.stateAt(this.canvas.point(event)), this.canvas.point(event));
  }

  /** Set its end to a state, or to a point. @param {State | undefined} state @param {Point} point */
  lead(state, point) {
    this.destination = state?.id;
    this.point = point;
    const made = drawnArc(this.from, state ?? point, Boolean(state));
    this.path.setAttribute("d", made.path);
    this.head.setAttribute("d", made.head);
    this.canvas.markTarget(state?.id);
  }

  /** Connect the states; on empty ground, with a new one. */
  async end() {
    this.cancel();
    const {canvas, origin, destination, from, point} = this;
    const type = triggerFrom(page.shownDocument, page.shownAutomaton, origin);
    if (destination !== undefined) await canvas.add("transition", "addTransition", {origin, destination, type});
    else if (Math.hypot(point.x - from.x, point.y - from.y) > CLEAR * RADIUS) {
      const [x, y] = [Math.round(point.x), Math.round(point.y)];
      await canvas.add("state", "addState", {x, y, origin, trigger: type});
    }
  }

  cancel() {
    this.group.remove();
    this.canvas.markTarget(undefined);
    this.canvas.classList.remove("linking");
  }
}
