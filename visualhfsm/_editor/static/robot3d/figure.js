/**
 * A robot's body with all that is seen of it.
 *
 * @import {Described} from "./robot-drawing.js"
 */

import {Body} from "./body.js";
import {Workshop} from "./shapes.js";

/** Robots that are described alike share their meshes and materials. @type {WeakMap<Described, Workshop>} */
const workshops = new WeakMap();

/**
 * A body that is not in any scene yet.
 *
 * @param {Described} described
 * @param {import("three").ColorRepresentation} [color] of the marks of contacts
 * @param {import("./body.js").Triple} [shirt] the color of its trunk, if that is not as described
 */
export function figureOf(described, color, shirt) {
  const body = new Body(described, color);
  const workshop = workshops.get(described) ?? new Workshop();
  workshops.set(described, workshop);
  workshop.take(described.meshes, described.meshUnit);
  for (const shape of described.shapes) {
    const link = body.links.get(shape.link);
    const part = workshop.make(shirt && link === body.torso ? {...shape, color: shirt, glow: 0} : shape);
    if (!part) continue;
    part.castShadow = true;
    link?.add(part);
  }
  return body;
}
