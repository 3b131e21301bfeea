/** A small picture of the whole automaton, with a frame around what is seen; a click goes there. */

import {page} from "../page.js";
import {RADIUS} from "./geometry.js";

const WIDTH = 176;
const HEIGHT = 116;
const MARGIN = 8;
const FROM = 6; // states; fewer need no map

export class Minimap {
  #queued = 0;

  constructor(canvas) {
    this.canvas = canvas;
    this.element = document.createElement("canvas");
    this.element.className = "minimap";
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", "Map of the automaton");
    const ratio = window.devicePixelRatio || 1;
    [this.element.width, this.element.height] = [WIDTH * ratio, HEIGHT * ratio];
    this.context = this.element.getContext("2d");
    this.context.scale(ratio, ratio);
    this.element.addEventListener("pointerdown", (event) => {
      this.element.setPointerCapture(event.pointerId);
      this.#go(event);
    });
    this.element.addEventListener("pointermove", (event) => event.buttons && this.#go(event));
  }

  /** Draw it again, at the next picture of the screen. */
  draw() {
    this.#queued ||= requestAnimationFrame(() => {
      this.#queued = 0;
      this.#draw();
    });
  }

  frame() {
    this.draw();
  }

  #draw() {
    const {scene, viewport} = this.canvas;
    const few = (page.automaton?.states.length ?? 0) < FROM || this.canvas.clientWidth < 420;
    this.element.hidden = few;
    const box = few ? undefined : scene.bounds();
    if (!box) return;
    const style = getComputedStyle(this.canvas);
    const {context} = this;
    context.clearRect(0, 0, WIDTH, HEIGHT);
    this.scale = Math.min((WIDTH - 2 * MARGIN) / (box.right - box.left), (HEIGHT - 2 * MARGIN) / (box.bottom - box.top));
    this.x = WIDTH / 2 - ((box.left + box.right) / 2) * this.scale;
    this.y = HEIGHT / 2 - ((box.top + box.bottom) / 2) * this.scale;
    const at = ({x, y}) => [x * this.scale + this.x, y * this.scale + this.y];
    context.strokeStyle = style.getPropertyValue("--arc");
    context.lineWidth = 0.6;
    context.beginPath();
    for (const view of scene.transitions.values()) {
      const from = scene.places.get(`s${view.transition.origin}`);
      const to = scene.places.get(`s${view.transition.destination}`);
      if (!from || !to || from === to) continue;
      context.moveTo(...at(from));
      context.quadraticCurveTo(...at({x: 2 * view.arc.middle.x - (from.x + to.x) / 2, y: 2 * view.arc.middle.y - (from.y + to.y) / 2}), ...at(to));
    }
    context.stroke();
    for (const [key, {state}] of scene.states) {
      const kind = state.children.length ? "parent" : "plain";
      context.fillStyle = style.getPropertyValue(page.states.has(state.id) ? "--accent" : `--${kind}-line`);
      context.beginPath();
      context.arc(...at(scene.places.get(key)), Math.max(1.8, RADIUS * this.scale), 0, 2 * Math.PI);
      context.fill();
    }
    const seen = viewport.seen;
    context.strokeStyle = style.getPropertyValue("--accent");
    context.lineWidth = 1.5;
    const [left, top] = at({x: seen.left, y: seen.top});
    const [right, bottom] = at({x: seen.right, y: seen.bottom});
    context.strokeRect(left, top, right - left, bottom - top);
  }

  #go({clientX, clientY}) {
    const {left, top} = this.element.getBoundingClientRect();
    this.canvas.viewport.center({x: (clientX - left - this.x) / this.scale, y: (clientY - top - this.y) / this.scale});
  }
}
