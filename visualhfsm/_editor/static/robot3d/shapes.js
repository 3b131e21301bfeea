/**
 * Shapes as the server describes them, as three.js draws them.
 *
 * @import {Triple} from "./body.js"
 * @typedef {{kind: string, size?: number[], mesh?: number, mirrored?: boolean, position?: Triple,
 *   quaternion?: [number, number, number, number], color: Triple, glow?: number, opacity?: number}} Shape sizes are
 *   halves in m
 * @typedef {{vertices: string, indices: string}} DescribedMesh
 */

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Mesh,
  MeshStandardMaterial,
  RingGeometry,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from "three";

import {required} from "../kit/existence.js";

/** Round and long shapes have their axis along z. @satisfies {Record<string, (size: number[]) => BufferGeometry>} */
const FORMS = {
  box: ([x, y, z]) => new BoxGeometry(2 * x, 2 * y, 2 * z),
  capsule: ([radius, half]) => new CapsuleGeometry(radius, 2 * half, 6, 14).rotateX(Math.PI / 2),
  cylinder: ([radius, half]) => new CylinderGeometry(radius, radius, 2 * half, 20).rotateX(Math.PI / 2),
  ellipsoid: ([x, y, z]) => new SphereGeometry(1, 20, 14).scale(x, y, z),
  ring: ([radius, half]) => new RingGeometry(radius - half, radius + half, 64),
  sphere: ([radius]) => new SphereGeometry(radius, 24, 16),
};

/** Cosine of the angle between two faces from which on the edge between them is sharp. */
const CREASE = Math.cos((40 * Math.PI) / 180);

/** Makes meshes of shapes; those that look the same share their material. */
export class Workshop {
  /** @type {Map<string, MeshStandardMaterial>} */
  #materials = new Map();
  /** @type {BufferGeometry[]} */
  #meshes = [];

  /** Set the meshes that shapes refer to by number, once. @param {DescribedMesh[]} meshes @param {number} unit in m */
  take(meshes, unit) {
    if (!this.#meshes.length) this.#meshes = meshes.map((each) => geometryOf(each, unit));
  }

  /** A mesh of a shape; undefined when its form is unknown. @param {Shape} shape @returns {Mesh | undefined} */
  make({kind, size, mesh, mirrored, position, quaternion, color, glow, opacity}) {
    const form = /** @type {Record<string, (size: number[]) => BufferGeometry>} */ (FORMS)[kind];
    const geometry = kind === "mesh" ? this.#meshes[mesh ?? 0] : form?.(size ?? []);
    if (!geometry) return undefined;
    const part = new Mesh(geometry, this.#material(color, glow, opacity));
    if (mirrored) part.scale.y = -1;
    if (position) part.position.fromArray(position);
    if (quaternion) part.quaternion.fromArray(quaternion);
    return part;
  }

  /** @param {Triple} color */
  #material([red, green, blue], glow = 0, opacity = 1) {
    const key = [red, green, blue, glow, opacity].join();
    const known = this.#materials.get(key);
    if (known) return known;
    const color = new Color().setRGB(red, green, blue, SRGBColorSpace);
    const made = new MeshStandardMaterial({
      color,
      emissive: color,
      emissiveIntensity: glow,
      roughness: 0.45,
      side: DoubleSide,
      opacity,
      transparent: opacity < 1,
    });
    this.#materials.set(key, made);
    return made;
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

/** The surface with smooth normals, except across sharp edges. @param {BufferGeometry} geometry */
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

/** Free the resources of the meshes of some objects. @param {import("three").Object3D[]} objects */
export function dispose(objects) {
  for (const object of objects)
    object.traverse((each) => {
      if (!(each instanceof Mesh)) return;
      each.geometry.dispose();
      each.material.dispose();
    });
}
