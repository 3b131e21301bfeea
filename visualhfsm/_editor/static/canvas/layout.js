/**
 * Automatic layout with dagre: ranks from the initial state on, as few crossings as it finds.
 *
 * @import {Automaton, Transition} from "../data/protocol.js"
 * @import {Area} from "./annotation-layout.js"
 * @import {Point} from "../measures/geometry.js"
 * @typedef {[id: number, x: number, y: number]} Placed a state or a handle
 */

import * as dagre from "dagre";

import {apply} from "../data/commands.js";
import {notify} from "../kit/notices.js";
import {required} from "../kit/existence.js";
import {n, t} from "../kit/texts.js";
import {addAnnotations} from "./annotation-layout.js";
import {bounds, LOOP, RADIUS} from "../measures/geometry.js";
import {width} from "../measures/text.js";

const BETWEEN_STATES = 70;
const BETWEEN_RANKS = 110;
const LABEL_HEIGHT = 44;
const WIDEST_LABEL = 150;
const BEGIN = 120; // position of the first state, from the top left
const GRID = 10;
/** Possible directions of loops, upwards first. */
const LOOP_ANGLES = [-90, 90, -60, -120, 60, 120, -30, -150, 30, 150, 0, 180].map(
  (degrees) => (degrees * Math.PI) / 180,
);

/** @param {number} value */
const rounded = (value) => Math.round(value / GRID) * GRID;

/**
 * Choose positions for the states and handles of an automaton.
 *
 * @param {Automaton} automaton
 * @param {"LR" | "TB"} rankdir whether transitions lead on from left to right, or from top to bottom
 * @returns {{automaton: number, states: Placed[], transitions: Placed[], annotations: Area[]}}
 */
function placement(automaton, rankdir) {
  const graph = new dagre.graphlib.Graph({multigraph: true, compound: true});
  graph.setGraph({
    rankdir,
    nodesep: BETWEEN_STATES,
    ranksep: BETWEEN_RANKS,
    edgesep: 46,
    marginx: BEGIN - RADIUS,
    marginy: BEGIN - RADIUS,
  });
  graph.setDefaultEdgeLabel(() => ({}));
  const ordered = [...automaton.states].sort((a, b) => Number(b.initial) - Number(a.initial));
  for (const {id} of ordered) graph.setNode(String(id), {width: RADIUS * 2 + 16, height: RADIUS * 2 + 16});
  const arcs = automaton.transitions.filter(
    ({origin, destination}) => graph.hasNode(String(origin)) && graph.hasNode(String(destination)),
  );
  const between = arcs.filter(({origin, destination}) => origin !== destination);
  for (const {id, origin, destination, name} of between) {
    const wide = Math.min(WIDEST_LABEL, width(name, 12) + 20);
    graph.setEdge(String(origin), String(destination), {width: wide, height: LABEL_HEIGHT, labelpos: "c"}, String(id));
  }
  const areas = addAnnotations(graph, automaton);
  dagre.layout(graph);
  /** @type {Placed[]} */
  const states = automaton.states.map(({id}) => {
    const {x, y} = graph.node(String(id));
    return [id, rounded(x), rounded(y)];
  });
  /** @type {Placed[]} */
  const handles = between.map(({id, origin, destination}) => {
    const {x, y} = graph.edge(String(origin), String(destination), String(id));
    return [id, rounded(x), rounded(y)];
  });
  return {
    automaton: automaton.id,
    states,
    transitions: [...handles, ...loopHandles(arcs, states, handles)],
    annotations: areas(),
  };
}

/**
 * Handles of transitions from a state to itself: each where the arcs of its state leave most room.
 *
 * @param {Transition[]} arcs @param {Placed[]} states @param {Placed[]} handles
 */
function loopHandles(arcs, states, handles) {
  const places = new Map(states.map(([id, x, y]) => [id, {x, y}]));
  const knobs = new Map(handles.map(([id, x, y]) => [id, {x, y}]));
  const taken = /** @type {Map<number, number[]>} */ (new Map(states.map(([id]) => [id, []])));
  for (const {id, origin, destination} of arcs) {
    if (origin === destination) continue;
    const knob = required(knobs.get(id), "handle");
    for (const state of [origin, destination])
      taken.get(state)?.push(direction(required(places.get(state), "state"), knob));
  }
  return arcs
    .filter(({origin, destination}) => origin === destination)
    .map(({id, origin}) => {
      const {x, y} = required(places.get(origin), "state");
      const angles = required(taken.get(origin), "state");
      /** @param {number} angle */
      const room = (angle) =>
        Math.min(
          Math.PI,
          ...angles.map((other) => Math.abs(Math.atan2(Math.sin(angle - other), Math.cos(angle - other)))),
        );
      const best = LOOP_ANGLES.reduce((a, b) => (room(b) > room(a) + 0.01 ? b : a));
      angles.push(best);
      return /** @type {Placed} */ ([id, Math.round(x + LOOP * Math.cos(best)), Math.round(y + LOOP * Math.sin(best))]);
    });
}

/** @param {Point} from @param {Point} to */
const direction = (from, to) => Math.atan2(to.y - from.y, to.x - from.x);

/**
 * Place an automaton so that the window shows it largest, if both ways are equal from left to right.
 *
 * @param {Automaton} automaton @param {import("./viewport.js").Viewport} viewport
 */
function fittingPlacement(automaton, viewport) {
  const [across, down] = [placement(automaton, "LR"), placement(automaton, "TB")];
  const [scale, other] = [across, down].map(({states, transitions, annotations}) => {
    const points = [...states, ...transitions].map(([, x, y]) => ({x, y}));
    const boxes = annotations.map(([, x, y, wide, high]) => ({
      box: {left: x, top: y, right: x + wide, bottom: y + high},
    }));
    return viewport.scaleFor(bounds(points, boxes));
  });
  return other > scale ? down : across;
}

/** Arrange automata, as one step. @param {Automaton[]} automata @param {import("./canvas.js").HfsmCanvas} canvas */
export async function arrange(automata, canvas) {
  const own = automata.filter(({imported, states}) => !imported && states.length);
  if (!own.length) return;
  const done = await apply("placeItems", {
    placements: own.map((each) => fittingPlacement(each, canvas.viewport)),
    name: own.length === 1 ? t("Arrange") : t("Arrange all automata"),
  });
  if (done === undefined) return;
  canvas.forgetViews();
  canvas.fit();
  if (own.length > 1) notify(n("Arranged an automaton.", "Arranged {count} automata.", own.length));
}
