/** The robot's body as three.js draws it: the geometry once, then poses. */

import {
  AmbientLight, Box3, BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, CylinderGeometry, DirectionalLight, DoubleSide, GridHelper, Group, HemisphereLight,
  Mesh, MeshStandardMaterial, OrbitControls, PerspectiveCamera, Scene, Sphere, SphereGeometry, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";

/** Shapes of `nao_h25.json`; sizes are radii and half lengths in m, along z. */
const SHAPES = {
  box: ([x, y, z]) => new BoxGeometry(2 * x, 2 * y, 2 * z),
  capsule: ([radius, half]) => new CapsuleGeometry(radius, 2 * half, 6, 14).rotateX(Math.PI / 2),
  cylinder: ([radius, half]) => new CylinderGeometry(radius, radius, 2 * half, 20).rotateX(Math.PI / 2),
  ellipsoid: (size) => new SphereGeometry(1, 20, 14).scale(...size),
  sphere: ([radius]) => new SphereGeometry(radius, 24, 16),
};

/** Where the robot and balls before it are seen from: its left, half behind it. */
const FROM = new Vector3(-0.55, 1, 0.5);

export class RobotScene {
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
    this.controls.addEventListener("start", () => (this.turned = true));
    this.scene.add(new HemisphereLight(0xffffff, 0x8a929c, 2.1), new AmbientLight(0xffffff, 0.25));
    const sun = new DirectionalLight(0xffffff, 1.7);
    sun.position.set(1, -0.8, 2);
    this.scene.add(sun);
    this.#addFloor();
    stage.append(this.renderer.domElement);
    this.renderer.domElement.setAttribute("role", "img");
    this.renderer.domElement.setAttribute("aria-label", "The robot in 3D");
    this.sizes = new ResizeObserver(() => this.#resize());
    this.sizes.observe(stage);
    this.parts = [];
  }

  /** Make the body; `described` is `nao_h25.json` with the `order` of the poses. */
  build(described) {
    this.#clear();
    const materials = new Map();
    const material = ([red, green, blue]) => {
      const key = `${red},${green},${blue}`;
      if (!materials.has(key)) materials.set(key, new MeshStandardMaterial({color: new Color().setRGB(red, green, blue, SRGBColorSpace), roughness: 0.55, side: DoubleSide}));
      return materials.get(key);
    };
    const meshes = described.meshes.map((each) => geometryOf(each, described.meshUnit));
    const groups = new Map(described.order.map((name) => [name, new Group()]));
    for (const {link, kind, size, mesh, mirrored, position, quaternion, color} of described.shapes) {
      const geometry = kind === "mesh" ? meshes[mesh] : SHAPES[kind]?.(size);
      if (!geometry) continue;
      const part = new Mesh(geometry, material(color));
      if (mirrored) part.scale.y = -1;
      if (position) part.position.fromArray(position);
      if (quaternion) part.quaternion.fromArray(quaternion);
      groups.get(link)?.add(part);
    }
    for (const [name, {radius, color}] of Object.entries(described.balls)) groups.get(name)?.add(new Mesh(SHAPES.sphere([radius]), material(color)));
    this.parts = [...groups.values()];
    this.balls = Object.keys(described.balls).map((name) => groups.get(name));
    this.framed = 0;
    for (const each of this.parts) each.visible = false;
    this.scene.add(...this.parts);
  }

  /** Put everything where it is; returns whether anything of the robot is known. @param {Float32Array} numbers */
  pose(numbers) {
    this.parts.forEach((part, index) => {
      const [x, y, z, ...rotation] = numbers.subarray(index * 7, index * 7 + 7);
      part.visible = !Number.isNaN(x);
      if (!part.visible) return;
      part.position.set(x, y, z);
      part.quaternion.set(...rotation);
    });
    this.#frameBalls();
    this.#draw();
    return this.parts[0]?.visible ?? false;
  }

  /** As balls become known they come into the picture, unless somebody has chosen another view. */
  #frameBalls() {
    const seen = this.balls.filter((ball) => ball.visible);
    if (this.turned || seen.length <= this.framed) return;
    this.framed = seen.length;
    const box = new Box3(new Vector3(-0.15, -0.3, 0), new Vector3(0.15, 0.3, 0.58));
    for (const {position} of seen) box.expandByPoint(position);
    const around = box.getBoundingSphere(new Sphere());
    const distance = (around.radius + 0.08) / Math.sin((this.camera.fov * Math.PI) / 360);
    this.controls.target.copy(around.center);
    this.camera.position.copy(FROM).setLength(distance / Math.min(1, this.camera.aspect)).add(around.center);
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
      part.traverse(({geometry, material}) => {
        geometry?.dispose();
        material?.dispose();
      });
    }
    this.parts = [];
  }

  close() {
    this.#clear();
    this.sizes.disconnect();
    this.controls.dispose();
    cancelAnimationFrame(this.frame);
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.renderer.domElement.remove();
  }

  #draw() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = undefined;
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

  #addFloor() {
    const style = getComputedStyle(document.documentElement);
    const grid = new GridHelper(4, 20, new Color(style.getPropertyValue("--strong-line").trim()), new Color(style.getPropertyValue("--line").trim()));
    grid.rotateX(Math.PI / 2);
    this.scene.add(grid);
  }
}

/** A mesh of base64: vertices as int16 in units of `unit` m, indices as uint16. */
function geometryOf({vertices, indices}, unit) {
  const points = Float32Array.from(new Int16Array(bytesOf(vertices)), (value) => value * unit);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  geometry.setIndex(new BufferAttribute(new Uint16Array(bytesOf(indices)), 1));
  const sharp = geometry.toNonIndexed();
  sharp.computeVertexNormals();
  return sharp;
}

const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
