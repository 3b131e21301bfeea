/**
 * The viewpoints from which the robot is shown.
 *
 * @import {Body} from "./body.js"
 * @import {Object3D} from "three"
 * @typedef {"home" | "around" | "top" | "follow" | "head"} View
 */

import {Matrix4, MOUSE, OrbitControls, PerspectiveCamera, Quaternion, Vector3} from "three";

const ANGLE = 40; // degrees from the lower edge to the upper
/** As the cameras of the head have it. */
const HEAD_ANGLE = 44;
/** The rotation of a three.js camera that looks along x, with z up. */
const AHEAD = new Quaternion().setFromRotationMatrix(
  new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(0, 0, 1), new Vector3(-1, 0, 0)),
);

/** Directions relative to where the robot looks: its face; its left, half behind it; and above. */
const FROM = {home: new Vector3(1, 0.6, 0.3), around: new Vector3(-0.55, 1, 0.5), top: new Vector3(-0.001, 0, 1)};

/** The place behind the robot, and the point in front of it to look at, relative to its height. */
const BEHIND = new Vector3(-2.16, 0, 1.47);
const BEFORE = new Vector3(0.6, 0, 0.43);
const SWING = 0.2; // part of the remaining way at each moment

const FAR = 2; // m from the robot beyond which things are not framed
const HEIGHT = 0.58; // m, that of a robot of which none is known
const MIDDLE = 0.57; // height of its torso, relative to its own
const REACH = 0.75; // from its torso, relative to its height
const BREADTH = 0.7; // the same to its side
const RADIUS = 0.9; // around its middle in which the robot is, with a margin, relative to its height
const MARGIN = 0.12; // m around the middle of a thing
const TURN = 24_000; // ms in which the view goes around the robot once, at first sight
const CLOSE = 0.6; // part of the way to what is looked at, within which a thing would cover it
/** Metres that a robot may sway before the view follows it. */
const NEAR = 0.05;

const UP = new Vector3(0, 0, 1);
const LEFT = new Vector3(0, 1, 0);

export class Viewpoints {
  /** @param {HTMLElement} element that is dragged on @param {() => void} changed */
  constructor(element, changed) {
    this.camera = new PerspectiveCamera(ANGLE, 1, 0.02, 60);
    this.camera.up.copy(UP);
    this.camera.position.set(1.05, 0.75, 0.62);
    this.controls = new OrbitControls(this.camera, element);
    element.style.cursor = ""; // the style sheet chooses it
    this.controls.target.set(0.05, 0, 0.27);
    this.controls.maxDistance = 20;
    this.controls.maxPolarAngle = Math.PI / 2 + 0.2;
    this.controls.mouseButtons = {LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.PAN};
    this.controls.listenToKeyEvents(element);
    this.controls.update();
    this.controls.addEventListener("change", changed);
    this.controls.addEventListener("start", () => (this.view = undefined));
    for (const kind of ["pointerdown", "keydown"])
      // what the controls do not begin to turn by, too
      element.addEventListener(kind, () => this.rest(), {capture: true});
    /** The chosen view; undefined once the user has turned it. @type {View | undefined} */
    this.view = "home";
    /** The place of the robot when the view last followed it. */
    this.at = new Vector3();
    this.#changed = changed;
  }

  #changed;
  #framed = -1; // things that were framed
  #height = HEIGHT;
  #middle = MIDDLE * HEIGHT;
  #reach = REACH * HEIGHT;
  #breadth = BREADTH * HEIGHT;
  #heading = 0;
  /** When it began to go around the robot in ms; undefined before, and 0 afterwards. @type {number | undefined} */
  #begun = undefined;
  #turned = 0; // radians that it has gone around

  /** Show a robot of another size. @param {Body["size"]} [size] */
  fit(size) {
    if (size && size.height !== this.#height) this.view ??= "home"; // the distance of the user was for another one
    this.#height = size?.height ?? HEIGHT;
    this.#middle = size?.middle ?? MIDDLE * HEIGHT;
    this.#reach = size?.reach ?? REACH * HEIGHT;
    this.#breadth = size?.breadth ?? BREADTH * HEIGHT;
    this.#framed = -1;
  }

  /** Whether it goes around the robot, once, as long as nobody has touched anything. */
  get turning() {
    return Boolean(this.#begun) && this.view === "home";
  }

  /** Go around the robot, unless the user has chosen a view, or wants no motion. @param {number} now in ms */
  turn(now) {
    if (this.#begun === undefined && this.view === "home" && wantsMotion()) this.#begun = now;
    if (!this.#begun || this.view !== "home") return;
    const part = Math.min(1, (now - this.#begun) / TURN);
    this.#turned = Math.PI * (1 - Math.cos(Math.PI * part)); // begins and ends slowly
    if (part === 1) this.rest();
    this.#framed = -1;
    this.#frame(undefined, FROM.home);
  }

  /** Stay where it is: somebody has touched it. */
  rest() {
    this.#begun = 0;
  }

  /** Whether a thing would cover what is looked at. @param {Vector3} position */
  isBlockedBy(position) {
    const {camera, controls, view} = this;
    return view !== "head" && camera.position.distanceTo(position) < CLOSE * controls.getDistance();
  }

  /** @param {View} view @param {Body | undefined} body @param {Object3D[]} things */
  choose(view, body, things) {
    this.view = view;
    this.rest();
    this.#turned = 0;
    this.#framed = -1;
    this.camera.fov = view === "head" ? HEAD_ANGLE : ANGLE;
    this.camera.updateProjectionMatrix();
    this.controls.enabled = view !== "head";
    if (body) {
      for (const each of body.headParts) each.visible = view !== "head";
      this.keep(body, things, 1);
    }
    this.#changed();
  }

  /**
   * Keep to the chosen view as the robot and the things around it move.
   *
   * @param {Body} body
   * @param {Object3D[]} things
   */
  keep(body, things, swing = SWING) {
    const {torso} = body;
    if (!torso.visible) return;
    const ahead = new Vector3(1, 0, 0).applyQuaternion(torso.quaternion);
    if (Math.hypot(ahead.x, ahead.y) > 0.3) this.#heading = Math.atan2(ahead.y, ahead.x);
    const moved = new Vector3(torso.position.x, torso.position.y, 0).sub(this.at);
    const far = moved.length() - (swing < 1 ? NEAR : 0);
    const follows = far > 0;
    if (follows) this.at.add(moved.setLength(far));
    if (this.view === "head") this.#lookAhead(body);
    else if (this.view === "follow") this.#trail(torso, swing);
    else {
      if (follows) {
        this.camera.position.add(moved);
        this.controls.target.add(moved);
      }
      if (this.view) this.#frame(this.view === "home" ? undefined : things, FROM[this.view]);
      if (follows) this.controls.update();
    }
  }

  /**
   * Show the robot in the middle, and include things around it as they become known; without any, show all that it can
   * reach as large as the picture allows.
   *
   * @param {Object3D[] | undefined} things
   * @param {Vector3} from
   */
  #frame(things, from) {
    const near = (things ?? []).filter(
      ({position}) => Math.hypot(position.x - this.at.x, position.y - this.at.y) < FAR,
    );
    if (near.length <= this.#framed) return;
    this.#framed = near.length;
    const {camera, controls} = this;
    const away = from
      .clone()
      .applyAxisAngle(UP, this.#heading + this.#turned)
      .normalize();
    const right = new Vector3().crossVectors(UP, away).normalize();
    const above = new Vector3().crossVectors(away, right);
    const half = (camera.fov * Math.PI) / 360;
    const [high, wide] = [Math.tan(half), Math.tan(half) * camera.aspect];
    const middle = new Vector3(this.at.x, this.at.y, things ? this.#height / 2 : this.#middle);
    controls.target.copy(middle);
    /** @param {Vector3} position @param {number} margin */
    const distanceFor = (position, margin) => {
      const offset = position.clone().sub(middle);
      const across = (Math.abs(offset.dot(right)) + margin) / wide;
      return offset.dot(away) + Math.max(across, (Math.abs(offset.dot(above)) + margin) / high);
    };
    const distances = things
      ? [
          (RADIUS * this.#height) / Math.sin(half) / Math.min(1, camera.aspect),
          ...near.map((each) => distanceFor(each.position, MARGIN)),
        ]
      : [this.#reach / Math.sin(half), this.#breadth / Math.sin(Math.atan(wide))];
    camera.position.copy(middle).addScaledVector(away, Math.max(...distances));
    this.controls.update();
  }

  /** @param {Object3D} torso @param {number} swing */
  #trail(torso, swing) {
    const {x, y} = torso.position;
    const place = (/** @type {Vector3} */ offset) =>
      offset.clone().multiplyScalar(this.#height).applyAxisAngle(UP, this.#heading).add({x, y, z: 0});
    this.camera.position.lerp(place(BEHIND), swing);
    this.controls.target.lerp(place(BEFORE), swing);
    this.controls.update();
  }

  /** @param {Body} body */
  #lookAhead({head, eye}) {
    head.getWorldQuaternion(this.camera.quaternion);
    this.camera.position.fromArray(eye.position).applyQuaternion(this.camera.quaternion);
    this.camera.position.add(head.getWorldPosition(new Vector3()));
    this.camera.quaternion.multiply(new Quaternion().setFromAxisAngle(LEFT, eye.tilt)).multiply(AHEAD);
  }

  /** @param {number} width @param {number} height */
  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.#framed = -1;
  }

  close() {
    this.controls.dispose();
  }
}

/** Whether the user has not asked for less motion. */
const wantsMotion = () => !globalThis.matchMedia?.("(prefers-reduced-motion: reduce)").matches;
