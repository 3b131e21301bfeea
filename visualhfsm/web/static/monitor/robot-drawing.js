/**
 * The robot as three.js draws it: the geometry once, then what is known of it.
 *
 * @import {BodyState, DescribedBody, Triple} from "./body.js"
 * @import {Object3D} from "three"
 * @typedef {{link: string, kind: string, size?: number[], mesh?: number, mirrored?: boolean, position?: Triple,
 *   quaternion?: [number, number, number, number], color: Triple, glow?: number}} Shape
 * @typedef {{vertices: string, indices: string}} DescribedMesh
 * @typedef {DescribedBody & {meshUnit: number, meshes: DescribedMesh[], shapes: Shape[],
 *   balls: Record<string, {radius: number, color: Triple}>}} Described as `nao_h25.json` has it
 */

import {
  AmbientLight,
  Box3,
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  DirectionalLight,
  DoubleSide,
  GridHelper,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  OrbitControls,
  PerspectiveCamera,
  Scene,
  Sphere,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from "three";

import {required} from "../required.js";
import {Body} from "./body.js";

/**
 * Shapes of `nao_h25.json`; sizes are radii and half lengths in m, along z.
 *
 * @satisfies {Record<string, (size: number[]) => BufferGeometry>}
 */
const SHAPES = {
  box: ([x, y, z]) => new BoxGeometry(2 * x, 2 * y, 2 * z),
  capsule: ([radius, half]) => new CapsuleGeometry(radius, 2 * half, 6, 14).rotateX(Math.PI / 2),
  cylinder: ([radius, half]) => new CylinderGeometry(radius, radius, 2 * half, 20).rotateX(Math.PI / 2),
  ellipsoid: ([x, y, z]) => new SphereGeometry(1, 20, 14).scale(x, y, z),
  sphere: ([radius]) => new SphereGeometry(radius, 24, 16),
};

/** Where the robot and balls before it are seen from: its left, half behind it. */
const FROM = new Vector3(-0.55, 1, 0.5);

/** Side in m of the floor's cells. */
const CELL = 0.2;

/** Metres that a robot may sway before it is followed: one that stands is not. */
const NEAR = 0.05;

/** Cosine of the angle between two faces from which on the edge between them is sharp. */
const CREASE = Math.cos((40 * Math.PI) / 180);

export class RobotDrawing {
  /** @param {HTMLElement} stage what it fills */
  constructor(stage) {
    this.stage = stage;
    this.renderer = new WebGLRenderer({antialias: true, alpha: true});
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(40, 1, 0.02, 30);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(1.05, 0.75, 0.62);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.target.set(0.05, 0, 0.27);
    this.controls.update();
    this.controls.addEventListener("change", () => this.#draw());
    this.controls.addEventListener("start", () => (this.#turned = true));
    this.scene.add(new HemisphereLight(0xffffff, 0x8a929c, 2.5), new AmbientLight(0xffffff, 0.25));
    const sun = new DirectionalLight(0xffffff, 1.7);
    sun.position.set(1, -0.8, 2);
    this.scene.add(sun);
    const line = new Color(getComputedStyle(document.documentElement).getPropertyValue("--line").trim());
    this.floor = new GridHelper(20 * CELL, 20, line, line);
    this.floor.rotateX(Math.PI / 2);
    this.scene.add(this.floor);
    stage.append(this.renderer.domElement);
    this.renderer.domElement.setAttribute("role", "img");
    this.renderer.domElement.setAttribute("aria-label", "The robot in 3D");
    this.sizes = new ResizeObserver(() => this.#resize());
    this.sizes.observe(stage);
    /** The body and the balls. @type {Object3D[]} */
    this.parts = [];
    /** Where the robot was when it was followed last. */
    this.at = new Vector3();
  }

  /** @type {Body | undefined} */
  #body = undefined;
  /** @type {Map<string, Mesh>} */
  #balls = new Map();
  #framed = 0; // balls that were in the picture when it was chosen
  #turned = false; // whether the user has chosen another view
  /** @type {number | undefined} */
  #frame = undefined;

  /** Create the body and the balls. @param {Described} described */
  build(described) {
    this.#clear();
    /** @type {Map<string, MeshStandardMaterial>} */
    const materials = new Map();
    /** @param {Triple} color */
    const material = ([red, green, blue], glow = 0) => {
      const key = `${red},${green},${blue},${glow}`;
      const known = materials.get(key);
      if (known) return known;
      const color = new Color().setRGB(red, green, blue, SRGBColorSpace);
      const made = new MeshStandardMaterial({
        color,
        emissive: color,
        emissiveIntensity: glow,
        roughness: 0.45,
        side: DoubleSide,
      });
      materials.set(key, made);
      return made;
    };
    const meshes = described.meshes.map((each) => geometryOf(each, described.meshUnit));
    const body = (this.#body = new Body(described));
    for (const {link, kind, size, mesh, mirrored, position, quaternion, color, glow} of described.shapes) {
      const make = /** @type {Record<string, (size: number[]) => BufferGeometry>} */ (SHAPES)[kind];
      const geometry = kind === "mesh" ? meshes[mesh ?? 0] : make?.(size ?? []);
      if (!geometry) continue;
      const part = new Mesh(geometry, material(color, glow));
      if (mirrored) part.scale.y = -1;
      if (position) part.position.fromArray(position);
      if (quaternion) part.quaternion.fromArray(quaternion);
      body.links.get(link)?.add(part);
    }
    this.#balls = new Map(
      Object.entries(described.balls).map(([name, {radius, color}]) => [
        name,
        new Mesh(SHAPES.sphere([radius]), material(color)),
      ]),
    );
    this.#framed = 0;
    this.parts = [body.torso, ...this.#balls.values()];
    for (const each of this.parts) each.visible = false;
    this.scene.add(...this.parts);
  }

  /**
   * Place everything; returns whether anything of the robot is known.
   *
   * @param {BodyState & {balls: Record<string, Triple>}} state
   */
  pose(state) {
    if (!this.#body) return false;
    const {torso} = this.#body;
    torso.visible = Object.keys(state.joints).length > 0;
    if (torso.visible) this.#body.pose(state);
    for (const [name, ball] of this.#balls) {
      ball.visible = name in state.balls;
      if (ball.visible) ball.position.fromArray(state.balls[name]);
    }
    this.#follow(torso);
    this.#frameBalls();
    this.#draw();
    return torso.visible;
  }

  /** Follow a robot that walks; the floor has no end. @param {Object3D} torso */
  #follow(torso) {
    if (!torso.visible) return;
    const moved = new Vector3(torso.position.x, torso.position.y, 0).sub(this.at);
    if (moved.length() < NEAR) return;
    this.at.add(moved);
    this.camera.position.add(moved);
    this.controls.target.add(moved);
    this.floor.position.set(Math.round(this.at.x / CELL) * CELL, Math.round(this.at.y / CELL) * CELL, 0);
    this.controls.update();
  }

  /** Include balls in the view as they become known, unless the user has chosen another view. */
  #frameBalls() {
    const seen = [...this.#balls.values()].filter((ball) => ball.visible);
    if (this.#turned || seen.length <= this.#framed) return;
    this.#framed = seen.length;
    const box = new Box3(new Vector3(-0.15, -0.3, 0), new Vector3(0.15, 0.3, 0.58)).translate(this.at);
    for (const {position} of seen) box.expandByPoint(position);
    const around = box.getBoundingSphere(new Sphere());
    const distance = (around.radius + 0.08) / Math.sin((this.camera.fov * Math.PI) / 360);
    this.controls.target.copy(around.center);
    this.camera.position
      .copy(FROM)
      .setLength(distance / Math.min(1, this.camera.aspect))
      .add(around.center);
    this.controls.update();
  }

  /** Resolves when what was put somewhere is seen. */
  drawn() {
    return new Promise(requestAnimationFrame);
  }

  /** Let go of the body. */
  #clear() {
    this.scene.remove(...this.parts);
    for (const part of this.parts) {
      part.traverse((each) => {
        if (!(each instanceof Mesh)) return;
        each.geometry.dispose();
        each.material.dispose();
      });
    }
    this.parts = [];
  }

  close() {
    this.#clear();
    this.sizes.disconnect();
    this.controls.dispose();
    if (this.#frame !== undefined) cancelAnimationFrame(this.#frame);
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.renderer.domElement.remove();
  }

  #draw() {
    this.#frame ??= requestAnimationFrame(() => {
      this.#frame = undefined;
      this.renderer.render(this.scene, this.camera);
    });
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.stage;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.#draw();
  }
}

/**
 * A mesh of base64: vertices as int16 in units of `unit` m, indices as uint16.
 *
 * @param {DescribedMesh} mesh
 * @param {number} unit
 */
function geometryOf({vertices, indices}, unit) {
  const points = Float32Array.from(new Int16Array(bytesOf(vertices)), (value) => value * unit);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  geometry.setIndex(new BufferAttribute(new Uint16Array(bytesOf(indices)), 1));
  return creased(geometry);
}

/** The surface with normals that are smooth but across sharp edges. @param {BufferGeometry} geometry */
function creased(geometry) {
  const corners = Array.from(required(geometry.index, "index").array);
  const surface = geometry.toNonIndexed();
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  const faces = Array.from({length: corners.length / 3}, (_, face) => {
    [a, b, c].forEach((point, corner) => point.fromBufferAttribute(surface.attributes.position, 3 * face + corner));
    const area = b.sub(a).cross(c.sub(a)).clone();
    return {area, normal: area.clone().normalize()};
  });
  /** @type {Map<number, {area: Vector3, normal: Vector3}[]>} */
  const around = new Map();
  corners.forEach((vertex, corner) => {
    const face = faces[Math.floor(corner / 3)];
    const known = around.get(vertex);
    if (known) known.push(face);
    else around.set(vertex, [face]);
  });
  const normals = new Float32Array(3 * corners.length);
  corners.forEach((vertex, corner) => {
    const {normal} = faces[Math.floor(corner / 3)];
    const sum = new Vector3();
    for (const other of around.get(vertex) ?? []) if (other.normal.dot(normal) > CREASE) sum.add(other.area);
    sum.normalize().toArray(normals, 3 * corner);
  });
  return surface.setAttribute("normal", new BufferAttribute(normals, 3));
}

/** @param {string} text */
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
