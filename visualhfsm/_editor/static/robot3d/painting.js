/**
 * Parts of the robot that fail are red, and the one that is chosen has the color of the page.
 *
 * @import {RobotDrawing} from "./robot-drawing.js"
 * @import {Material, Mesh} from "three"
 */

import {Color, DoubleSide, MeshStandardMaterial} from "three";

import {aim} from "./aiming.js";

const GLOW = 0.35;

export class Painting {
  /** @param {RobotDrawing} drawing */
  constructor(drawing) {
    this.drawing = drawing;
    this.red = this.#paint("--error");
    this.chosen = this.#paint("--accent");
  }

  /** The materials of painted shapes, without paint. @type {Map<Mesh, Material | Material[]>} */
  #own = new Map();
  /** What is painted, and of which body. @type {unknown[]} */
  #shown = [];

  /** @param {string} name of a color of the page */
  #paint(name) {
    const color = new Color(getComputedStyle(this.drawing.stage).getPropertyValue(name).trim());
    return new MeshStandardMaterial({color, emissive: color, emissiveIntensity: GLOW, side: DoubleSide});
  }

  /** Paint parts that fail, and the chosen one. @param {string[]} failing @param {string} [chosen] */
  show(failing, chosen) {
    const {body} = this.drawing;
    const shown = [body, chosen, ...failing];
    if (shown.length === this.#shown.length && shown.every((each, index) => each === this.#shown[index])) return;
    this.clear();
    this.#shown = shown;
    for (const part of chosen === undefined ? failing : [chosen, ...failing])
      for (const shape of body?.shapesOf(part) ?? []) {
        if (!this.#own.has(shape)) this.#own.set(shape, shape.material);
        shape.material = failing.includes(part) ? this.red : this.chosen;
      }
    this.drawing.redraw();
  }

  /** Take all paint away. */
  clear() {
    for (const [shape, own] of this.#own) shape.material = own;
    this.#own.clear();
    this.#shown = [];
  }

  /** Those of some parts that are seen where somebody points. @param {PointerEvent} event @param {string[]} parts */
  partsAt(event, parts) {
    const {body} = this.drawing;
    const [hit] = body?.torso.visible ? aim(this.drawing, event).intersectObject(body.torso, true) : [];
    return hit ? parts.filter((part) => body?.shapesOf(part).some((shape) => shape === hit.object)) : [];
  }

  close() {
    this.clear();
    this.red.dispose();
    this.chosen.dispose();
  }
}
