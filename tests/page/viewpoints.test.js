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
function looking(view, {x = 0, y = 0, heading = 0, things = [], width = 400, height = 300}) {
  const viewpoints = new Viewpoints(new Surface(), () => {});
  viewpoints.resize(width, height);
  const torso = new Object3D();
  torso.position.set(x, y, 0.33);
  torso.quaternion.setFromAxisAngle(new Vector3(0, 0, 1), heading);
  const placed = things.map(([across, along, up = 0.05]) => ({position: new Vector3(x + across, y + along, up)}));
  viewpoints.choose(view, {torso, headParts: []}, placed);
  viewpoints.camera.updateMatrixWorld();
  const onPicture = (place) => place.clone().project(viewpoints.camera);
  return {
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

test("at home the robot fills most of the picture, from its face, whatever is near it", () => {
  const heights = [
    [400, 300],
    [900, 200],
  ].map(([width, height]) => {
    const {parts, distance} = looking("home", {x: 3, y: -2, heading: 2, things: [[1.4, 0.6]], width, height});
    for (const each of parts) assert.ok(isSeen(each));
    return {part: Math.abs(parts[1].y - parts[0].y) / 2, distance};
  });
  for (const {part} of heights) assert.ok(part > 0.75 && part < 0.95, `${part}`);
  const narrow = looking("home", {width: 200, height: 500});
  assert.ok(narrow.distance > heights[0].distance, "its arms are seen, too");
  const ahead = looking("home", {things: [[0.3, 0, 0.29]]});
  assert.ok(ahead.things[0].z < ahead.robot.z, "what is in front of its face is nearer");
});

test("what is far does not make the robot small, and one alone is seen closely", () => {
  const alone = looking("around", {});
  assert.ok(Math.abs(alone.distance - 1.52) < 0.01);
  assert.equal(looking("around", {things: [[2.1, 0], [0, -30]]}).distance, alone.distance); // prettier-ignore
  assert.ok(looking("around", {things: [[1.2, 0.5], [1.2, -0.5]]}).distance < 2.8); // prettier-ignore
});
