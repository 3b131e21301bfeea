/**
 * The states and transitions of a large drawing as few elements, for when each is only some pixels large.
 *
 * All that look the same in a part of the plane are one element with the classes that each of them would have, so that
 * all styles hold for them, too.
 *
 * @import {StateView} from "./state-view.js"
 * @import {TransitionView} from "./transition-view.js"
 * @typedef {StateView | TransitionView} View
 * @typedef {{views: Set<View>, arcs: SVGGElement, circles: SVGGElement, stale: boolean}} Part
 */

import {make} from "./svg.js";

const WIDTH = 2000; // pixels of a part of the plane
const ROW = 65536; // parts

export class MergedElements {
  /** Hidden from screen readers: for them there are the tree, and what is selected. */
  arcs = make("g", {class: "crowd", "aria-hidden": "true"});
  circles = make("g", {class: "crowd", "aria-hidden": "true"});
  /** @type {Map<number, Part>} */
  #parts = new Map();
  /** What moves as a whole. @type {Part} */
  #carried = this.#newPart();
  /** What changes its shape while it moves. @type {Part} */
  #bent = this.#newPart();
  /** @type {Map<View, Part | undefined>} */
  #where = new Map();

  constructor() {
    this.show(false);
  }

  /** @param {boolean} visible */
  show(visible) {
    for (const layer of [this.arcs, this.circles]) layer.style.display = visible ? "" : "none";
  }

  /** Take in a view that is new or has changed. @param {View} view */
  put(view) {
    const {x, y} = view.middle;
    this.#move(view, this.#partAt(Math.floor(x / WIDTH) * ROW + Math.floor(y / WIDTH)));
  }

  /** @param {View} view */
  remove(view) {
    this.#move(view, undefined);
    this.#where.delete(view);
  }

  clear() {
    for (const part of this.#parts.values()) for (const group of [part.arcs, part.circles]) group.remove();
    this.#parts.clear();
    this.#where.clear();
    for (const part of [this.#carried, this.#bent]) {
      part.views.clear();
      part.stale = true;
    }
  }

  /** Leave out what is drawn by itself. @param {Iterable<View>} views */
  leave(views) {
    for (const view of views) this.#move(view, undefined);
  }

  /** Begin to move views: some as a whole, others in another shape each time. @param {View[]} carried @param {View[]} bent */
  lift(carried, bent) {
    for (const view of carried) this.#move(view, this.#carried);
    for (const view of bent) this.#move(view, this.#bent);
    this.#write(this.#carried); // as they are before they move
  }

  /** Show what was lifted elsewhere. @param {number} dx @param {number} dy */
  shift(dx, dy) {
    for (const group of [this.#carried.arcs, this.#carried.circles])
      group.setAttribute("transform", `translate(${dx},${dy})`);
    this.#bent.stale = true;
  }

  /** Draw what has changed. */
  draw() {
    for (const part of [...this.#parts.values(), this.#carried, this.#bent]) if (part.stale) this.#write(part);
  }

  /** @param {View} view @param {Part | undefined} part */
  #move(view, part) {
    const former = this.#where.get(view);
    if (former) former.stale = true;
    if (former !== part) former?.views.delete(view);
    part?.views.add(view);
    if (part) part.stale = true;
    this.#where.set(view, part);
  }

  /** @param {number} key */
  #partAt(key) {
    let part = this.#parts.get(key);
    if (!part) this.#parts.set(key, (part = this.#newPart()));
    return part;
  }

  /** @returns {Part} */
  #newPart() {
    const part = {views: new Set(), arcs: make("g"), circles: make("g"), stale: true};
    this.arcs.append(part.arcs);
    this.circles.append(part.circles);
    return part;
  }

  /** @param {Part} part */
  #write(part) {
    part.stale = false;
    /** The outlines by class, of all views with the same classes. @type {Map<string, Map<string, string[]>>} */
    const looks = new Map();
    for (const view of part.views) {
      const {classes} = view;
      let outlines = looks.get(classes);
      if (!outlines) looks.set(classes, (outlines = new Map()));
      for (const [name, path] of view.outlines) {
        const known = outlines.get(name);
        if (known) known.push(path);
        else outlines.set(name, [path]);
      }
    }
    /** @type {Record<"arcs" | "circles", Element[]>} */
    const made = {arcs: [], circles: []};
    for (const [classes, outlines] of looks) {
      const paths = [...outlines].map(([name, all]) => make("path", {class: name, d: all.join("")}));
      made[outlines.has("body") ? "circles" : "arcs"].push(make("g", {class: classes}, ...paths));
    }
    part.arcs.replaceChildren(...made.arcs);
    part.circles.replaceChildren(...made.circles);
    if (part !== this.#carried) return;
    for (const group of [part.arcs, part.circles]) group.removeAttribute("transform");
  }
}
