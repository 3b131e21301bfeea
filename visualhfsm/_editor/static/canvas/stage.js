/**
 * What of a drawing is on the page.
 *
 * A small drawing is there whole. Of a large one only what is seen is there, and what is near: it comes and goes as the
 * view moves. Where too much is seen for that, a crowd takes its place. What is held is there in any case, such as what
 * has the focus.
 *
 * @import {Box, Point} from "../measures/geometry.js"
 * @import {View} from "./merged-elements.js"
 */

import {MergedElements} from "./merged-elements.js";
import {boxOf, contains, distance, pointsOf, RADIUS, wider} from "../measures/geometry.js";
import {Plane, touches} from "./plane.js";
import {StateView} from "./state-view.js";
import {make} from "./svg.js";
import {VERY_FAR} from "./viewport.js";

const MOST = 300; // views that are seen one by one where none has a label
const LESS = 250; // so many are, once there was a crowd
const MARGIN = 0.4; // of the width and height of what is seen
const AT_ONCE = 100; // views that are drawn in one frame, where the picture is complete without them
const SPARE = 500; // views that stay while the view moves, though they are no longer near
const HIT = 7; // pixels beside an arc that still belong to it

export class Stage {
  arcs = make("g", {class: "arcs"});
  names = make("g", {class: "names", "aria-hidden": "true"});
  circles = make("g", {class: "circles"});
  /** Whether only a part is drawn. */
  isLarge = false;
  /** Whether views are being moved. */
  isLifted = false;

  /** @type {Plane<View>} */
  #plane = new Plane();
  #crowd = new MergedElements();
  #isCrowded = false;
  /** Views that are drawn one by one. @type {Set<View>} */
  #drawn = new Set();
  /** Those that were not reported yet. @type {View[]} */
  #unreported = [];
  /** Views that stay drawn, by what holds them. @type {Map<string, Set<View>>} */
  #held = new Map();
  /** The part of the drawing in which all is drawn. @type {Box | undefined} */
  #complete = undefined;
  /** What was last seen. @type {{seen: Box, scale: number} | undefined} */
  #last = undefined;
  #frame = 0;
  #rests = false;

  /** @param {(views: View[]) => void} report called with views that have just been drawn */
  constructor(report) {
    this.report = report;
    this.arcs.append(this.#crowd.arcs);
    this.circles.append(this.#crowd.circles);
  }

  /** All layers, from the lowest to the highest. */
  get layers() {
    return [this.arcs, this.names, this.circles];
  }

  /** Views that are drawn one by one. @returns {ReadonlySet<View>} */
  get drawn() {
    return this.#drawn;
  }

  /** Draw only a part from now on, or all. @param {boolean} isLarge @param {Iterable<View>} views all of them */
  cull(isLarge, views) {
    if (isLarge === this.isLarge) return;
    this.isLarge = isLarge;
    this.#disperse();
    if (!isLarge) this.#crowd.clear();
    for (const view of views) this.put(view);
  }

  /** Take in a view that is new, has moved or looks different. @param {View} view */
  put(view) {
    this.#plane.put(view, view.box);
    this.#complete = undefined;
    if (this.isLarge) this.#crowd.put(view);
    else this.#draw(view);
  }

  /** A view looks different. @param {View} view */
  change(view) {
    if (this.isLarge) this.#crowd.put(view);
  }

  /** @param {View} view */
  remove(view) {
    this.#erase(view);
    this.#plane.remove(view);
    this.#crowd.remove(view);
    for (const views of this.#held.values()) views.delete(view);
  }

  clear() {
    for (const view of this.#drawn) view.erase();
    this.#drawn.clear();
    this.#unreported = [];
    this.#held.clear();
    this.#plane.clear();
    this.#crowd.clear();
    this.#complete = undefined;
  }

  /** The views in a part of the drawing. @param {Box} box */
  within(box) {
    return this.#plane.within(box);
  }

  /** The state at a point, or else the transition, where the crowd shows them. @param {Point} point */
  at(point) {
    if (!this.#isCrowded) return undefined;
    const found = [...this.#plane.within(wider(boxOf([point]), HIT))];
    return (
      found.findLast((view) => view instanceof StateView && distance(view.middle, point) <= RADIUS) ??
      found.findLast(
        (view) => !(view instanceof StateView) && pointsOf(view.arc, HIT).some((each) => distance(each, point) <= HIT),
      )
    );
  }

  /**
   * Keep views drawn, in place of those that were held for the same reason.
   *
   * @param {string} reason @param {Iterable<View>} views
   */
  hold(reason, views) {
    const held = new Set(views);
    this.#held.set(reason, held);
    for (const view of held) this.#draw(view);
    this.#report();
  }

  /** Draw what is seen, and something around it. @param {Box} seen @param {number} scale */
  look(seen, scale) {
    this.#last = {seen, scale};
    this.#rests = false;
    this.#see();
  }

  /** The view rests: what is no longer near can go. */
  rest() {
    this.#rests = true;
    this.#see();
  }

  /** Draw what has changed. */
  draw() {
    if (this.#isCrowded) this.#crowd.draw();
    this.#see();
    this.#report();
  }

  #see() {
    cancelAnimationFrame(this.#frame);
    if (!this.isLarge || !this.#last) return;
    const {seen, scale} = this.#last;
    if (!this.#rests && this.#complete && contains(this.#complete, seen)) return;
    const limit = scale < VERY_FAR ? (this.#isCrowded ? LESS : MOST) : Infinity;
    if (this.#plane.within(seen, limit + 1).size > limit) this.#gather();
    else this.#drawAround(seen);
  }

  /** Begin to move views: some as a whole, others in another shape each time. @param {View[]} carried @param {View[]} bent */
  lift(carried, bent) {
    if (!this.isLarge) return;
    this.isLifted = true;
    const views = [...carried, ...bent];
    if (views.length > AT_ONCE) return this.#crowd.lift(carried, bent);
    this.hold("lifted", views);
    this.#crowd.leave(views);
    this.#crowd.draw();
  }

  /** Show views elsewhere that were lifted. @param {number} dx @param {number} dy @param {Iterable<View>} views */
  shift(dx, dy, views) {
    if (!this.isLarge) return;
    this.#crowd.shift(dx, dy);
    if (!this.#isCrowded) for (const view of views) this.#plane.put(view, view.box);
    this.#complete = undefined;
    this.draw();
  }

  /** The views that were lifted are at their places. @param {Iterable<View>} views */
  settle(views) {
    if (!this.isLifted) return;
    this.isLifted = false;
    this.#held.delete("lifted");
    for (const view of views) this.put(view);
    this.draw();
  }

  /** So much is seen that it is drawn by the crowd. */
  #gather() {
    this.#complete = undefined;
    if (this.#isCrowded) return;
    this.#isCrowded = true;
    this.#crowd.draw();
    this.#crowd.show(true);
    this.#leaveOut(new Set());
  }

  /** @param {Box} seen */
  #drawAround(seen) {
    const near = wider(seen, (seen.right - seen.left) * MARGIN, (seen.bottom - seen.top) * MARGIN);
    const wanted = this.#plane.within(near);
    const missing = [...wanted].filter((view) => !this.#drawn.has(view)).sort((a, b) => a.order - b.order);
    const inSight = missing.filter((view) => touches(view.box, seen));
    const nearby = missing.filter((view) => !touches(view.box, seen));
    // Where the crowd shows them meanwhile, those in sight may come one after the other, too.
    const count = this.#isCrowded ? AT_ONCE : Math.max(AT_ONCE, inSight.length);
    for (const view of [...inSight, ...nearby].slice(0, count)) this.#draw(view);
    if (inSight.length <= count) this.#disperse();
    if (count < missing.length) this.#frame = requestAnimationFrame(() => this.#see());
    else {
      this.#complete = near;
      if (this.#rests || this.#drawn.size > wanted.size + SPARE) this.#leaveOut(wanted);
    }
    this.#report();
  }

  /** All that is seen is drawn one by one. */
  #disperse() {
    if (this.#isCrowded) this.#crowd.show(false);
    this.#isCrowded = false;
  }

  /** Remove what is neither wanted nor held. @param {Set<View>} wanted */
  #leaveOut(wanted) {
    const kept = new Set([...this.#held.values()].flatMap((views) => [...views]));
    for (const view of this.#drawn)
      if (!wanted.has(view) && !kept.has(view) && view.group !== document.activeElement) this.#erase(view);
  }

  /** @param {View} view */
  #draw(view) {
    if (this.#drawn.has(view)) return;
    this.#drawn.add(view);
    this.#unreported.push(view);
    (view instanceof StateView ? this.circles : this.arcs).append(view.draw());
    if (view.label) this.names.append(view.label);
  }

  #report() {
    const views = this.#unreported;
    this.#unreported = [];
    if (views.length) this.report(views);
  }

  /** @param {View} view */
  #erase(view) {
    if (this.#drawn.delete(view)) view.erase();
  }
}
