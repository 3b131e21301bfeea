/**
 * The robot and its world as three.js draws them: the geometry once, then each known state.
 *
 * @import {Body, BodyState, DescribedBody} from "./body.js"
 * @import {DescribedMesh, Shape} from "./shapes.js"
 * @import {View} from "./viewpoints.js"
 * @import {Placement} from "./world-drawing.js"
 * @typedef {DescribedBody & {title: string, meshUnit: number, meshes: DescribedMesh[], shapes: (Shape & {link: string})[]}} Described
 *   as visualhfsm/_monitor/realm/description.py makes it
 * @typedef {BodyState & {objects: Record<string, Placement>, others?: Record<string, Other>}} Moment
 * @typedef {{body: string, joints: Record<string, number>}} Other another robot of the world, whose place is that of
 *   the object of its name
 */

import {AmbientLight, Color, DirectionalLight, HemisphereLight, Scene, Vector3, WebGLRenderer} from "three";

import {t} from "../kit/texts.js";
import {Blobs} from "./blobs.js";
import {figureOf} from "./figure.js";
import {Pace} from "./pace.js";
import {dispose} from "./shapes.js";
import {Viewpoints} from "./viewpoints.js";
import {WorldDrawing} from "./world-drawing.js";

/** The direction of the light, and metres around the robot within which things cast shadows. */
const SUN = new Vector3(1.2, -0.9, 3);
const SHADED = 1.6;
const SHADOW_PIXELS = 1024;
const SOFT = 4; // pixels of the shadow over which its edge fades

const SIMPLE = 0.75; // pixels of a simple picture per pixel of the screen, along a side

export class RobotDrawing {
  /** @param {HTMLElement} stage that it fills */
  constructor(stage) {
    this.stage = stage;
    const slow = hasNoGpu();
    this.renderer = new WebGLRenderer({antialias: !slow, alpha: true});
    this.pace = new Pace(slow);
    this.scene = new Scene();
    const canvas = this.renderer.domElement;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", t("The robot in 3D"));
    canvas.tabIndex = 0;
    this.viewpoints = new Viewpoints(canvas, () => this.redraw());
    this.scene.add(new HemisphereLight(0xffffff, 0x8a929c, 2.2), new AmbientLight(0xffffff, 0.25));
    this.sun = sunlight();
    this.scene.add(this.sun, this.sun.target);
    this.world = new WorldDrawing();
    this.blobs = new Blobs();
    this.scene.add(this.world, this.blobs);
    /** @type {Body | undefined} */
    this.body = undefined;
    /** The other robots of the world, by their names. @type {Map<string, {hash: string, body: Body}>} */
    this.others = new Map();
    /** The name of the one that the view follows instead of the own. */
    this.watched = "";
    this.#after.port1.onmessage = () => {
      if (this.pace.note(performance.now() - this.#drawn)) this.#choosePace();
    };
    this.#choosePace();
    stage.append(canvas);
    this.sizes = new ResizeObserver(() => this.#resize());
    this.sizes.observe(stage);
  }

  /** @type {number | undefined} */
  #frame = undefined;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #later = undefined;
  #drawn = 0; // when it was drawn last
  #hidden = false; // whether its place has no size
  #after = new MessageChannel(); // delivers a message when the page is free again after a frame
  /** @type {(() => void)[]} */
  #waiting = [];

  /** Create the body. @param {Described} described */
  build(described) {
    this.clear();
    this.body = this.#figure(described);
    this.#fit();
  }

  /** Create another robot, or replace it. @param {string} name @param {string} hash @param {Described} described */
  meet(name, hash, described) {
    this.part(name);
    this.others.set(name, {hash, body: this.#figure(described)});
  }

  /** Remove another robot. @param {string} name */
  part(name) {
    const other = this.others.get(name);
    if (!other) return;
    this.scene.remove(other.body.torso);
    dispose([other.body.torso]);
    this.others.delete(name);
  }

  /** @param {Described} described */
  #figure(described) {
    const color = new Color(getComputedStyle(document.documentElement).getPropertyValue("--accent").trim());
    const body = figureOf(described, color);
    body.torso.visible = false;
    this.scene.add(body.torso);
    return body;
  }

  /** The robot that the view follows. */
  get #followed() {
    return this.others.get(this.watched)?.body ?? this.body;
  }

  /** What a view from around shows besides: things and other robots. */
  get #around() {
    const torsos = Array.from(this.others.values(), ({body}) => body.torso);
    return [...this.world.seen, ...torsos.filter(({visible}) => visible)];
  }

  #fit() {
    this.viewpoints.fit(this.#followed?.size);
  }

  /** Place everything; returns whether anything of the robot is known. @param {Moment} moment */
  pose(moment) {
    const {body, world, viewpoints} = this;
    for (const [name, other] of this.others) {
      const {joints = {}} = moment.others?.[name] ?? {};
      const torso = moment.objects[name];
      other.body.torso.visible = Boolean(torso) && Object.keys(joints).length > 0;
      if (other.body.torso.visible) other.body.pose({joints, torso, tilt: null});
    }
    if (body) body.torso.visible = Object.keys(moment.joints).length > 0;
    if (body?.torso.visible) body.pose(moment);
    world.pose(moment.objects);
    const followed = this.#followed;
    if (followed) {
      viewpoints.keep(followed, this.#around);
      world.center(viewpoints.at);
      const torsos = [body, ...Array.from(this.others.values(), (other) => other.body)].flatMap(
        (each) => each?.torso ?? [],
      );
      if (this.blobs.visible) this.blobs.place(torsos, world.seen);
      this.sun.position.copy(viewpoints.at).add(SUN);
      this.sun.target.position.copy(viewpoints.at);
    }
    this.redraw();
    return Boolean(body?.torso.visible);
  }

  /** Let the view follow another robot; without a name the own. @param {string} name */
  watch(name) {
    this.watched = name;
    this.#fit();
    this.look("home");
  }

  /** Show it from another viewpoint. @param {View} view */
  look(view) {
    this.viewpoints.choose(view, this.#followed, this.#around);
  }

  /** Resolves when the present places have been drawn. */
  drawn() {
    return new Promise((resolve) => {
      this.#waiting.push(() => resolve(undefined));
      this.redraw();
    });
  }

  /** Draw it when the next frame is due, unless it is hidden. */
  redraw() {
    if (this.#hidden) for (const resolve of this.#waiting.splice(0)) resolve(); // they wait for nothing
    if (this.#hidden || this.#frame !== undefined || this.#later !== undefined) return;
    const left = this.#drawn + this.pace.wait - performance.now();
    if (left > 0) this.#later = setTimeout(() => this.#request(), left);
    else this.#request();
  }

  #request() {
    this.#later = undefined;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = undefined;
      if (this.#hidden) return this.redraw();
      this.#drawn = performance.now();
      if (this.#followed?.torso.visible) this.viewpoints.turn(this.#drawn);
      this.world.fade((position) => this.viewpoints.isBlockedBy(position));
      this.renderer.render(this.scene, this.viewpoints.camera);
      for (const resolve of this.#waiting.splice(0)) resolve();
      this.#after.port2.postMessage(null);
      if (this.viewpoints.turning) this.redraw();
    });
  }

  /** Draw in full, or simply. */
  #choosePace() {
    const {simple} = this.pace;
    this.renderer.setPixelRatio(simple ? SIMPLE : Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = this.sun.castShadow = !simple;
    this.blobs.visible = simple;
    this.stage.classList.toggle("simple", simple);
    this.redraw();
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.stage;
    this.#hidden = !width || !height;
    if (this.#hidden) return;
    this.renderer.setSize(width, height);
    this.viewpoints.resize(width, height);
    this.redraw();
  }

  /** Remove the body. */
  clear() {
    if (!this.body) return;
    this.scene.remove(this.body.torso);
    dispose([this.body.torso]);
    this.body = undefined;
  }

  close() {
    this.clear();
    for (const name of this.others.keys()) this.part(name);
    this.world.close();
    this.blobs.close();
    this.sizes.disconnect();
    this.viewpoints.close();
    if (this.#frame !== undefined) cancelAnimationFrame(this.#frame);
    clearTimeout(this.#later);
    this.#after.port1.close();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.renderer.domElement.remove();
  }
}

/** Whether pictures are drawn by the processor. */
function hasNoGpu() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && known ? String(gl.getParameter(known.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

function sunlight() {
  const sun = new DirectionalLight(0xffffff, 1.9);
  sun.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
  Object.assign(sun.shadow.camera, {left: -SHADED, right: SHADED, top: SHADED, bottom: -SHADED, near: 0.5, far: 6});
  sun.shadow.radius = SOFT;
  sun.shadow.bias = -0.0004;
  sun.shadow.normalBias = 0.003;
  return sun;
}
