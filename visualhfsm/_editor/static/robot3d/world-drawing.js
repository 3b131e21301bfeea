/**
 * The world around the robot as three.js draws it: what is fixed, and what moves.
 *
 * @import {Shape} from "./shapes.js"
 * @import {Raycaster, Vector3} from "three"
 * @typedef {Shape & {object: string, at: Placement}} WorldShape `object` is what it moves with; empty for what is
 *   fixed
 * @typedef {[number, number, number, number, number, number, number]} Placement position in m, and a quaternion
 *   (x, y, z, w)
 */

import {
  Box3,
  Color,
  DataTexture,
  GridHelper,
  Group,
  LinearMipmapLinearFilter,
  Mesh,
  MeshStandardMaterial,
  NearestFilter,
  PlaneGeometry,
  RepeatWrapping,
  ShadowMaterial,
  SRGBColorSpace,
} from "three";

import {dispose, Workshop} from "./shapes.js";

/** Side in m of the floor's cells. */
const CELL = 0.25;

/** Cells along a side of the grid where no floor is known. */
const CELLS = 16;

/** Brightness of the darker cells of a floor. */
const DARKER = 0.93;

/** Opacity of a thing before what is looked at. */
const FADED = 0.2;

export class WorldDrawing extends Group {
  constructor() {
    super();
    /** Movable objects by name. @type {Map<string, Group>} */
    this.objects = new Map();
    const line = new Color(getComputedStyle(document.documentElement).getPropertyValue("--line").trim());
    const grid = new GridHelper(CELLS * CELL, CELLS, line, line);
    grid.rotateX(Math.PI / 2);
    const shade = new Mesh(new PlaneGeometry(CELLS * CELL, CELLS * CELL), new ShadowMaterial({opacity: 0.25}));
    shade.receiveShadow = true;
    /** The endless floor, drawn where none is known. */
    this.grid = new Group().add(grid, shade);
    this.#firm.visible = false;
    this.add(this.grid, this.#firm);
  }

  /** Fixed objects. */
  #firm = new Group();

  /** Create everything. @param {WorldShape[]} shapes */
  build(shapes) {
    this.#clear();
    const workshop = new Workshop();
    for (const shape of shapes) {
      const made = shape.kind === "plane" ? floorOf(shape) : workshop.make(shape);
      if (!made) continue;
      made.position.fromArray(shape.at);
      made.quaternion.fromArray(shape.at, 3);
      made.receiveShadow = true;
      const {opacity = 1} = shape;
      made.castShadow = Boolean(shape.object) && opacity > 0.5;
      if (shape.object && made.material instanceof MeshStandardMaterial) {
        made.material = Object.assign(made.material.clone(), {transparent: true}); // of its own, for `fade`
        made.userData.opacity = opacity;
      }
      this.#groupOf(shape.object).add(made);
    }
    this.grid.visible = !shapes.some(({kind}) => kind === "plane");
    this.#firm.visible = true;
  }

  /** @param {string} name */
  #groupOf(name) {
    if (!name) return this.#firm;
    let group = this.objects.get(name);
    if (!group) {
      group = new Group();
      group.name = name;
      group.visible = false;
      this.objects.set(name, group);
      this.add(group);
    }
    return group;
  }

  /** Place movable objects; those of unknown place are hidden. @param {Record<string, Placement>} placements */
  pose(placements) {
    for (const [name, group] of this.objects) {
      const at = placements[name];
      group.visible = Boolean(at);
      if (!at) continue;
      group.position.fromArray(at);
      group.quaternion.fromArray(at, 3);
    }
  }

  /** See through the things at some places. @param {(position: Vector3) => boolean} blocks */
  fade(blocks) {
    for (const {position, children} of this.seen) {
      const share = blocks(position) ? FADED : 1;
      for (const each of children) if (each instanceof Mesh) each.material.opacity = share * each.userData.opacity;
    }
  }

  /** Move the grid along with the robot. @param {Vector3} at */
  center({x, y}) {
    this.grid.position.set(Math.round(x / CELL) * CELL, Math.round(y / CELL) * CELL, 0);
  }

  /** The movable objects whose place is known. */
  get seen() {
    return [...this.objects.values()].filter((each) => each.visible);
  }

  /**
   * The nearest movable object along a ray.
   *
   * @param {Raycaster} ray
   * @returns {{object: Group, point: Vector3} | undefined}
   */
  hit(ray) {
    const [found] = ray.intersectObjects(this.seen, true);
    if (!found) return undefined;
    const object = this.seen.find((each) => each === found.object.parent);
    return object && {object, point: found.point};
  }

  /** The height of the lowest point of a movable object. @param {Group} object */
  static bottomOf(object) {
    return new Box3().setFromObject(object).min.z;
  }

  #clear() {
    dispose([this.#firm, ...this.objects.values()]);
    this.#firm.clear();
    this.remove(...this.objects.values());
    this.objects.clear();
  }

  close() {
    this.#clear();
    dispose([this.grid]);
  }
}

/** A floor with cells, which make movement over it visible. @param {Shape} shape */
function floorOf({size = [1, 1], color}) {
  const [x, y] = size;
  const floor = new Mesh(new PlaneGeometry(2 * x, 2 * y), new MeshStandardMaterial({roughness: 0.95}));
  floor.material.color.setRGB(...color, SRGBColorSpace);
  const [light, dark] = [255, Math.round(255 * DARKER)];
  const cells = [light, dark, dark, light].flatMap((value) => [value, value, value, 255]);
  const texture = new DataTexture(new Uint8Array(cells), 2, 2);
  Object.assign(texture, {wrapS: RepeatWrapping, wrapT: RepeatWrapping, colorSpace: SRGBColorSpace});
  Object.assign(texture, {magFilter: NearestFilter, minFilter: LinearMipmapLinearFilter, generateMipmaps: true});
  texture.anisotropy = 4;
  texture.repeat.set(x / CELL, y / CELL);
  texture.needsUpdate = true;
  floor.material.map = texture;
  return floor;
}
