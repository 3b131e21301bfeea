import assert from "node:assert/strict";
import {register} from "node:module";
import {test} from "node:test";

import {STATIC} from "./page.js";

// As the import map of the page does.
const three = JSON.stringify({url: new URL("vendor/three.js", STATIC).href, shortCircuit: true});
const hook = `export const resolve = (name, context, next) => (name === "three" ? ${three} : next(name, context));`;
register(`data:text/javascript,${encodeURIComponent(hook)}`);
const {Object3D, Vector3} = await import("three");
const {Viewpoints} = await import(new URL("robot3d/viewpoints.js", STATIC).href);

/** An element that is dragged on. */
class Surface extends EventTarget {
  ownerDocument = new EventTarget();
  style = {};
  getRootNode = () => new EventTarget();
}

/** What is seen from a view, and where on the picture, from -1 to 1, a robot at `x`, `y` and things around it are. */
function looking(view, {x = 0, y = 0, heading = 0, things = [], width = 400, height = 300, size}) {
  const viewpoints = new Viewpoints(new Surface(), () => {});
  viewpoints.resize(width, height);
  viewpoints.fit(size);
  const torso = new Object3D();
  torso.position.set(x, y, 0.33);
  torso.quaternion.setFromAxisAngle(new Vector3(0, 0, 1), heading);
  const placed = things.map(([across, along, up = 0.05]) => ({position: new Vector3(x + across, y + along, up)}));
  viewpoints.choose(view, {torso, headParts: []}, placed);
  viewpoints.camera.updateMatrixWorld();
  const onPicture = (place) => place.clone().project(viewpoints.camera);
  return {
    camera: viewpoints.camera,
    blocked: placed.map(({position}) => viewpoints.isBlockedBy(position)),
    robot: onPicture(new Vector3(x, y, 0.29)),
    parts: [onPicture(new Vector3(x, y, 0)), onPicture(new Vector3(x, y, 0.58))],
    things: placed.map(({position}) => onPicture(position)),
    distance: viewpoints.camera.position.distanceTo(new Vector3(x, y, 0.29)),
  };
}

const isSeen = ({x, y}) => Math.abs(x) < 1 && Math.abs(y) < 1;

test("a view shows the robot in the middle, with what is near it, in windows of any form", () => {
  for (const view of ["around", "top"])
    for (const [width, height] of [
      [400, 300],
      [300, 500],
      [900, 200],
    ])
      for (const heading of [0, 2, -1.6]) {
        const things = [
          [1.4, 0.6],
          [1.4, -0.9, 0.3],
          [-0.2, 1.9],
        ];
        const seen = looking(view, {x: 3, y: -2, heading, things, width, height});
        const which = `${view} ${width} ${heading}`;
        assert.ok(Math.hypot(seen.robot.x, seen.robot.y) < 0.01, which);
        for (const each of [...seen.parts, ...seen.things]) assert.ok(isSeen(each), which);
      }
});

test("at home all that the robot can reach is seen, in windows of any form, as large as possible", () => {
  for (const [width, height] of [
    [400, 300],
    [900, 200],
    [200, 500],
  ])
    for (const size of [undefined, {height: 1.2, middle: 0.7, reach: 0.9, breadth: 0.8}]) {
      const {middle = 0.33, reach = 0.435, breadth = 0.406} = size ?? {};
      const {camera} = looking("home", {x: 3, y: -2, heading: 2, things: [[1.4, 0.6]], width, height, size});
      const seen = (/** @type {number} */ along, /** @type {number} */ up) => {
        const aside = new Vector3(1, 0, 0).applyQuaternion(camera.quaternion).multiplyScalar(along);
        return new Vector3(3, -2, middle + up).add(aside).project(camera);
      };
      const edges = [...[breadth, -breadth].map((at) => seen(at, 0)), ...[reach, -reach].map((at) => seen(0, at))];
      for (const edge of edges) assert.ok(isSeen(edge), `${width}x${height}`);
      const largest = Math.max(...edges.flatMap(({x, y}) => [Math.abs(x), Math.abs(y)]));
      assert.ok(largest > 0.75, `${width}x${height}: ${largest}`);
    }
  const ahead = looking("home", {things: [[0.3, 0, 0.29]]});
  assert.ok(ahead.things[0].z < ahead.robot.z, "what is in front of its face is nearer");
  const near = {things: [[0.8, 0.5, 0.4], [0.4, 0.2, 0.05], [-1, -1]]}; // prettier-ignore
  assert.deepEqual(looking("home", near).blocked, [true, false, false], "a ball before the camera hides no robot");
});

test("at first sight it goes around once, until it is touched, and not for who wants no motion", () => {
  const surface = new Surface();
  const viewpoints = new Viewpoints(surface, () => {});
  viewpoints.resize(400, 300);
  const bearing = () => Math.atan2(viewpoints.camera.position.y, viewpoints.camera.position.x);
  for (const now of [1000, 4000, 7000]) viewpoints.turn(now);
  assert.ok(viewpoints.turning);
  const turned = bearing();
  assert.ok(Math.abs(turned - Math.atan2(0.6, 1)) > 0.3);
  surface.dispatchEvent(new Event("keydown"));
  for (const now of [8000, 12000]) viewpoints.turn(now);
  assert.deepEqual([viewpoints.turning, bearing()], [false, turned]);

  const whole = new Viewpoints(new Surface(), () => {});
  whole.resize(400, 300);
  for (let now = 1000; now < 30_000; now += 500) whole.turn(now);
  assert.equal(whole.turning, false);
  assert.ok(Math.abs(whole.camera.position.y / whole.camera.position.x - 0.6) < 0.01, "it ends where it began");

  globalThis.matchMedia = () => /** @type {MediaQueryList} */ ({matches: true});
  const still = new Viewpoints(new Surface(), () => {});
  for (const now of [1000, 4000]) still.turn(now);
  assert.equal(still.turning, false);
});

test("a robot of another size is seen whole, also after a click into the view of the former one", () => {
  const viewpoints = new Viewpoints(new Surface(), () => {});
  viewpoints.resize(400, 300);
  const body = {torso: new Object3D(), headParts: []};
  viewpoints.choose("home", body, []);
  const near = viewpoints.controls.getDistance();
  viewpoints.controls.dispatchEvent({type: "start"});
  viewpoints.fit({height: 1.2, middle: 0.7, reach: 0.9, breadth: 0.8});
  viewpoints.keep(body, []);
  assert.ok(viewpoints.controls.getDistance() > 1.5 * near);
});

test("what is followed stays in the middle, and the view never goes further than it does", () => {
  const viewpoints = new Viewpoints(new Surface(), () => {});
  viewpoints.resize(400, 300);
  const body = {torso: new Object3D(), headParts: []};
  viewpoints.choose("around", body, []);
  const at = viewpoints.camera.position.clone();
  for (let step = 1; step <= 100; step++) {
    body.torso.position.x = 0.02 * step;
    viewpoints.keep(body, []);
    assert.ok(viewpoints.camera.position.distanceTo(at) < 0.0201);
    at.copy(viewpoints.camera.position);
  }
  assert.ok(viewpoints.controls.target.distanceTo(new Vector3(2, 0, 0.29)) < 0.051);
});

test("what is far does not make the robot small, and one alone is seen closely", () => {
  const alone = looking("around", {});
  assert.ok(Math.abs(alone.distance - 1.52) < 0.01);
  assert.equal(looking("around", {things: [[2.1, 0], [0, -30]]}).distance, alone.distance); // prettier-ignore
  assert.ok(looking("around", {things: [[1.2, 0.5], [1.2, -0.5]]}).distance < 2.8); // prettier-ignore
});
