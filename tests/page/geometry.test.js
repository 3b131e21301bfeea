import assert from "node:assert/strict";
import {test} from "node:test";

import {STATIC} from "./page.js";

const {arc, bounds, contains, distance, drawnArc, handles, neighbor, pointsOf, LOOP, RADIUS} = await import(
  new URL("measures/geometry.js", STATIC).href
);
const {placeLabels, HANDLE} = await import(new URL("canvas/labels.js", STATIC).href);

const near = (one, other, most = 0.1) => assert.ok(distance(one, other) <= most, `${JSON.stringify(one)} is elsewhere`);
const A = {x: 0, y: 0};
const B = {x: 400, y: 0};

test("an arc runs from rim to rim, and its head touches the other state", () => {
  for (const handle of [
    {x: 200, y: 0},
    {x: 200, y: 80},
    {x: 150, y: -60},
  ]) {
    const {start, end} = arc(A, B, handle);
    assert.ok(Math.abs(distance(start, A) - RADIUS) < 0.1);
    assert.ok(Math.abs(distance(end, B) - RADIUS - 2) < 0.1);
  }
});

test("a handle on the chord makes a straight line, one beside it a curve through it", () => {
  assert.match(arc(A, B, {x: 200, y: 1}).path, /^M[^LQ]*L[^LQ]*$/);
  const {path} = arc(A, B, {x: 200, y: 80});
  const [, start, control, end] = path.match(/^M(.*)Q(.*) (.*)$/).map((text) => {
    const [x, y] = text.split(",").map(Number);
    return {x, y};
  });
  near({x: (start.x + 2 * control.x + end.x) / 4, y: (start.y + 2 * control.y + end.y) / 4}, {x: 200, y: 80}, 0.5);
});

test("a loop comes back to its state, with the handle in its middle", () => {
  const handle = {x: 0, y: -LOOP};
  const {start, end, middle} = arc(A, A, handle, true);
  assert.equal(middle, handle);
  assert.ok(Math.abs(distance(start, A) - RADIUS) < 0.1);
  assert.ok(Math.abs(distance(end, A) - RADIUS - 2) < 0.1);
});

test("a transition without an end is drawn as far as it is known", () => {
  assert.equal(arc(undefined, undefined, B).path, "");
  assert.equal(arc(A, undefined, B).head, "");
  assert.notEqual(arc(undefined, B, A).head, "");
  assert.match(drawnArc(A, {x: 50, y: 90}, false).path, /L50,90$/);
});

test("handles of transitions without a place keep apart, both ways between two states", () => {
  const places = new Map([
    [1, A],
    [2, B],
  ]);
  const placed = {id: 1, x: 30, y: 40, origin: 1, destination: 2};
  const others = [1, 2, 3, 4].map((id) => ({id, x: 0, y: 0, origin: id % 2 ? 1 : 2, destination: id % 2 ? 2 : 1}));
  const found = handles([placed, ...others], places);
  assert.deepEqual(found.get(placed), {x: 30, y: 40});
  const free = others.map((each) => found.get(each));
  for (const [index, one] of free.entries()) {
    for (const other of free.slice(index + 1)) assert.ok(distance(one, other) > 45);
  }
});

test("no handle covers another one, wherever the document has them", () => {
  const places = new Map([
    [1, A],
    [2, B],
  ]);
  const ends = [1, 2, 1, 2].map((origin, index) => ({origin, destination: index < 2 ? 3 - origin : origin}));
  const found = [
    ...handles(
      ends.map((each) => ({...each, x: 70, y: 80})),
      places,
    ).values(),
  ];
  assert.deepEqual(found[0], {x: 70, y: 80});
  for (const [index, one] of found.entries())
    for (const other of found.slice(index + 1)) assert.ok(distance(one, other) > 45);
});

test("bounds hold the states with their rims, and the arcs", () => {
  assert.equal(bounds([], []), undefined);
  const box = bounds([A, B], [arc(A, B, {x: 200, y: 300})]);
  assert.deepEqual([box.left, box.right, box.top], [-RADIUS, 400 + RADIUS, -RADIUS]);
  assert.ok(box.bottom >= 300);
  assert.ok(contains(box, {left: 0, top: 0, right: 1, bottom: 1}));
  assert.ok(!contains({left: 0, top: 0, right: 1, bottom: 1}, box));
  assert.ok(!contains(box, undefined));
});

test("the neighbor in a direction is the one ahead, not one that is nearer aside", () => {
  const here = {x: 0, y: 0};
  const ahead = {x: 200, y: 10};
  const aside = {x: 40, y: 150};
  assert.equal(neighbor([here, ahead, aside], here, [1, 0]), ahead);
  assert.equal(neighbor([here, ahead, aside], here, [0, 1]), aside);
  assert.equal(neighbor([here, ahead, aside], here, [-1, 0]), undefined);
});

test("names cover neither states nor handles nor each other", () => {
  const states = [A, {x: 120, y: 0}, {x: 60, y: 100}];
  const labels = [0, 1, 2, 3].map((key) => ({
    key,
    handle: {x: 60 + 14 * key, y: 40 + 18 * key},
    normal: {x: 0, y: -1},
    sizes: [{width: 60, height: 16}],
  }));
  const found = placeLabels(labels, states);
  assert.equal(found.size, 4);
  const boxes = [...found.values()].map(({middle: {x, y}}) => ({
    left: x - 30,
    right: x + 30,
    top: y - 8,
    bottom: y + 8,
  }));
  for (const [index, one] of boxes.entries()) {
    for (const other of boxes.slice(index + 1)) {
      const wide = Math.min(one.right, other.right) - Math.max(one.left, other.left);
      const high = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
      assert.ok(wide <= 0 || high <= 0, "two names cover each other");
    }
    for (const {handle} of labels) {
      const x = Math.max(one.left, Math.min(handle.x, one.right));
      const y = Math.max(one.top, Math.min(handle.y, one.bottom));
      assert.ok(distance({x, y}, handle) >= HANDLE - 0.1, "a name covers a handle");
    }
  }
});

const SIZES = [
  {width: 300, height: 16},
  {width: 100, height: 16},
];
const boxOf = ({middle: {x, y}, size: {width, height}}) => ({
  left: x - width / 2,
  right: x + width / 2,
  top: y - height / 2,
  bottom: y + height / 2,
});

test("a name is long where there is room, and short where another one, or the edge of the drawing, is near", () => {
  const label = (x) => ({key: x, handle: {x, y: 0}, normal: {x: 0, y: -1}, sizes: SIZES});
  const states = [A, {x: 700, y: 0}];
  assert.equal(placeLabels([label(350)], states).get(350)?.size, SIZES[0]);
  assert.equal(placeLabels([label(700 + 2 * RADIUS)], states).get(700 + 2 * RADIUS)?.size, SIZES[1]);
  const walls = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((row) =>
    [260, 440].map((x) => ({
      ...label(x),
      key: `${x} ${row}`,
      handle: {x, y: 20 * row - 70},
      sizes: [{width: 60, height: 16}],
    })),
  );
  const crowded = placeLabels([...walls, label(350)], states);
  assert.equal(crowded.get(350)?.size, SIZES[1]);
});

test("no arc crosses a name that has a place without one", () => {
  const crossing = arc({x: 200, y: -300}, {x: 200, y: 300}, {x: 200, y: -40});
  const own = arc(A, B, {x: 200, y: 0});
  const labels = [{key: 1, handle: {x: 200, y: 0}, normal: {x: 0, y: -1}, sizes: [SIZES[1]]}];
  const states = [A, B, {x: 200, y: -300}, {x: 200, y: 300}];
  const through = pointsOf(crossing, 4).concat(pointsOf(own, 4));
  const isIn = ({left, right, top, bottom}, {x, y}) => x > left && x < right && y > top && y < bottom;
  const careless = placeLabels(labels, states).get(1);
  assert.ok(through.some((point) => isIn(boxOf(careless), point)));
  const careful = placeLabels(labels, states, {arcs: [own, crossing]}).get(1);
  assert.ok(!through.some((point) => isIn(boxOf(careful), point)));
});

test("no name stands where another handle is nearer, which would seem to have it", () => {
  const labels = [{key: 1, handle: {x: 0, y: 0}, normal: {x: 0, y: -1}, sizes: [{width: 40, height: 20}]}];
  const around = {occupied: [{left: -200, right: 200, top: -15, bottom: 200}]};
  assert.deepEqual(placeLabels(labels, [], around).get(1)?.middle, {x: 0, y: -44});
  const other = {key: 2, handle: {x: 0, y: -64}, normal: {x: 0, y: -1}, sizes: [{width: 0, height: 0}]};
  assert.deepEqual(placeLabels([...labels, other], [], around).get(1)?.middle, {x: 0, y: -24});
});

test("no name stands on other words, and words everywhere end no search", () => {
  const labels = [{key: 1, handle: {x: 200, y: 0}, normal: {x: 0, y: -1}, sizes: [SIZES[1]]}];
  const title = boxOf(placeLabels(labels, [A, B]).get(1));
  const placed = boxOf(placeLabels(labels, [A, B], {occupied: [title]}).get(1));
  assert.ok(placed.top >= title.bottom || placed.bottom <= title.top || placed.left >= title.right);
  const everywhere = {left: -1e6, right: 1e6, top: -1e6, bottom: 1e6};
  assert.deepEqual(boxOf(placeLabels(labels, [A, B], {occupied: [everywhere]}).get(1)), title);
});

test("the points of an arc lie on it, from end to end", () => {
  const curved = arc(A, B, {x: 200, y: 80});
  const points = pointsOf(curved, 10);
  near(points[0], curved.start);
  near(points.at(-1), curved.end);
  assert.ok(points.some((point) => distance(point, {x: 200, y: 80}) < 6));
  for (const [index, point] of points.slice(1).entries()) assert.ok(distance(point, points[index]) < 20);
  assert.deepEqual(pointsOf(arc(undefined, undefined, A), 10), []);
});
