/**
 * A small picture of the whole automaton, with a frame around the visible part; a click moves there. Hidden while
 * everything is visible.
 */

import {page} from "../data/page.js";
import {required} from "../kit/existence.js";
import {t} from "../kit/texts.js";
import {contains, RADIUS} from "../measures/geometry.js";

const WIDTH = 176;
const HEIGHT = 116;
const MARGIN = 8;
const FROM = 6; // states; fewer need no map
const NARROW = 420; // pixels; a narrower canvas has no room for it
const SMALLEST = 1.8; // pixels of a state's radius, unless states would overlap
const MANY = 400; // states
const RING = 1.5; // pixels around selected states
const PATIENCE = 250; // ms after which the picture is drawn even if the page is busy

/** @param {() => void} action */
const whenIdle = (action) =>
  window.requestIdleCallback ? window.requestIdleCallback(action, {timeout: PATIENCE}) : setTimeout(action, PATIENCE);

/** The automaton is painted when the page is idle, and kept as a picture; only the frame moves at once. */
export class Minimap {
  #waiting = false;
  #queued = false;
  #unpainted = true; // not painted as long as everything is visible
  /** The part of the drawing on the map, and its scale. @type {import("../measures/geometry.js").Box | undefined} */
  #box = undefined;
  #scale = 1;
  #x = 0;
  #y = 0;
  #accent = "";

  /** @param {import("./canvas.js").HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.element = document.createElement("canvas");
    this.element.className = "minimap";
    this.element.hidden = true;
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", t("Map of the automaton"));
    this.ratio = window.devicePixelRatio || 1;
    this.picture = document.createElement("canvas");
    for (const each of [this.element, this.picture])
      [each.width, each.height] = [WIDTH * this.ratio, HEIGHT * this.ratio];
    this.element.addEventListener("pointerdown", (event) => {
      this.element.setPointerCapture(event.pointerId);
      this.#go(event);
    });
    this.element.addEventListener(
      "pointermove",
      (event) => this.element.hasPointerCapture(event.pointerId) && this.#go(event),
    );
  }

  /** Redraw the whole map soon. */
  draw() {
    if (this.#waiting) return;
    this.#waiting = true;
    whenIdle(() => {
      this.#waiting = false;
      this.#paint();
      this.frame();
    });
  }

  /** Redraw the frame around the visible part in the next animation frame. */
  frame() {
    if (this.#queued) return;
    this.#queued = true;
    requestAnimationFrame(() => {
      this.#queued = false;
      this.element.hidden = !this.#box || contains(this.canvas.viewport.seen, this.#box);
      if (this.element.hidden) return;
      if (this.#unpainted) this.draw();
      else this.#drawFrame();
    });
  }

  #paint() {
    const {drawing, viewport} = this.canvas;
    const few = drawing.states.size < FROM || viewport.size().width < NARROW;
    const box = few ? undefined : drawing.bounds(0); // without labels
    this.#box = box;
    this.#unpainted = !box || contains(viewport.seen, box);
    if (!box || this.#unpainted) return;
    const style = getComputedStyle(this.canvas);
    /** @param {string} name */
    const color = (name) => style.getPropertyValue(name);
    const context = this.#cleared(this.picture);
    this.#scale = Math.min(
      (WIDTH - 2 * MARGIN) / (box.right - box.left),
      (HEIGHT - 2 * MARGIN) / (box.bottom - box.top),
    );
    this.#x = WIDTH / 2 - ((box.left + box.right) / 2) * this.#scale;
    this.#y = HEIGHT / 2 - ((box.top + box.bottom) / 2) * this.#scale;
    context.fillStyle = color("--line");
    for (const {left, top, right, bottom} of drawing.annotations.boxes()) {
      const [x, y] = this.#at({x: left, y: top});
      const [endX, endY] = this.#at({x: right, y: bottom});
      context.globalAlpha = 0.5;
      context.fillRect(x, y, endX - x, endY - y);
    }
    context.globalAlpha = 1;
    context.strokeStyle = color("--arc");
    context.lineWidth = 0.6;
    context.beginPath();
    for (const {transition, arc} of drawing.transitions.values()) {
      const from = drawing.places.get(`s${transition.origin}`);
      const to = drawing.places.get(`s${transition.destination}`);
      if (!from || !to || from === to) continue;
      context.moveTo(...this.#at(from));
      context.quadraticCurveTo(
        ...this.#at({x: 2 * arc.middle.x - (from.x + to.x) / 2, y: 2 * arc.middle.y - (from.y + to.y) / 2}),
        ...this.#at(to),
      );
    }
    context.stroke();
    const circles = {"--plain-line": new Path2D(), "--parent-line": new Path2D()};
    const rings = new Path2D();
    const radius = Math.max(drawing.states.size > MANY ? SMALLEST / 3 : SMALLEST, RADIUS * this.#scale);
    for (const [key, {state}] of drawing.states) {
      const path = circles[state.children.length ? "--parent-line" : "--plain-line"];
      const [x, y] = this.#at(required(drawing.places.get(key), "state"));
      path.moveTo(x + radius, y);
      path.arc(x, y, radius, 0, 2 * Math.PI);
      if (!page.states.has(state.id)) continue;
      rings.moveTo(x + radius + RING, y);
      rings.arc(x, y, radius + RING, 0, 2 * Math.PI);
    }
    for (const [name, path] of Object.entries(circles)) {
      context.fillStyle = color(name);
      context.fill(path);
    }
    context.strokeStyle = color("--select");
    context.lineWidth = RING;
    context.stroke(rings);
    this.#accent = color("--accent");
  }

  #drawFrame() {
    const context = this.#cleared(this.element);
    context.drawImage(this.picture, 0, 0, WIDTH, HEIGHT);
    const {seen} = this.canvas.viewport;
    context.strokeStyle = this.#accent;
    context.lineWidth = 1.5;
    const [left, top] = this.#at({x: seen.left, y: seen.top});
    const [right, bottom] = this.#at({x: seen.right, y: seen.bottom});
    context.strokeRect(left, top, right - left, bottom - top);
  }

  /**
   * Convert a point of the drawing to the map.
   *
   * @param {import("../measures/geometry.js").Point} point
   * @returns {[number, number]}
   */
  #at({x, y}) {
    return [x * this.#scale + this.#x, y * this.#scale + this.#y];
  }

  /** @param {HTMLCanvasElement} canvas */
  #cleared(canvas) {
    const context = required(canvas.getContext("2d"), "canvas");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, WIDTH, HEIGHT);
    return context;
  }

  /** @param {PointerEvent} event */
  #go({clientX, clientY}) {
    const {left, top} = this.element.getBoundingClientRect();
    this.canvas.viewport.center({
      x: (clientX - left - this.#x) / this.#scale,
      y: (clientY - top - this.#y) / this.#scale,
    });
  }
}
