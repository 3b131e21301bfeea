/** The order of focus in the drawing: Tab reaches one element, arrow keys the others. */

import {page} from "../page.js";
import {neighbor} from "./geometry.js";

export class Order {
  #current = ""; // key of the element that Tab reaches
  /** @type {SVGElement | undefined} */
  #focusable;

  /** @param {import("./canvas.js").HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    canvas.surface.addEventListener("focusin", (event) => this.#focused(event));
  }

  /** Forget the current element, as when another automaton is shown. */
  forget() {
    this.#current = "";
  }

  /** Select an element. @param {string} key @param {boolean} add to the selection, or remove from it */
  select(key, add = false) {
    const id = idOf(key);
    const kind = key.startsWith("s") ? "states" : "transitions";
    /** @param {Set<number>} known */
    const begun = (known) => new Set(add ? known : []);
    const chosen = {states: begun(page.states), transitions: begun(page.transitions)};
    if (add && chosen[kind].has(id)) chosen[kind].delete(id);
    else chosen[kind].add(id);
    this.#current = key;
    page.select(chosen);
  }

  /** Make the selection reachable by Tab, and keep the focus when its element is removed. */
  keep() {
    const {canvas} = this;
    const {drawing} = canvas;
    const key = canvas.selectedKeys().find((each) => drawing.view(each)) ?? this.#current;
    const view = drawing.view(key || "s") ?? drawing.states.values().next().value;
    const group = view && drawing.hold("focus", view.key);
    const former = this.#focusable;
    if (former !== group) {
      former?.setAttribute("tabindex", "-1");
      group?.setAttribute("tabindex", "0");
    }
    this.#focusable = group;
    if (!view) return;
    this.#current = view.key;
    if (former && !former.isConnected && document.activeElement === document.body) group?.focus({preventScroll: true});
  }

  /** Focus the selection, or else the element that Tab reaches. */
  focusSelected() {
    const {canvas} = this;
    const key = canvas.selectedKeys()[0] ?? this.#current;
    (canvas.drawing.hold("focused", key || "s") ?? canvas.surface).focus({preventScroll: true});
  }

  /** Select the nearest element in a direction. @param {[number, number]} direction */
  goTo(direction) {
    const things = [...this.canvas.drawing.places].map(([key, {x, y}]) => ({key, x, y}));
    const from = things.find(({key}) => key === this.#here);
    const next = from ? neighbor(things, from, direction) : things[0];
    if (next) this.#focus(next.key);
  }

  /** Select the next element in reading order: each state, then the transitions out of it. @param {number} step */
  goOn(step) {
    const {states = [], transitions = []} = page.automaton ?? {};
    /** @type {Map<number, string[]>} */
    const leaving = new Map(states.map(({id}) => [id, []]));
    /** @type {string[]} */
    const lost = []; // transitions that leave no state
    for (const {id, origin} of transitions) (leaving.get(origin) ?? lost).push(`t${id}`);
    const keys = [...states.flatMap(({id}) => [`s${id}`, ...(leaving.get(id) ?? [])]), ...lost];
    const next = keys.length ? keys.at((keys.indexOf(this.#here) + step) % keys.length) : undefined;
    if (next) this.#focus(next);
  }

  get #here() {
    return this.canvas.selectedKeys()[0] ?? this.#current;
  }

  /** @param {string} key */
  #focus(key) {
    this.select(key);
    const place = this.canvas.drawing.places.get(key);
    if (place) this.canvas.viewport.reveal(place);
    this.canvas.drawing.hold("focused", key)?.focus({preventScroll: true});
  }

  /** @param {FocusEvent} event */
  #focused(event) {
    const key = event.target instanceof SVGElement ? event.target.dataset.key : undefined;
    if (!key) return;
    this.#current = key;
    if (!this.canvas.pointer.isBusy && !this.canvas.selectedKeys().includes(key)) this.select(key);
  }
}

/** The id of an element by its key; in keys of elements with the same id, a suffix follows it. @param {string} key */
export const idOf = (key) => Number.parseInt(key.slice(1), 10);
