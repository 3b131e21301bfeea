/**
 * The drawing of one automaton, in step with the document.
 *
 * A view exists as long as its state or transition, and only differences are drawn, so that a command in a document of
 * hundreds of states is drawn at once.
 */

import {outgoing} from "../data/outline.js";
import {required} from "../kit/existence.js";
import {AnnotationLayer} from "./annotation-view.js";
import {bounds, contains, handles, pointsOf, RADIUS, touches, wider} from "../measures/geometry.js";
import {placeLabels} from "./labels.js";
import {markState, markTransition} from "./live-marks.js";
import {StateView} from "./state-view.js";
import {make} from "./svg.js";
import {TransitionView} from "./transition-view.js";
import {FAR, lettersAt, NAMELESS, nameLettersAt, VERY_FAR} from "./viewport.js";

const WIDEST = 8 * RADIUS; // name of a state
const BETWEEN = 12; // pixels between two names of states
const LINES = 2.4; // times the size of letters: the height of a name

/**
 * @import {Automaton, Problem, State, Transition} from "../data/protocol.js"
 * @import {AnnotationView} from "./annotation-view.js"
 * @import {Box, Point} from "../measures/geometry.js"
 * @import {Live} from "./live-marks.js"
 * @typedef {StateView | TransitionView} View
 * @typedef {{imported: (state: State) => boolean, problem: (kind: "state" | "transition", id: number) => Problem |
 *   undefined, marks?: Map<string, string>}} More what is drawn besides, by keys such as `s1` and `t2`
 */

export class Drawing {
  annotations = new AnnotationLayer();
  /** @type {Map<string, StateView>} */
  states = new Map();
  /** @type {Map<string, TransitionView>} */
  transitions = new Map();
  /** The present place of every element, also while it is dragged. @type {Map<string, Point>} */
  places = new Map();
  /** @type {Automaton | undefined} */
  automaton = undefined;

  #arcs = make("g", {class: "arcs"});
  #names = make("g", {class: "names", "aria-hidden": "true"});
  #circles = make("g", {class: "circles"});

  /** All layers, from the lowest to the highest. */
  get layers() {
    return [this.annotations.group, this.#arcs, this.#names, this.#circles];
  }

  /** What is drawn of a key such as `s1`, `t2` or `a3`. @param {string} key @returns {View | AnnotationView | undefined} */
  find(key) {
    return this.annotations.views.get(key) ?? this.view(key);
  }

  /** The view of a state or a transition. @param {string} key @returns {View | undefined} */
  view(key) {
    return key.startsWith("s") ? this.states.get(key) : this.transitions.get(key);
  }

  /** Show an automaton as the document has it. @param {Automaton | undefined} automaton @param {More} more */
  update(automaton, more) {
    const other = automaton?.id !== this.automaton?.id;
    this.automaton = automaton;
    const {states = [], transitions = []} = automaton ?? {};
    if (other) {
      this.#clear();
      this.#detailed = true;
    }
    this.places.clear();
    let changed = other;
    /** @type {Map<number, Point>} */
    const points = new Map();
    /** @type {Map<number, string>} */
    const names = new Map();
    for (const {view, item: state, key} of this.#sync(this.states, states, "s", newState)) {
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
    changed = this.annotations.update(automaton?.annotations ?? [], more.marks) || changed;
    for (const [key, {box}] of this.annotations.views) this.places.set(key, {x: box.left, y: box.top});
    const ranks = ranksOf(transitions);
    const grips = handles(transitions, points);
    for (const {view, item: transition, key} of this.#sync(this.transitions, transitions, "t", newTransition)) {
      const rewritten = view.update(transition, {
        from: names.get(transition.origin) ?? "nothing",
        to: names.get(transition.destination) ?? "nothing",
        rank: ranks.get(transition) ?? 0,
        problem: more.problem("transition", transition.id),
        mark: more.marks?.get(key),
      });
      const handle = required(grips.get(transition), "handle");
      this.places.set(key, handle);
      const moved = view.place(
        points.get(transition.origin),
        points.get(transition.destination),
        handle,
        transition.origin === transition.destination,
      );
      changed ||= rewritten || moved;
    }
    if (changed || this.#moved) this.#stale = true;
    this.#moved = false;
    this.#placeDetails();
    if (!changed) return;
    this.annotations.refit();
    this.#lookAtAnnotations();
  }

  /** The scale at which it is shown, once it is. @type {number | undefined} */
  #scale = undefined;

  /** Write the annotations. */
  #lookAtAnnotations() {
    const scale = this.#scale;
    if (scale === undefined) return;
    const states = [...this.states.values()];
    this.annotations.look(scale, (box) =>
      [...states.map((view) => view.box), ...this.#labels(scale)].filter((each) => touches(each, box)),
    );
  }

  #moved = false;

  /**
   * Show elements elsewhere while they are dragged, or without `carried` at their places again.
   *
   * @param {Map<string, Point>} moved all that are elsewhere
   * @param {{dx: number, dy: number, keys: Set<string>}} [carried] transitions that move with both their
   *   states unchanged, from their places at the beginning of the drag
   */
  preview(moved, carried) {
    this.#moved = true;
    const {dx, dy, keys} = carried ?? {dx: 0, dy: 0, keys: new Set()};
    for (const [key, point] of moved) {
      this.places.set(key, point);
      this.states.get(key)?.place(point);
      this.annotations.preview(key, point);
    }
    for (const key of moved.keys()) {
      const view = this.transitions.get(key);
      if (!view) continue;
      if (keys.has(key)) view.carry(dx, dy);
      else this.#bend(key, view);
    }
  }

  /** Draw a transition between the present places of its states, with its name. @param {string} key @param {TransitionView} view */
  #bend(key, view) {
    const {origin, destination} = view.transition;
    const before = view.offset;
    const handle = required(this.places.get(key), "handle");
    const [from, to] = [this.places.get(`s${origin}`), this.places.get(`s${destination}`)];
    if (!view.place(from, to, handle, origin === destination)) return;
    if (before) view.placeName({x: view.arc.middle.x + before.x, y: view.arc.middle.y + before.y});
  }

  /** Whether all names and badges are to be placed again. */
  #stale = false;
  #detailed = true; // whether names and badges are visible; they are placed only then

  /** Write what is read at a scale. @param {number} scale */
  look(scale) {
    this.#scale = scale;
    this.#detailed = scale >= NAMELESS;
    this.#scaleLetters();
    this.#placeDetails();
    this.#lookAtAnnotations();
  }

  #letters = nameLettersAt(1);

  /** Write names in letters that are readable now. */
  #scaleLetters() {
    const letters = nameLettersAt(this.#scale ?? 1);
    if (letters === this.#letters || !this.#detailed) return;
    this.#letters = letters;
    for (const view of this.transitions.values()) view.scaleLetters(lettersAt(this.#scale ?? 1));
    this.#stale = true;
  }

  #placeDetails() {
    if (!this.#detailed || !this.#stale) return;
    this.#stale = false;
    if ((this.#scale ?? 1) >= VERY_FAR) this.#placeNames();
    this.#fitNames();
    this.#placeBadges();
  }

  /** Write names of states in the room that others leave. */
  #fitNames() {
    const letters = this.#letters;
    const views = [...this.states.values()];
    for (const view of views) {
      const {x, y} = view.middle;
      let room = WIDEST;
      for (const other of views)
        if (other !== view && Math.abs(other.middle.y - y) < LINES * letters)
          room = Math.min(room, Math.abs(other.middle.x - x) - BETWEEN);
      if (view.letters !== letters || view.room !== room) view.scaleLetters(letters, room);
    }
  }

  /** Place names so that none covers another. */
  #placeNames() {
    const views = [...this.transitions.values()];
    const circles = this.#middles();
    const found = placeLabels(
      views.map((view) => view.asLabel()),
      circles,
      {arcs: views.map((view) => view.arc), occupied: this.annotations.occupied()},
    );
    for (const view of views) view.placeName(found.get(view)?.middle, found.get(view)?.size);
  }

  /** The positions of the states. */
  #middles() {
    return [...this.states.keys()].flatMap((key) => this.places.get(key) ?? []);
  }

  /** Place badges where no arc begins or ends. */
  #placeBadges() {
    /** @type {Map<number, {view: StateView, angles: number[]}>} */
    const states = new Map();
    for (const view of this.states.values()) states.set(view.state.id, {view, angles: []});
    for (const {arc, transition} of this.transitions.values()) {
      for (const {id, point} of [
        {id: transition.origin, point: arc.start},
        {id: transition.destination, point: arc.end},
      ]) {
        const state = states.get(id);
        if (!state || !point) continue;
        const {x, y} = state.view.middle;
        state.angles.push(Math.atan2(point.y - y, point.x - x));
      }
    }
    for (const {view, angles} of states.values()) view.placeBadges(angles);
  }

  /**
   * Mark what is selected.
   *
   * @param {Set<number>} states @param {Set<number>} transitions @param {Set<number>} annotations
   */
  select(states, transitions, annotations) {
    this.annotations.select(annotations);
    for (const view of this.states.values()) view.select(states.has(view.state.id));
    for (const view of this.transitions.values()) view.select(transitions.has(view.transition.id));
  }

  /** @type {Map<string, Live>} */
  #live = new Map();

  /** Show what a running component does. @param {Map<string, Live>} [live] by key */
  showLive(live = new Map()) {
    for (const key of new Set([...live.keys(), ...this.#live.keys()])) {
      const view = this.view(key);
      if (!view) continue;
      view.live = live.get(key);
      markView(view);
    }
    this.#live = live;
  }

  /** The box around everything that is visible at a scale. */
  bounds(scale = 1) {
    const arcs = [...this.transitions.values()].map(({arc}) => arc);
    const boxes = [...this.#labels(scale), ...this.annotations.boxes()];
    return bounds(this.#middles(), [...arcs, ...boxes.map((box) => ({box}))]);
  }

  /** Whether something can be put into a box; only the title of a frame is in its way. @param {Box} box */
  isFree(box) {
    const room = wider(box, RADIUS + 8);
    const isIn = (/** @type {Point} */ {x, y}, /** @type {Box} */ part) =>
      contains(part, {left: x, right: x, top: y, bottom: y});
    return (
      !this.#middles().some((place) => isIn(place, room)) &&
      ![...this.#labels(1), ...this.annotations.occupied()].some((other) => touches(other, box)) &&
      [...this.transitions.values()].every(
        ({arc}) => !touches(arc.box, box) || !pointsOf(arc, RADIUS / 2).some((point) => isIn(point, box)),
      )
    );
  }

  /** The boxes of the labels that are visible at a scale. @param {number} scale */
  #labels(scale) {
    if (scale < VERY_FAR) return [];
    return [...this.transitions.values()].flatMap(({nameAt, text}) => {
      const {name, detail, width, height, nameWidth} = text;
      const wide = scale >= FAR ? width : nameWidth;
      if (!nameAt || !wide) return [];
      const top = nameAt.y - height / 2;
      const bottom = nameAt.y + (scale < FAR && name && detail ? 0 : height / 2);
      return [{left: nameAt.x - wide / 2, right: nameAt.x + wide / 2, top, bottom}];
    });
  }

  #clear() {
    for (const layer of [this.#arcs, this.#names, this.#circles]) layer.replaceChildren();
    this.annotations.clear();
    this.states.clear();
    this.transitions.clear();
  }

  /**
   * Return the view of each item with its key: known views are kept, new ones created, and old ones removed.
   *
   * @template {State | Transition} Item
   * @template {StateView | TransitionView} View
   * @param {Map<string, View>} views @param {Item[]} items
   * @param {"s" | "t"} prefix of the keys
   * @param {(item: Item) => View} made
   * @returns {{view: View, item: Item, key: string}[]}
   */
  #sync(views, items, prefix, made) {
    /** @type {{view: View, item: Item, key: string}[]} */
    const found = [];
    /** @type {Set<string>} */
    const wanted = new Set();
    for (const item of items) {
      let key = `${prefix}${item.id}`;
      while (wanted.has(key)) key += "'"; // two with the same number, in an invalid document
      wanted.add(key);
      let view = views.get(key);
      if (!view) {
        view = made(item);
        if (view instanceof TransitionView) view.scaleLetters(lettersAt(this.#scale ?? 1));
        (view instanceof StateView ? this.#circles : this.#arcs).append(view.group);
        if (view.label) this.#names.append(view.label);
        views.set(key, view);
      }
      found.push({view, item, key});
    }
    if (views.size === wanted.size) return found;
    for (const [key, view] of views) {
      if (wanted.has(key)) continue;
      view.remove();
      views.delete(key);
    }
    return found;
  }
}

/** @param {State} state */
const newState = (state) => new StateView(state);
/** @param {Transition} transition */
const newTransition = (transition) => new TransitionView(transition);

/** Show what a view does. @param {View} view */
function markView(view) {
  if (view instanceof StateView) markState(view, view.live);
  else markTransition(view, view.live);
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
