/** The order of focus in the drawing: Tab reaches one element, arrow keys the others. */

import {page} from "../data/page.js";
import {neighbor} from "../measures/geometry.js";

/** The lists of elements by the first letter of their keys. @type {Record<string, "states" | "transitions" | "annotations">} */
const LISTS = {s: "states", t: "transitions", a: "annotations"};

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
    const kind = LISTS[key[0]];
    /** @param {Set<number>} known */
    const begun = (known) => new Set(add ? known : []);
    const chosen = {
      states: begun(page.states),
      transitions: begun(page.transitions),
      annotations: begun(page.annotations),
    };
    if (add && chosen[kind].has(id)) chosen[kind].delete(id);
    else chosen[kind].add(id);
    this.#current = key;
    page.select(chosen);
  }

  /** Make the selection reachable by Tab, and keep the focus when its element is removed. */
  keep() {
    const {canvas} = this;
    const {drawing} = canvas;
    const known = [...canvas.selectedKeys(), this.#current].find((each) => drawing.find(each));
    const key = known ?? drawing.states.keys().next().value;
    const group = key === undefined ? undefined : drawing.find(key)?.group;
    const former = this.#focusable;
    if (former !== group) {
      former?.setAttribute("tabindex", "-1");
      group?.setAttribute("tabindex", "0");
    }
    this.#focusable = group;
    if (key === undefined) return;
    this.#current = key;
    if (former && !former.isConnected && document.activeElement === document.body) group?.focus({preventScroll: true});
  }

  /** Focus the selection, or else the element that Tab reaches. */
  focusSelected() {
    const {canvas} = this;
    const key = canvas.selectedKeys()[0] ?? this.#current;
    (canvas.drawing.find(key)?.group ?? canvas.surface).focus({preventScroll: true});
  }

  /** Select the nearest element in a direction. @param {[number, number]} direction */
  goTo(direction) {
    const things = [...this.canvas.drawing.places].map(([key, {x, y}]) => ({key, x, y}));
    const from = things.find(({key}) => key === this.#here);
    const next = from ? neighbor(things, from, direction) : things[0];
    if (next) this.#focus(next.key);
  }

  /**
   * Select the next element in reading order: each state, then the transitions out of it, at last notes and frames.
   *
   * @param {number} step
   */
  goOn(step) {
    const {states = [], transitions = [], annotations = []} = page.automaton ?? {};
    /** @type {Map<number, string[]>} */
    const leaving = new Map(states.map(({id}) => [id, []]));
    /** @type {string[]} */
    const lost = []; // transitions that leave no state
    for (const {id, origin} of transitions) (leaving.get(origin) ?? lost).push(`t${id}`);
    const keys = [...states.flatMap(({id}) => [`s${id}`, ...(leaving.get(id) ?? [])]), ...lost];
    keys.push(...annotations.map(({id}) => `a${id}`));
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
    this.canvas.drawing.find(key)?.group.focus({preventScroll: true});
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
