/** Round shadows on the floor, drawn where real ones are not: they show where a ball in the air is. */

import {Box3, DataTexture, Group, LinearFilter, Mesh, MeshBasicMaterial, PlaneGeometry, Sphere} from "three";

/** @import {Object3D} from "three" */

const LIFT = 0.004; // m above the floor, above the lines of a field
const DARKEST = 0.5; // opacity below the middle of a thing on the floor
const SOFT = 1.5; // where a shadow ends, relative to the radius of what casts it
const PIXELS = 32; // of a shadow, along a side
const HIGHEST = 1.2; // m from which a thing casts no shadow
const TORSO = 0.15; // m, the radius below a robot

export class Blobs extends Group {
  #geometry = new PlaneGeometry(2 * SOFT, 2 * SOFT);
  #shade = fading();
  /** @type {Map<Object3D, {blob: Mesh<PlaneGeometry, MeshBasicMaterial>, radius: number}>} */
  #blobs = new Map();

  /** Place one below each visible robot and thing. @param {Object3D[]} torsos @param {Object3D[]} things */
  place(torsos, things) {
    const seen = new Set([...torsos.filter(({visible}) => visible), ...things]);
    for (const [thing, {blob}] of this.#blobs)
      if (!seen.has(thing)) {
        blob.material.dispose();
        this.remove(blob);
        this.#blobs.delete(thing);
      }
    for (const thing of seen) {
      const isTorso = torsos.includes(thing);
      const {blob, radius} = this.#of(thing, isTorso);
      const {x, y, z} = thing.position;
      const height = isTorso ? 0 : Math.max(0, z - radius);
      blob.position.set(x, y, LIFT);
      blob.material.opacity = DARKEST * Math.max(0, 1 - height / HIGHEST);
    }
  }

  /** @param {Object3D} thing @param {boolean} isTorso */
  #of(thing, isTorso) {
    const known = this.#blobs.get(thing);
    if (known) return known;
    const radius = isTorso
      ? TORSO
      : new Box3().setFromObject(thing).getBoundingSphere(new Sphere()).radius / Math.sqrt(3);
    const material = new MeshBasicMaterial({map: this.#shade, transparent: true, depthWrite: false});
    const made = {blob: new Mesh(this.#geometry, material), radius};
    made.blob.scale.setScalar(radius);
    this.#blobs.set(thing, made);
    this.add(made.blob);
    return made;
  }

  close() {
    for (const {blob} of this.#blobs.values()) blob.material.dispose();
    this.#geometry.dispose();
    this.#shade.dispose();
  }
}

/** A black spot that fades towards its edge. */
function fading() {
  const data = new Uint8Array(4 * PIXELS * PIXELS);
  for (let pixel = 0; pixel < PIXELS * PIXELS; pixel++) {
    const [x, y] = [pixel % PIXELS, Math.floor(pixel / PIXELS)].map((at) => (2 * at + 1) / PIXELS - 1);
    data[4 * pixel + 3] = 255 * Math.max(0, 1 - x * x - y * y) ** 1.5;
  }
  const texture = new DataTexture(data, PIXELS, PIXELS);
  Object.assign(texture, {magFilter: LinearFilter, minFilter: LinearFilter, needsUpdate: true});
  return texture;
}
