/**
 * The drawing of one automaton: keeps the elements of the page in step with the document.
 *
 * An element exists as long as its state or transition, and only differences are drawn, so that a command in a document
 * of hundreds of states is drawn at once. In a large automaton, names and handles are created when they come into view.
 */

import {outgoing} from "../outline.js";
import {required} from "../required.js";
import {bounds, contains, handles, pointsOf, RADIUS} from "./geometry.js";
import {placeLabels} from "./labels.js";
import {markState, markTransition} from "./live-marks.js";
import {StateView} from "./state-view.js";
import {make} from "./svg.js";
import {TransitionView} from "./transition-view.js";
import {FAR, TINY, VERY_FAR} from "./viewport.js";

const LARGE = 1000; // states and transitions; in larger automata only visible details are created

/**
 * @import {Automaton, Problem, State, Transition} from "../protocol.js"
 * @import {Box, Point} from "./geometry.js"
 * @import {Live} from "./live-marks.js"
 * @typedef {{imported: (state: State) => boolean, problem: (kind: "state" | "transition", id: number) => Problem |
 *   undefined, marks?: Map<string, string>}} More what is drawn besides, by keys such as `s1` and `t2`
 */

export class Drawing {
  constructor() {
    this.arcs = make("g", {class: "arcs"});
    this.names = make("g", {class: "names", "aria-hidden": "true"});
    this.circles = make("g", {class: "circles"});
    /** All layers, from the lowest to the highest. */
    this.layers = [this.arcs, this.names, this.circles];
    /** @type {Map<string, StateView>} */
    this.states = new Map();
    /** @type {Map<string, TransitionView>} */
    this.transitions = new Map();
    /** The present place of every element, also while it is dragged. @type {Map<string, Point>} */
    this.places = new Map();
    /** @type {Automaton | undefined} */
    this.automaton = undefined;
  }

  /** Views without names and handles, which have not come into view yet. @type {Set<StateView | TransitionView>} */
  #bare = new Set();
  #isLarge = false;

  /** The view of a key such as `s1` or `t2`. @param {string} key @returns {StateView | TransitionView | undefined} */
  view(key) {
    return key.startsWith("s") ? this.states.get(key) : this.transitions.get(key);
  }

  /**
   * Show an automaton as the document has it.
   *
   * @param {Automaton | undefined} automaton
   * @param {More} more
   */
  update(automaton, more) {
    const other = automaton?.id !== this.automaton?.id;
    this.automaton = automaton;
    const {states = [], transitions = []} = automaton ?? {};
    if (other) {
      this.#clear();
      this.#isLarge = states.length + transitions.length > LARGE;
      this.#detailed = !this.#isLarge;
    }
    this.places.clear();
    let changed = other;
    /** @type {Map<number, Point>} */
    const points = new Map();
    /** @type {Map<number, string>} */
    const names = new Map();
    for (const {view, item: state, key} of this.#sync(this.states, this.circles, states, "s", newState)) {
      view.update(state, {
        problem: more.problem("state", state.id),
        imported: more.imported(state),
        mark: more.marks?.get(key),
      });
      changed = view.place(state) || changed;
      this.places.set(key, state);
      if (!points.has(state.id)) {
        points.set(state.id, state);
        names.set(state.id, state.name);
      }
    }
    const ranks = ranksOf(transitions);
    const grips = handles(transitions, points);
    for (const each of this.#sync(this.transitions, this.arcs, transitions, "t", newTransition)) {
      const {view, item: transition, key} = each;
      const from = names.get(transition.origin) ?? "nothing";
      const to = names.get(transition.destination) ?? "nothing";
      const rewritten = view.update(transition, {
        from,
        to,
        rank: ranks.get(transition) ?? 0,
        problem: more.problem("transition", transition.id),
        mark: more.marks?.get(key),
      });
      const handle = required(grips.get(transition), "handle");
      this.places.set(key, handle);
      const replaced = view.place(
        points.get(transition.origin),
        points.get(transition.destination),
        handle,
        transition.origin === transition.destination,
      );
      changed = rewritten || replaced || changed;
    }
    if (!this.#isLarge) for (const view of this.#bare) this.#finish(view);
    if (changed || this.#moved) {
      this.#stale = true;
      if (this.#detailed) this.#placeDetails();
    }
    this.#moved = false;
  }

  #moved = false;

  /**
   * Show elements elsewhere while they are dragged.
   *
   * @param {Map<string, Point>} moved
   * @param {{dx: number, dy: number, keys: Set<string>}} [carried] transitions that move with both their
   *   states unchanged, from their places at the beginning of the drag
   */
  preview(moved, carried) {
    this.#moved = true;
    for (const [key, point] of moved) {
      this.places.set(key, point);
      this.states.get(key)?.place(point);
    }
    for (const [key, view] of this.transitions) {
      if (carried?.keys.has(key)) {
        view.carry(carried.dx, carried.dy);
        continue;
      }
      const {origin, destination} = view.transition;
      if (!moved.has(key) && !moved.has(`s${origin}`) && !moved.has(`s${destination}`)) continue;
      const before = view.offset;
      if (
        !view.place(
          this.places.get(`s${origin}`),
          this.places.get(`s${destination}`),
          required(this.places.get(key), "handle"),
          origin === destination,
        )
      )
        continue;
      if (before) view.placeName({x: view.arc.middle.x + before.x, y: view.arc.middle.y + before.y});
    }
  }

  #stale = false;
  #detailed = true; // whether labels and badges are visible; they are placed only then

  /**
   * Create the elements for a part of the drawing.
   *
   * @param {Box} seen
   * @param {number} scale
   */
  look(seen, scale) {
    this.#detailed = scale >= VERY_FAR;
    if (this.#bare.size && scale >= TINY) this.#approach(seen);
    if (this.#detailed && this.#stale) this.#placeDetails();
  }

  /**
   * Finish the visible elements, and then those nearby, so that small moves need no work.
   *
   * @param {Box} seen
   */
  #approach(seen) {
    /** @param {Box} box */
    const within = (box) =>
      [...this.#bare].filter((view) => (this.#detailed || view instanceof StateView) && view.isIn(box));
    /** @param {number} part of its width and height */
    const around = (part) => wider(seen, (seen.right - seen.left) * part, (seen.bottom - seen.top) * part);
    if (within(around(0.1)).length) within(around(0.5)).forEach((view) => this.#finish(view));
  }

  /** @param {StateView | TransitionView} view */
  #finish(view) {
    if (!this.#bare.delete(view)) return;
    view.finish();
    if (view.label) this.names.append(view.label);
    this.#stale = true;
  }

  #placeDetails() {
    this.#stale = false;
    this.#placeNames();
    this.#placeBadges();
  }

  /** Place all names so that none covers another. */
  #placeNames() {
    const views = [...this.transitions.values()].filter((view) => view.complete);
    const found = placeLabels(
      views.map((view) => view.asLabel()),
      this.#circles(),
      views.map((view) => view.arc),
    );
    for (const view of views) view.placeName(found.get(view)?.middle, found.get(view)?.size);
  }

  /** The positions of the states. */
  #circles() {
    return [...this.states.keys()].flatMap((key) => this.places.get(key) ?? []);
  }

  /** Place badges where no arc begins or ends. */
  #placeBadges() {
    /** @type {Map<number, number[]>} */
    const angles = new Map();
    for (const {arc, transition} of this.transitions.values()) {
      for (const {id, point} of [
        {id: transition.origin, point: arc.start},
        {id: transition.destination, point: arc.end},
      ]) {
        const place = this.places.get(`s${id}`);
        if (!place || !point) continue;
        const angle = Math.atan2(point.y - place.y, point.x - place.x);
        const known = angles.get(id);
        if (known) known.push(angle);
        else angles.set(id, [angle]);
      }
    }
    for (const view of this.states.values()) view.placeBadges(angles.get(view.state.id) ?? []);
  }

  /** Mark what is selected. @param {Set<number>} states @param {Set<number>} transitions */
  select(states, transitions) {
    for (const view of this.states.values()) mark(view, states.has(view.state.id));
    for (const view of this.transitions.values()) mark(view, transitions.has(view.transition.id));
  }

  /** @type {Map<string, Live> | undefined} */
  #live;

  /**
   * Show what a running component does.
   *
   * @param {Map<string, Live> | undefined} live by key; undefined for nothing
   */
  showLive(live) {
    if (!live && !this.#live) return;
    this.#mark(this.states, markState, live);
    this.#mark(this.transitions, markTransition, live);
    this.#live = live;
    if (this.#stale && this.#detailed) this.#placeDetails();
  }

  /**
   * @template {StateView | TransitionView} View
   * @param {Map<string, View>} views
   * @param {(view: View, live?: Live) => void} show
   * @param {Map<string, Live> | undefined} live
   */
  #mark(views, show, live) {
    for (const [key, view] of views) {
      const now = live?.get(key);
      if (!now && !this.#live?.has(key)) continue;
      if (now) this.#finish(view);
      show(view, now);
    }
  }

  /** The box around everything that is visible at a scale. */
  bounds(scale = 1) {
    const arcs = [...this.transitions.values()].map(({arc}) => arc);
    return bounds(this.#circles(), [...arcs, ...this.#labels(scale).map((box) => ({box}))]);
  }

  /** Whether nothing that is visible at a scale is in a box. @param {Box} box @param {number} scale */
  isEmpty(box, scale) {
    const far = RADIUS + 8;
    return (
      this.#circles().every(({x, y}) => !contains(wider(box, far), {left: x, right: x, top: y, bottom: y})) &&
      this.#labels(scale).every((label) => !overlap(label, box)) &&
      [...this.transitions.values()].every(
        ({arc}) =>
          !overlap(arc.box, box) ||
          pointsOf(arc, RADIUS / 2).every(({x, y}) => !contains(box, {left: x, right: x, top: y, bottom: y})),
      )
    );
  }

  /** The boxes of the labels that are visible at a scale. @param {number} scale */
  #labels(scale) {
    if (scale < VERY_FAR) return [];
    return [...this.transitions.values()].flatMap(({nameAt, text}) => {
      const {name, width, height, nameWidth} = text;
      const wide = scale >= FAR ? width : nameWidth;
      if (!nameAt || !wide) return [];
      const top = nameAt.y - height / 2;
      const bottom = nameAt.y + (scale < FAR && name ? 0 : height / 2);
      return [{left: nameAt.x - wide / 2, right: nameAt.x + wide / 2, top, bottom}];
    });
  }

  #clear() {
    for (const layer of this.layers) layer.replaceChildren();
    this.states.clear();
    this.transitions.clear();
    this.#bare.clear();
  }

  /**
   * Return the view of each item with its key: known views are kept, new ones created, and old ones removed.
   *
   * @template {State | Transition} Item
   * @template {StateView | TransitionView} View
   * @param {Map<string, View>} views
   * @param {SVGElement} parent
   * @param {Item[]} items
   * @param {"s" | "t"} prefix of the keys
   * @param {(item: Item) => View} made
   * @returns {{view: View, item: Item, key: string}[]}
   */
  #sync(views, parent, items, prefix, made) {
    /** @type {{view: View, item: Item, key: string}[]} */
    const found = [];
    /** @type {Set<string>} */
    const wanted = new Set();
    const fresh = document.createDocumentFragment();
    for (const item of items) {
      let key = `${prefix}${item.id}`;
      while (wanted.has(key)) key += "'"; // two with the same number, in an invalid document
      wanted.add(key);
      let view = views.get(key);
      if (!view) {
        view = made(item);
        views.set(key, view);
        fresh.append(view.group);
        this.#bare.add(view);
      }
      found.push({view, item, key});
    }
    parent.append(fresh);
    if (views.size === wanted.size) return found;
    for (const [key, view] of views) {
      if (wanted.has(key)) continue;
      view.group.remove();
      view.label?.remove();
      this.#bare.delete(view);
      views.delete(key);
    }
    return found;
  }
}

/** @param {State} state */
const newState = (state) => new StateView(state);
/** @param {Transition} transition */
const newTransition = (transition) => new TransitionView(transition);

/**
 * A box that is larger on each side.
 *
 * @param {Box} box
 * @param {number} x
 * @returns {Box}
 */
const wider = ({left, right, top, bottom}, x, y = x) => ({
  left: left - x,
  right: right + x,
  top: top - y,
  bottom: bottom + y,
});

/** @param {Box} one @param {Box} other */
const overlap = (one, other) =>
  one.left < other.right && other.left < one.right && one.top < other.bottom && other.top < one.bottom;

/** @param {StateView | TransitionView} view @param {boolean} selected */
function mark(view, selected) {
  if (view.selected === selected) return;
  view.selected = selected;
  view.group.classList.toggle("selected", selected);
  view.group.setAttribute("aria-pressed", String(selected));
  view.label?.classList.toggle("selected", selected);
}

/**
 * The place of each transition among those out of its state, where there are several.
 *
 * @param {Transition[]} transitions
 */
function ranksOf(transitions) {
  /** @type {Map<number, Transition[]>} */
  const byOrigin = new Map();
  for (const transition of transitions) {
    const known = byOrigin.get(transition.origin);
    if (known) known.push(transition);
    else byOrigin.set(transition.origin, [transition]);
  }
  /** @type {Map<Transition, number>} */
  const found = new Map();
  for (const group of byOrigin.values()) {
    if (group.length < 2) continue;
    outgoing(group).forEach((transition, index) => found.set(transition, index + 1));
  }
  return found;
}
