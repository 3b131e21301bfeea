/**
 * Places by a click: the selected state gets the place in the world that somebody points at as its arguments, and a mark
 * shows where they lead from where the robot is.
 *
 * @import {Automaton, State} from "../data/protocol.js"
 * @import {Body} from "./body.js"
 * @import {RobotDrawing} from "./robot-drawing.js"
 * @typedef {{at: Vector3, heading: number, eye: Vector3}} Stand where the robot stands on the floor, and its first camera
 * @typedef {{inputs: string[], numbers: (to: Vector3, from: Stand) => number[],
 *   place: (numbers: number[], from: Stand) => Vector3}} Meaning how inputs are a place, and which one
 * @typedef {{at: number, from?: Stand}} Entry
 * @typedef {{meaning: Meaning, automaton: Automaton, state: State, child: number, several: boolean}} Aim
 */

import {Color, Group, Mesh, MeshBasicMaterial, Plane, RingGeometry, SphereGeometry, Vector3} from "three";

import {apply} from "../data/commands.js";
import {page} from "../data/page.js";
import {monitor} from "../run/monitor.js";
import {aim as rayOf, onClick} from "./aiming.js";
import {dispose} from "./shapes.js";

const UP = new Vector3(0, 0, 1);
const FLOOR = new Plane(UP, 0);
const DEGREES = 180 / Math.PI;
const FARTHEST = 20; // m from the robot
const AHEAD = 1; // m from the robot where a direction is marked
const NEAR = 1.5; // m from which the mark is as large as it is
const LIFT = 0.006; // m above the floor
const NUMBER = /^\s*[-+]?(\d+\.?\d*|\.\d+)\s*$/;

/** @param {number} value @param {number} digits */
const rounded = (value, digits) => Number(value.toFixed(digits)) + 0;

/** How far to the left a place is of where the robot looks, in radians. @param {Vector3} to @param {Stand} from */
function bearing(to, {at, heading}) {
  const angle = Math.atan2(to.y - at.y, to.x - at.x) - heading;
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

/** @param {number} degrees to the left @param {number} distance in m @param {Stand} from */
const inDirection = (degrees, distance, {at, heading}) =>
  new Vector3(distance, 0, 0).applyAxisAngle(UP, heading + degrees / DEGREES).add(at);

/** The first that a state has the inputs of is meant. @type {Meaning[]} */
const MEANINGS = [
  {
    inputs: ["forward", "left"],
    numbers: (to, {at, heading}) => {
      const {x, y} = to.clone().sub(at).applyAxisAngle(UP, -heading);
      return [rounded(x, 2), rounded(y, 2)];
    },
    place: ([forward, left], {at, heading}) => new Vector3(forward, left, 0).applyAxisAngle(UP, heading).add(at),
  },
  {inputs: ["x", "y"], numbers: ({x, y}) => [rounded(x, 2), rounded(y, 2)], place: ([x, y]) => new Vector3(x, y, 0)},
  {
    inputs: ["left", "up"],
    numbers: (to, from) => {
      const {x, y, z} = to.clone().sub(from.eye);
      const eyed = {...from, at: from.eye};
      return [rounded(bearing(to, eyed) * DEGREES, 0), rounded(Math.atan2(z, Math.hypot(x, y)) * DEGREES, 0)];
    },
    place: ([left, up], from) => {
      const slope = Math.tan(up / DEGREES);
      const toFloor = slope < 0 ? -from.eye.z / slope : Infinity;
      const distance = Math.min(AHEAD, toFloor);
      return inDirection(left, distance, {...from, at: from.eye}).setZ(from.eye.z + slope * distance);
    },
  },
  {
    inputs: ["left"],
    numbers: (to, from) => [rounded(bearing(to, from) * DEGREES, 0)],
    place: ([left], from) => inDirection(left, AHEAD, from),
  },
];

/** The selected state, if some of its inputs are a place. @returns {Aim | undefined} */
function aim() {
  const {document, automaton, state} = page;
  if (!document || !automaton || !state || automaton.imported) return undefined;
  for (const meaning of MEANINGS)
    for (const child of state.children) {
      const has = (/** @type {number} */ id, /** @type {string} */ name) =>
        document.automata.get(id)?.inputs.some((input) => input.name === name);
      if (!meaning.inputs.every((name) => has(child, name))) continue;
      const several = state.children.some((id) => id !== child && meaning.inputs.some((name) => has(id, name)));
      return {meaning, automaton, state, child, several};
    }
  return undefined;
}

/** The argument of a state for an input, and the value that this is otherwise. @param {Aim} aimed @param {string} name */
function handed({state, child}, name) {
  const input = page.shownDocument.automata.get(child)?.inputs.find((each) => each.name === name);
  const found = state.arguments.find((each) => each.name === name && [child, 0].includes(each.child));
  return {found, text: found?.value ?? input?.default ?? ""};
}

/** Where a robot stands that is drawn. @param {Body} body @returns {Stand} */
function standOf({torso, head, eye}) {
  const ahead = new Vector3(1, 0, 0).applyQuaternion(torso.quaternion);
  return {
    at: torso.position.clone().setZ(0),
    heading: Math.atan2(ahead.y, ahead.x),
    eye: head.localToWorld(new Vector3(...eye.position)),
  };
}

export class Pointing {
  /** @param {RobotDrawing} drawing */
  constructor(drawing) {
    this.drawing = drawing;
    /** Whether the present robot is shown, in a document that may be changed. */
    this.enabled = false;
    const color = new Color(getComputedStyle(drawing.stage).getPropertyValue("--accent").trim());
    const material = new MeshBasicMaterial({color, transparent: true, opacity: 0.85});
    this.mark = new Group().add(
      new Mesh(new RingGeometry(0.055, 0.075, 40), material),
      new Mesh(new SphereGeometry(0.018, 16, 12), material),
    );
    this.mark.visible = false;
    drawing.scene.add(this.mark);
    onClick(drawing, this.#ended.signal, (event) => this.#take(event));
    monitor.addEventListener("snapshot", () => this.#follow(), {signal: this.#ended.signal});
  }

  #ended = new AbortController();
  /** When each state was entered last, and from where its numbers count then. @type {Map<string, Entry>} */
  #entries = new Map();

  /** The selected state, if it can get a place now. */
  get aimed() {
    return this.enabled && this.drawing.body?.torso.visible ? aim() : undefined;
  }

  /** Show where the arguments of the selected state lead, if they are numbers. */
  show() {
    const {body} = this.drawing;
    const {aimed} = this;
    const texts = aimed?.meaning.inputs.map((name) => handed(aimed, name).text) ?? [];
    const known = Boolean(aimed) && texts.every((text) => NUMBER.test(text));
    if (aimed && known && body) {
      this.mark.position.copy(aimed.meaning.place(texts.map(Number), this.#startOf(aimed, body)));
      this.mark.position.z = Math.max(LIFT, this.mark.position.z);
      const far = this.drawing.viewpoints.camera.position.distanceTo(this.mark.position);
      this.mark.scale.setScalar(Math.max(1, far / NEAR)); // seen from afar, too
    }
    this.drawing.stage.classList.toggle("pointable", Boolean(aimed));
    if (!known && !this.mark.visible) return;
    this.mark.visible = known;
    this.drawing.redraw();
  }

  /** Remember where the robot stands when the run enters a state. */
  #follow() {
    const {body} = this.drawing;
    const {automata = [], startedAt = 0} = monitor.newest?.component ?? {};
    for (const {id, state, ghost, enteredAt} of automata) {
      const [key, at] = [`${id}/${state}`, startedAt + enteredAt];
      if (body && !ghost && this.#entries.get(key)?.at !== at) this.#entries.set(key, {at, from: standOf(body)});
    }
  }

  /** From where the numbers of a state count: where the run entered it, or the robot is. @param {Aim} aimed @param {Body} body */
  #startOf({automaton, state}, body) {
    const ran = monitor.tab === page.tab && !monitor.ended;
    return (ran && this.#entries.get(`${automaton.id}/${state.id}`)?.from) || standOf(body);
  }

  /** @param {PointerEvent} event */
  #take(event) {
    const {body} = this.drawing;
    const {aimed} = this;
    if (!aimed || !body) return;
    const from = standOf(body);
    const to = this.#pointedAt(event, body);
    if (!to || to.distanceTo(from.at) > FARTHEST) return;
    const {meaning, automaton, state, child, several} = aimed;
    const numbers = meaning.numbers(to, from);
    const entry = this.#entries.get(`${automaton.id}/${state.id}`);
    if (entry) entry.from = undefined; // they count when it is entered again
    const [first] = meaning.inputs;
    apply("setArguments", {
      automaton: automaton.id,
      state: state.id,
      child: handed(aimed, first).found?.child ?? (several ? child : 0),
      values: Object.fromEntries(meaning.inputs.map((name, index) => [name, decimal(numbers[index])])),
    });
  }

  /** The place on the floor, or the thing, at which somebody points. @param {PointerEvent} event @param {Body} body */
  #pointedAt(event, body) {
    const ray = rayOf(this.drawing, event);
    if (ray.intersectObject(body.torso, true).length) return undefined;
    return this.drawing.world.hit(ray)?.object.position ?? ray.ray.intersectPlane(FLOOR, new Vector3()) ?? undefined;
  }

  close() {
    this.#ended.abort();
    this.drawing.scene.remove(this.mark);
    dispose([this.mark]);
  }
}

/** A number as Python's float. @param {number} value */
const decimal = (value) => (Number.isInteger(value) ? `${value}.0` : String(value));
