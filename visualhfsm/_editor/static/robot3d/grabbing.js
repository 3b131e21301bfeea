/**
 * Carry things of a simulation with the mouse, and push its robot.
 *
 * @import {RobotDrawing} from "./robot-drawing.js"
 * @import {Group} from "three"
 * @typedef {{x: number, y: number, z: number}} Point
 * @typedef {{place: (name: string, position: Point) => Promise<unknown>,
 *   push: (force: Point, seconds: number) => Promise<unknown>, report: (message: string) => void}} Handlers
 */

import {ArrowHelper, Color, Plane, Vector3} from "three";

import {messageOf} from "../kit/notices.js";
import {t} from "../kit/texts.js";
import {aim} from "./aiming.js";
import {WorldDrawing} from "./world-drawing.js";

const UP = new Vector3(0, 0, 1);
const RESTING = 0.03; // m above the floor up to which a thing rests on it
const REACH = 6; // m from its place to which a thing or the robot is carried or pulled at most

const PER_METRE = 100; // N for each metre that is dragged
const STRONGEST = 120; // N
const WEAKEST = 3; // N
const SECONDS = 0.15;

/** Sends only the newest place, one at a time, so that a slow simulation is not flooded. */
class Carrier {
  /** @param {Handlers} handlers */
  constructor({place, report}) {
    this.place = place;
    this.report = report;
  }

  /** @type {{name: string, position: Point} | undefined} */
  #next = undefined;
  #busy = false;

  /** @param {string} name @param {Vector3} at */
  async carry(name, {x, y, z}) {
    this.#next = {name, position: {x, y, z}};
    if (this.#busy) return;
    this.#busy = true;
    while (this.#next) {
      const {name: what, position} = this.#next;
      this.#next = undefined;
      try {
        await this.place(what, position);
        this.report("");
      } catch (error) {
        this.report(messageOf(error));
      }
    }
    this.#busy = false;
  }
}

export class Grabbing {
  /** @param {RobotDrawing} drawing @param {Handlers} handlers */
  constructor(drawing, handlers) {
    this.drawing = drawing;
    this.handlers = handlers;
    this.carrier = new Carrier(handlers);
    /** Whether there is a simulation, whose things can be moved. */
    this.enabled = false;
    /** Whether the robot is pushed when it is dragged. */
    this.pushes = false;
    const {stage} = drawing;
    const listen = (/** @type {string} */ kind, /** @type {(event: any) => void} */ handler) =>
      stage.addEventListener(kind, handler, {capture: true, signal: this.#ended.signal});
    listen("pointerdown", (event) => this.#down(event));
    listen("pointermove", (event) => this.#move(event));
    listen("pointerup", (event) => this.#up(event));
    listen("pointercancel", () => this.#release());
    listen("keydown", (event) => event.key === "Escape" && this.#held && this.#release());
  }

  #ended = new AbortController();
  /**
   * What is held: a thing with the way from the point where it is held to its origin, or the robot; and the plane in
   * which that point moves.
   *
   * @type {{object?: Group, offset: Vector3, begin: Vector3, plane: Plane, arrow?: ArrowHelper} | undefined}
   */
  #held = undefined;

  /** @param {PointerEvent} event */
  #down(event) {
    const {drawing} = this;
    if (!this.enabled || event.button !== 0 || event.target !== drawing.renderer.domElement || this.#held) return;
    const ray = aim(drawing, event);
    const hit = drawing.world.hit(ray);
    if (hit) {
      const {object, point} = hit;
      const facing = drawing.viewpoints.camera.getWorldDirection(new Vector3());
      const normal = WorldDrawing.bottomOf(object) < RESTING ? UP : facing;
      const plane = new Plane().setFromNormalAndCoplanarPoint(normal, point);
      this.#held = {object, offset: object.position.clone().sub(point), begin: point, plane};
    } else if (this.pushes && drawing.body?.torso.visible) {
      const [found] = ray.intersectObject(drawing.body.torso, true);
      if (!found) return;
      const begin = found.point;
      const color = new Color(getComputedStyle(drawing.stage).getPropertyValue("--stop").trim());
      const arrow = new ArrowHelper(new Vector3(1, 0, 0), begin, 0.01, color, 0.06, 0.04);
      arrow.visible = false;
      drawing.scene.add(arrow);
      this.#held = {offset: new Vector3(), begin, plane: new Plane().setFromNormalAndCoplanarPoint(UP, begin), arrow};
    } else return;
    drawing.viewpoints.controls.enabled = false;
    drawing.stage.setPointerCapture(event.pointerId);
    drawing.stage.classList.add("holding");
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const {drawing} = this;
    const held = this.#held;
    if (!held) {
      if (this.enabled && !event.buttons)
        drawing.stage.classList.toggle("grabbable", Boolean(drawing.world.hit(aim(drawing, event))));
      return;
    }
    const at = aim(drawing, event).ray.intersectPlane(held.plane, new Vector3());
    if (!at || at.distanceTo(held.begin) > REACH) return;
    if (held.object) {
      this.carrier.carry(held.object.name, at.add(held.offset));
      return;
    }
    const force = forceOf(at.sub(held.begin));
    const length = force.length() / PER_METRE;
    if (held.arrow) {
      held.arrow.visible = length > 0;
      if (length > 0) {
        held.arrow.setDirection(force.clone().normalize());
        held.arrow.setLength(length, Math.min(0.08, length / 2), Math.min(0.05, length / 3));
      }
    }
    held.offset.copy(force);
    this.handlers.report(t("Release to push with {newtons} N; Escape cancels.", {newtons: Math.round(force.length())}));
    drawing.redraw();
  }

  /** @param {PointerEvent} event */
  async #up(event) {
    const held = this.#held;
    if (!held) return;
    event.stopPropagation();
    this.#release();
    const {x, y, z} = held.offset;
    if (held.object || held.offset.length() < WEAKEST) return;
    try {
      await this.handlers.push({x, y, z}, SECONDS);
    } catch (error) {
      this.handlers.report(messageOf(error));
    }
  }

  #release() {
    const {drawing} = this;
    const held = this.#held;
    this.#held = undefined;
    if (held?.arrow) {
      drawing.scene.remove(held.arrow);
      held.arrow.dispose();
    }
    if (!held?.object) this.handlers.report("");
    drawing.viewpoints.controls.enabled = drawing.viewpoints.view !== "head";
    drawing.stage.classList.remove("holding");
    drawing.redraw();
  }

  close() {
    this.#ended.abort();
  }
}

/** The force of a drag in N, limited to the strongest push. @param {Vector3} drag in m */
function forceOf(drag) {
  return drag.clone().setZ(0).multiplyScalar(PER_METRE).clampLength(0, STRONGEST);
}
