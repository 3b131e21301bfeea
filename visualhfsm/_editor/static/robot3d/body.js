/**
 * The links of the robot's body as three.js groups, nested as the links carry each other.
 *
 * @import {Object3D} from "three"
 */

import {
  Box3,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Shape,
  ShapeGeometry,
  Vector2,
  Vector3,
} from "three";

import {required} from "../kit/existence.js";

/** Metres by which the second sole must fit better for the body to stand on it instead. */
const LEVEL = 0.005;

/** Radians of tilt from the pose in which the soles are level, beyond which the body has fallen. */
const UNSTEADY = 0.35;

/** Sine of the angle from which the direction in which a torso leans is known. */
const LEANING = 0.1;

/** Metres between the floor and the origins of the links of a lying body, about. */
const THICKNESS = 0.05;

/** Radius in m of shapes that others hide, such as of a neck. */
const HIDDEN = 0.04;

/** Metres above the floor below which all of a standing sole lies. */
const TOUCHING = 0.006;

/** Scale of the mark of a contact relative to the sole, and its height in m above the lower side. */
const RIM = 1.3;
const LIFT = 0.003;

/**
 * The state of the robot from the server: angles of the joints in rad, the angle in rad between the z axis of the torso
 * and the vertical, and in a simulation the place of the torso (position in m, quaternion x, y, z, w).
 *
 * @typedef {{joints: Record<string, number>, tilt: number | null, torso: number[] | null}} BodyState
 * @typedef {[number, number, number]} Triple
 * @typedef {{name: string, parent?: string, joint?: string, axis?: Triple, origin?: Triple, turn?: number[],
 *   sliding?: boolean}} Link `origin` and `turn`, a quaternion x, y, z, w, are those of its frame in its parent's while
 *   its joint is at 0; the joint turns it about `axis` in its own frame, or moves it along that
 * @typedef {{link: string, position: Triple, tilt: number}} Eye where it sees from; radians downwards
 * @typedef {{links: Link[], soles: Record<string, Triple[]>, eye?: Eye, places?: Record<string, string[]>}} DescribedBody
 *   as visualhfsm/_monitor/realm/description.py makes it; `places` are the links on which sensors sit
 */

export class Body {
  /** @param {DescribedBody} described @param {import("three").ColorRepresentation} [color] of the marks of contacts */
  constructor({links, soles, eye, places = {}}, color = 0x2f7de1) {
    /** Each sits at its parent joint. @type {Map<string, Group>} */
    this.links = new Map();
    /** @type {{link: Group, joint: string, axis: Vector3, sliding: boolean, origin: Vector3, turn: Quaternion}[]} */
    this.joints = [];
    for (const {name, parent, joint, axis = [0, 0, 1], origin = [0, 0, 0], turn, sliding = false} of links) {
      const link = new Group();
      link.position.fromArray(origin);
      if (turn) link.quaternion.fromArray(turn);
      this.links.set(name, link);
      if (parent) this.#link(parent).add(link);
      if (!joint) continue;
      const zero = {origin: link.position.clone(), turn: link.quaternion.clone()};
      this.joints.push({link, joint, axis: new Vector3(...axis), sliding, ...zero});
    }
    this.places = places;
    this.eye = eye ?? {link: links[0].name, position: [0, 0, 0], tilt: 0};
    this.torso = this.#link(links[0].name);
    this.soles = Object.entries(soles).map(([name, outline]) => {
      const foot = this.#link(name);
      const points = outline.map((point) => new Vector3(...point));
      const mark = contactMark(points, color);
      foot.add(mark);
      return {foot, outline: points, mark};
    });
  }

  /** @param {string} name */
  #link(name) {
    return required(this.links.get(name), `link ${name}`);
  }

  /** Place the links. @param {BodyState} state */
  pose({joints, tilt, torso}) {
    for (const {link, joint, axis, sliding, origin, turn} of this.joints) {
      const at = joints[joint] ?? 0;
      if (sliding) link.position.copy(axis).multiplyScalar(at).applyQuaternion(turn).add(origin);
      else link.quaternion.setFromAxisAngle(axis, at).premultiply(turn);
    }
    if (torso) {
      this.torso.position.fromArray(torso);
      this.torso.quaternion.fromArray(torso, 3);
    } else {
      this.#stand();
      if (tilt !== null) this.#fall(tilt);
    }
    this.torso.updateMatrixWorld(true);
    for (const {foot, outline, mark} of this.soles)
      mark.visible = outline.every((point) => point.clone().applyMatrix4(foot.matrixWorld).z < TOUCHING);
  }

  /**
   * The shapes in which a part is seen: those of a link, of what a joint turns, of what a sensor sits on, and of the torso
   * for what has no known place. Of what is not seen, those that carry it.
   *
   * @param {string} part
   */
  shapesOf(part) {
    const turned = this.joints.find(({joint}) => joint === part)?.link ?? this.links.get(part);
    const sitsOn = this.places[part]?.map((name) => this.#link(name)) ?? [this.torso];
    const links = turned ? [turned] : sitsOn;
    const seen = links.flatMap(shapesIn);
    return seen.length ? seen : links.flatMap(({parent}) => (parent instanceof Group ? shapesIn(parent) : []));
  }

  /** The link that carries the first camera. */
  get head() {
    return this.#link(this.eye.link);
  }

  /** The visible parts of the head. */
  get headParts() {
    return this.head.children.filter((child) => child instanceof Mesh);
  }

  /**
   * The height in m of what is visible of it in its present pose, that of its torso above the lowest part, and whatever
   * its joints do, how far any part can get from the torso, and how far to its side; undefined when nothing is visible.
   * To the side, legs do not count.
   */
  get size() {
    const {torso} = this;
    torso.updateMatrixWorld(true);
    const {min, max} = new Box3().setFromObject(torso);
    if (max.z <= min.z) return undefined;
    const legs = torso.children.filter((child) => this.soles.some(({foot}) => child.getObjectById(foot.id)));
    return {
      height: max.z - min.z,
      middle: torso.position.z - min.z,
      reach: reachOf(torso),
      breadth: reachOf(torso, legs),
    };
  }

  /**
   * Let the body stand level on the sole whose floor the other sole penetrates least; without soles, on what is lowest.
   *
   * No encoder measures the place of the torso: x is its forward direction, and the origin lies between the feet, as if
   * the robot had been put there.
   */
  #stand() {
    const {torso} = this;
    torso.position.set(0, 0, 0);
    torso.quaternion.identity();
    torso.updateMatrixWorld(true);
    if (this.soles.length === 0) {
      const {min, max} = new Box3().setFromObject(torso);
      if (max.z > min.z) torso.position.z = -min.z;
      return;
    }
    const feet = this.soles.map(({foot, outline}) => ({
      foot,
      points: outline.map((point) => point.clone().applyMatrix4(foot.matrixWorld)),
    }));
    const between = new Vector3();
    for (const {foot} of feet) between.add(foot.getWorldPosition(new Vector3()).divideScalar(feet.length));
    let least = Infinity;
    for (const {foot, points} of feet) {
      const level = withoutYaw(foot.getWorldQuaternion(new Quaternion()).invert());
      const floor = lowest(points, level);
      const below = floor - Math.min(...feet.map((other) => lowest(other.points, level)));
      if (below >= least - LEVEL) continue;
      least = below;
      torso.quaternion.copy(level);
      torso.position.copy(between).applyQuaternion(level).negate().setZ(-floor);
    }
  }

  /**
   * Lay down a body that is tilted too far to stand, in the direction in which it leans, else forward; no link is then
   * below the floor.
   *
   * @param {number} tilt
   */
  #fall(tilt) {
    const {torso} = this;
    const up = new Vector3(0, 0, 1).applyQuaternion(torso.quaternion);
    const further = tilt - Math.acos(Math.min(1, Math.max(-1, up.z)));
    if (Math.abs(further) < UNSTEADY) return;
    const lean = Math.hypot(up.x, up.y);
    const axis = lean > LEANING ? new Vector3(-up.y / lean, up.x / lean, 0) : new Vector3(0, 1, 0);
    const over = new Quaternion().setFromAxisAngle(axis, further);
    torso.position.applyQuaternion(over);
    torso.quaternion.premultiply(over);
    torso.updateMatrixWorld(true);
    const heights = [...this.links.values()].map((link) => link.getWorldPosition(new Vector3()).z);
    torso.position.z += THICKNESS - Math.min(...heights);
  }
}

/** The shapes of a link; if they are hidden in others, with those that it carries. @param {Object3D} link @returns {Mesh[]} */
function shapesIn(link) {
  const own = /** @type {Mesh[]} */ (link.children.filter((each) => each instanceof Mesh && each.castShadow)); // marks cast none
  const isSeen = own.some(({geometry}) => {
    if (!geometry.boundingSphere) geometry.computeBoundingSphere();
    return required(geometry.boundingSphere, "sphere").radius > HIDDEN;
  });
  return isSeen ? own : [...own, ...link.children.flatMap(shapesIn)];
}

/**
 * How far the farthest corner of a link's parts, and of the links that it carries, can be from its origin; without
 * `legs`, from its z axis.
 *
 * @param {Object3D} link @param {Object3D[]} [legs]
 */
function reachOf(link, legs) {
  /** @param {Vector3} at */
  const away = (at) => (legs ? Math.hypot(at.x, at.y) : at.length());
  let farthest = 0;
  for (const child of link.children) {
    if (legs?.includes(child)) continue;
    if (child instanceof Mesh) {
      child.geometry.computeBoundingBox();
      const {min, max} = required(child.geometry.boundingBox, "box");
      for (const x of [min.x, max.x])
        for (const y of [min.y, max.y])
          for (const z of [min.z, max.z])
            farthest = Math.max(farthest, away(new Vector3(x, y, z).applyMatrix4(child.matrix)));
    } else farthest = Math.max(farthest, away(child.position) + reachOf(child));
  }
  return farthest;
}

/**
 * A mark around a sole that stands on the floor.
 *
 * @param {Vector3[]} outline
 * @param {import("three").ColorRepresentation} color
 */
function contactMark(outline, color) {
  const middle = outline.reduce((sum, point) => sum.add(point), new Vector3()).divideScalar(outline.length);
  const rim = outline.map((point) => point.clone().sub(middle).multiplyScalar(RIM));
  const material = new MeshBasicMaterial({color, transparent: true, opacity: 0.45, side: DoubleSide});
  const mark = new Mesh(new ShapeGeometry(new Shape(rim.map(({x, y}) => new Vector2(x, y)))), material);
  mark.position.copy(middle).add({x: 0, y: 0, z: LIFT});
  mark.visible = false;
  return mark;
}

/** The least height of some points that are turned. @param {Vector3[]} points @param {Quaternion} turn */
const lowest = (points, turn) => Math.min(...points.map((point) => point.clone().applyQuaternion(turn).z));

/** A rotation turned about the vertical so that its x axis looks along the world's. @param {Quaternion} rotation */
function withoutYaw(rotation) {
  const {x, y} = new Vector3(1, 0, 0).applyQuaternion(rotation);
  return new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), -Math.atan2(y, x)).multiply(rotation);
}
