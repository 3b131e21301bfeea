/**
 * The drawing of one automaton, in step with the document.
 *
 * A view exists as long as its state or transition, and only differences are drawn, so that a command in a document of
 * hundreds of states is drawn at once. Which views are on the page is up to the stage.
 */

import {outgoing} from "../data/outline.js";
import {required} from "../kit/existence.js";
import {AnnotationLayer} from "./annotation-view.js";
import {bounds, boxOf, contains, handles, pointsOf, RADIUS, wider} from "../measures/geometry.js";
import {placeLabels, roomOf} from "./labels.js";
import {markState, markTransition} from "./live-marks.js";
import {touches} from "./plane.js";
import {Stage} from "./stage.js";
import {StateView} from "./state-view.js";
import {TransitionView} from "./transition-view.js";
import {FAR, lettersAt, NAMELESS, nameLettersAt, VERY_FAR} from "./viewport.js";

const LARGE = 1000; // states and transitions; of larger automata only what is seen is on the page
const AROUND = 400; // pixels around an arc within which states may be in the way of its name
const BESIDE_ARC = 200; // pixels around an arc within which its name may be
const WIDEST = 8 * RADIUS; // name of a state
const BETWEEN = 12; // pixels between two names of states
const LINES = 2.4; // times the size of letters: the height of a name
const MARKED = 200; // views with marks that are drawn one by one in any case

/**
 * @import {Automaton, Problem, State, Transition} from "../data/protocol.js"
 * @import {AnnotationView} from "./annotation-view.js"
 * @import {View} from "./merged-elements.js"
 * @import {Box, Point} from "../measures/geometry.js"
 * @import {Live} from "./live-marks.js"
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

  /** @param {{whole?: boolean}} [options] whether all of it is on the page, however large it is */
  constructor({whole = false} = {}) {
    this.whole = whole;
  }

  #stage = new Stage((views) => this.#drawn(views));
  #count = 0; // of all views that there were

  /** All layers, from the lowest to the highest. */
  get layers() {
    return [this.annotations.group, ...this.#stage.layers];
  }

  /** What is drawn of a key such as `s1`, `t2` or `a3`. @param {string} key @returns {View | AnnotationView | undefined} */
  find(key) {
    return this.annotations.views.get(key) ?? this.view(key);
  }

  /** The view of a state or a transition. @param {string} key @returns {View | undefined} */
  view(key) {
    return key.startsWith("s") ? this.states.get(key) : this.transitions.get(key);
  }

  /**
   * Keep elements on the page, in place of those that were held for the same reason; returns the first of them.
   *
   * @param {string} reason @param {...string} keys
   * @returns {SVGElement | undefined}
   */
  hold(reason, ...keys) {
    const views = keys.flatMap((key) => this.view(key) ?? []);
    this.#stage.hold(reason, views);
    return this.find(keys[0] ?? "")?.group;
  }

  /** The key of what is at a point, where it is not on the page by itself. @param {Point} point */
  keyAt(point) {
    return this.#stage.at(point)?.key;
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
    this.#stage.cull(!this.whole && states.length + transitions.length > LARGE, this.#views());
    this.places.clear();
    let changed = other;
    /** @param {View} view @param {boolean} rewritten @param {boolean} moved */
    const put = (view, rewritten, moved) => {
      if (moved) this.#stage.put(view);
      else if (rewritten) this.#stage.change(view);
      return rewritten || moved;
    };
    /** @type {Map<number, Point>} */
    const points = new Map();
    /** @type {Map<number, string>} */
    const names = new Map();
    for (const {view, item: state, key} of this.#sync(this.states, states, "s", newState)) {
      const rewritten = view.update(state, {
        problem: more.problem("state", state.id),
        imported: more.imported(state),
        mark: more.marks?.get(key),
      });
      const moved = view.place(state);
      put(view, rewritten, moved);
      changed ||= moved;
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
      changed = put(view, rewritten, moved) || changed;
    }
    this.#stage.settle(this.#views());
    if (changed || this.#moved) this.#stale = true;
    this.#moved = false;
    this.#stage.draw();
    this.#placeDetails();
    if (!changed) return;
    this.annotations.refit();
    this.#lookAtAnnotations();
  }

  /** What was last seen. @type {{seen: Box, scale: number} | undefined} */
  #last = undefined;

  /** Write the annotations that are seen. */
  #lookAtAnnotations() {
    if (!this.#last) return;
    const {seen, scale} = this.#last;
    this.annotations.look(seen, scale, (box) => this.#inTheWay(box, scale));
  }

  /** What titles of frames must not cover in a part of the drawing. @param {Box} box @param {number} scale */
  #inTheWay(box, scale) {
    const near = [...this.#stage.within(wider(box, BESIDE_ARC))];
    const states = near.filter((view) => view instanceof StateView);
    return [
      ...states.map((view) => view.box),
      ...this.#labels(
        scale,
        near.filter((view) => view instanceof TransitionView),
      ),
    ].filter((each) => touches(each, box));
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
    const views = [...moved.keys()].flatMap((key) => this.view(key) ?? []);
    if (carried && this.#stage.isLarge && !this.#stage.isLifted) {
      const whole = new Set([...keys].map((key) => this.transitions.get(key)));
      const isCarried = (/** @type {View} */ view) => view instanceof StateView || whole.has(view);
      this.#stage.lift(
        views.filter(isCarried),
        views.filter((view) => !isCarried(view)),
      );
    }
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
    if (carried) this.#stage.shift(dx, dy, views);
    else this.#stage.settle(views);
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
  /** Views that were drawn since names and badges were placed. @type {View[]} */
  #fresh = [];
  #detailed = true; // whether names and badges are visible; they are placed only then

  /** Draw a part of the drawing. @param {Box} seen @param {number} scale */
  look(seen, scale) {
    this.#last = {seen, scale};
    this.#detailed = scale >= this.nameless;
    if (!this.#stage.isLarge) this.#scaleLetters();
    this.#stage.look(seen, scale);
    this.#placeDetails();
    this.#lookAtAnnotations();
  }

  /** The view rests. */
  rest() {
    this.#scaleLetters();
    this.#stage.rest();
    this.#placeDetails();
  }

  #letters = nameLettersAt(1);

  get #scale() {
    return this.#last?.scale ?? 1;
  }

  /** The scale below which nothing has a name. */
  get nameless() {
    return this.#stage.isLarge ? VERY_FAR : NAMELESS;
  }

  /** Write names in letters that are readable now. */
  #scaleLetters() {
    const letters = nameLettersAt(this.#scale);
    if (letters === this.#letters || !this.#detailed) return;
    this.#letters = letters;
    for (const view of this.transitions.values()) view.scaleLetters(lettersAt(this.#scale));
    this.#stale = true;
  }

  /** Views have come onto the page. @param {View[]} views */
  #drawn(views) {
    for (const view of views) if (view.live) markView(view);
    this.#fresh.push(...views);
    this.#placeDetails();
  }

  #placeDetails() {
    if (!this.#detailed) return;
    const fresh = this.#stale ? undefined : this.#fresh.filter(({group}) => group);
    this.#stale = false;
    this.#fresh = [];
    if (fresh?.length === 0) return;
    if (this.#scale >= VERY_FAR) this.#placeNames(fresh);
    this.#fitNames(fresh);
    this.#placeBadges(fresh);
  }

  /** Write names of states in the room that others leave: all that are drawn, or some. @param {View[]} [fresh] */
  #fitNames(fresh = [...this.#stage.drawn]) {
    const letters = this.#letters;
    for (const view of fresh) {
      if (!(view instanceof StateView)) continue;
      const {x, y} = view.middle;
      const high = LINES * letters;
      let room = WIDEST;
      for (const other of this.#stage.within(wider(boxOf([view.middle]), WIDEST, high)))
        if (other instanceof StateView && other !== view && Math.abs(other.middle.y - y) < high)
          room = Math.min(room, Math.abs(other.middle.x - x) - BETWEEN);
      if (view.letters !== letters || view.room !== room) view.scaleLetters(letters, room);
    }
  }

  /** Place names so that none covers another: all that are drawn, or some beside the others. @param {View[]} [fresh] */
  #placeNames(fresh = [...this.#stage.drawn]) {
    const views = fresh.filter((view) => view instanceof TransitionView).sort(inOrder);
    if (!views.length) return;
    const {circles, others} = this.#around(views);
    const found = placeLabels(
      views.map((view) => view.asLabel()),
      circles,
      {
        arcs: views.map((view) => view.arc),
        placed: others.map(({arc, nameAt, text}) => ({handle: arc.middle, middle: nameAt, size: text})),
        room: roomOf(this.#circles()),
        occupied: this.annotations.occupied(),
      },
    );
    for (const view of views) view.placeName(found.get(view)?.middle, found.get(view)?.size);
  }

  /** What may be in the way of names. @param {TransitionView[]} views */
  #around(views) {
    if (!this.#stage.isLarge) return {circles: this.#circles(), others: []};
    const placed = new Set(views);
    const box = required(
      bounds(
        [],
        views.map(({arc}) => arc),
      ),
      "arc",
    );
    const near = [...this.#stage.within(wider(box, AROUND))];
    return {
      circles: near.flatMap((view) => (view instanceof StateView ? view.middle : [])),
      others: near.flatMap((view) => (view instanceof TransitionView && !placed.has(view) ? view : [])),
    };
  }

  /** The positions of the states. */
  #circles() {
    return [...this.states.keys()].flatMap((key) => this.places.get(key) ?? []);
  }

  /** Place badges where no arc begins or ends. @param {View[]} views by default all that are drawn */
  #placeBadges(views = [...this.#stage.drawn]) {
    /** @type {Map<number, {view: StateView, angles: number[]}>} */
    const states = new Map();
    for (const view of views) if (view instanceof StateView) states.set(view.state.id, {view, angles: []});
    if (!states.size) return;
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
    for (const view of this.states.values()) if (view.select(states.has(view.state.id))) this.#stage.change(view);
    for (const view of this.transitions.values())
      if (view.select(transitions.has(view.transition.id))) this.#stage.change(view);
    this.#stage.draw();
  }

  /** @type {Map<string, Live>} */
  #live = new Map();

  /** Show what a running component does. @param {Map<string, Live>} [live] by key */
  showLive(live = new Map()) {
    for (const key of new Set([...live.keys(), ...this.#live.keys()])) {
      const view = this.view(key);
      if (!view) continue;
      view.live = live.get(key);
      if (view.group) markView(view);
      this.#stage.change(view);
    }
    this.#live = live;
    this.hold("live", ...(live.size <= MARKED ? live.keys() : []));
    this.#stage.draw();
  }

  /** The box around everything that is visible at a scale. */
  bounds(scale = 1) {
    const arcs = [...this.transitions.values()].map(({arc}) => arc);
    const boxes = [...this.#labels(scale), ...this.annotations.boxes()];
    return bounds(this.#circles(), [...arcs, ...boxes.map((box) => ({box}))]);
  }

  /** Whether something can be put into a box; only the title of a frame is in its way. @param {Box} box */
  isFree(box) {
    const room = wider(box, RADIUS + 8);
    const isIn = (/** @type {Point} */ {x, y}, /** @type {Box} */ part) =>
      contains(part, {left: x, right: x, top: y, bottom: y});
    return (
      !this.#circles().some((place) => isIn(place, room)) &&
      ![...this.#labels(1), ...this.annotations.occupied()].some((other) => touches(other, box)) &&
      [...this.transitions.values()].every(
        ({arc}) => !touches(arc.box, box) || !pointsOf(arc, RADIUS / 2).some((point) => isIn(point, box)),
      )
    );
  }

  /** The boxes of the labels that are visible at a scale. @param {number} scale @param {Iterable<TransitionView>} views */
  #labels(scale, views = this.transitions.values()) {
    if (scale < VERY_FAR) return [];
    return [...views].flatMap(({nameAt, text}) => {
      const {name, detail, width, height, nameWidth} = text;
      const wide = scale >= FAR ? width : nameWidth;
      if (!nameAt || !wide) return [];
      const top = nameAt.y - height / 2;
      const bottom = nameAt.y + (scale < FAR && name && detail ? 0 : height / 2);
      return [{left: nameAt.x - wide / 2, right: nameAt.x + wide / 2, top, bottom}];
    });
  }

  #views() {
    return [...this.states.values(), ...this.transitions.values()];
  }

  #clear() {
    this.#stage.clear();
    this.annotations.clear();
    this.states.clear();
    this.transitions.clear();
    this.#fresh = [];
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
        Object.assign(view, {key, order: this.#count++});
        if (view instanceof TransitionView) view.scaleLetters(lettersAt(this.#scale));
        views.set(key, view);
      }
      found.push({view, item, key});
    }
    if (views.size === wanted.size) return found;
    for (const [key, view] of views) {
      if (wanted.has(key)) continue;
      this.#stage.remove(view);
      views.delete(key);
    }
    return found;
  }
}

/** @param {State} state */
const newState = (state) => new StateView(state);
/** @param {Transition} transition */
const newTransition = (transition) => new TransitionView(transition);

/** @param {View} one @param {View} other */
const inOrder = (one, other) => one.order - other.order;

/** Show what a drawn view does. @param {View} view */
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
