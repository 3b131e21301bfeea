import assert from "node:assert/strict";
import {test} from "node:test";

import {Socket, STATIC} from "./page.js";

const {store} = await import(new URL("data/store.js", STATIC).href);
const {
  chooseBody,
  chosenBody,
  isElsewhere,
  isReadyFor,
  lackingOf,
  needsRobot,
  robotComes,
  shownOf,
  simulate,
  simulationFor,
} = await import(new URL("data/robot.js", STATIC).href);

store.connect();
const socket = Socket.made.at(-1);
socket.open();
socket.push({re: socket.sent[0].id, ok: {}});

/** What is shown after a push of the robot. @param {object} robot */
function pushed(robot) {
  socket.push({push: "robot", ...robot});
  return shownOf(store.robot);
}

test("a realm without a robot offers a simulation", () => {
  assert.deepEqual(pushed({}), {word: "No robot: start a simulation", short: "No robot", kind: "none"});
});

test("a simulation is shown with its speed as measured", () => {
  assert.equal(pushed({status: "starting", started: "simulation"}).word, "Starting the simulation");
  const {word, kind} = pushed({
    status: "present",
    simulated: true,
    title: "Booster T1",
    speed: 1,
    started: "simulation",
  });
  assert.deepEqual([word, kind], ["Simulated Booster T1, 1.0 x", "here"]);
});

test("a real robot is shown by its address, and one of somebody else as a real one", () => {
  assert.equal(pushed({status: "starting", started: "real", name: "nao.local"}).word, "Connecting to nao.local");
  assert.equal(pushed({status: "present", started: "real", name: "nao.local"}).word, "nao.local");
  assert.equal(pushed({status: "present", title: "Nao H25"}).word, "Real Nao H25");
  assert.equal(pushed({status: "present"}).word, "Real robot");
});

test("a robot that is stopped or lost is not shown as one that works", () => {
  const stopped = pushed({status: "present", simulated: true, title: "Nao H25", stopped: "STOP was pressed"});
  assert.deepEqual([stopped.word, stopped.kind], ["Simulated Nao H25, stopped", "stopped"]);
  const lost = pushed({status: "lost", since: new Date(2026, 1, 3, 19, 52, 14).getTime() / 1000});
  assert.match(lost.word, /^Robot lost since (19|7):52/);
  assert.equal(lost.kind, "amber");
});

const uses = (...types) => ({world: "", interfaces: types.map((type) => ({name: type, type}))});
const FOLLOWS = uses("PoseHead", "Camera");
const DANCES = uses("Pose3DMotors");

test("the robot that was chosen is simulated, as long as there is such a body", async () => {
  store.greeting.bodies = [
    {name: "H25", title: "Nao H25"},
    {name: "T1", title: "Booster T1"},
  ];
  pushed({simulation: {world: "empty", speed: "2", balls: false, body: "H25"}});
  assert.equal(chosenBody(), "H25");
  chooseBody("T1");
  assert.equal(chosenBody(), "T1");
  const asked = simulate({speed: "1"});
  const {id, op, body, world, speed} = socket.sent.at(-1);
  assert.deepEqual([op, body, world, speed], ["simulate", "T1", "empty", "1"]);
  socket.push({re: id, ok: null});
  await asked;
  store.greeting.bodies = [{name: "Cart", title: "Cart"}];
  assert.equal(chosenBody(), "Cart");
  store.greeting.bodies = [];
  assert.equal(chosenBody(), "");
});

test("a document is not ready on a simulation of another robot than the chosen one", () => {
  store.greeting.bodies = [
    {name: "H25", title: "Nao H25"},
    {name: "T1", title: "Booster T1"},
  ];
  const here = {status: "present", simulation: {world: "balls", speed: "1", balls: false, body: "H25"}};
  pushed({...here, started: "simulation"});
  chooseBody("T1");
  assert.deepEqual([isElsewhere(DANCES), isReadyFor(DANCES)], [true, false]);
  chooseBody("H25");
  assert.deepEqual([isElsewhere(DANCES), isReadyFor(DANCES)], [false, true]);
  chooseBody("T1");
  pushed(here); // it was not started here, and is not exchanged
  assert.equal(isReadyFor(DANCES), true);
  store.greeting.bodies = [];
});

test("what a robot lacks is known once it has announced what it serves", () => {
  const needs = [{identity: "Head"}, {identity: "Camera"}, {identity: "Head@elsewhere"}];
  pushed({status: "present", serves: ["Head", "Safety"]});
  assert.deepEqual(lackingOf(needs), ["Camera"]);
  pushed({status: "present"});
  assert.deepEqual(lackingOf(needs), []);
  pushed({status: "lost", serves: ["Head", "Safety"]});
  assert.deepEqual(lackingOf(needs), []);
});

test("a document that looks for a ball gets balls that move", () => {
  assert.deepEqual(simulationFor(FOLLOWS), {world: "balls", balls: true});
  assert.deepEqual(simulationFor(uses("jderobot::CameraPrx")), {world: "balls", balls: true});
  assert.deepEqual(simulationFor(DANCES), {});
});

test("a document that names a world gets it, and is not ready in another one", () => {
  const plays = {...FOLLOWS, world: "soccer"};
  assert.deepEqual(simulationFor(plays), {world: "soccer", balls: false});
  const here = {status: "present", simulated: true, started: "simulation"};
  pushed({...here, simulation: {world: "balls", speed: "1", balls: false, body: "H25"}});
  assert.deepEqual([isElsewhere(plays), isReadyFor(plays)], [true, false]);
  pushed({...here, simulation: {world: "soccer", speed: "1", balls: false, body: "H25"}});
  assert.deepEqual([isElsewhere(plays), isReadyFor(plays)], [false, true]);
  pushed({...here, started: ""}); // nobody knows the world of a robot that was not started here
  assert.equal(isReadyFor(plays), true);
});

test("a document that uses no robot runs without one", () => {
  pushed({});
  assert.equal(needsRobot(uses()), false);
  assert.equal(isReadyFor(uses()), true);
  assert.equal(isReadyFor(DANCES), false);
});

test("a robot that is stopped or lost, or whose balls stand still, is not ready", () => {
  const here = {status: "present", simulated: true, started: "simulation", hasBalls: true};
  pushed(here);
  assert.deepEqual([isReadyFor(DANCES), isReadyFor(FOLLOWS)], [true, false]);
  pushed({...here, simulation: {world: "balls", speed: "1", balls: true}});
  assert.equal(isReadyFor(FOLLOWS), true);
  pushed({...here, started: ""}); // somebody else decides about these balls
  assert.equal(isReadyFor(FOLLOWS), true);
  pushed({...here, stopped: "STOP was pressed"});
  assert.equal(isReadyFor(DANCES), false);
  pushed({status: "lost", since: 1});
  assert.equal(isReadyFor(DANCES), false);
});

test("a robot is awaited until it is there or will not come", async () => {
  pushed({status: "starting", started: "simulation"});
  const coming = robotComes();
  pushed({status: "starting", started: "simulation", speed: 1});
  pushed({status: "present", started: "simulation"});
  assert.equal(await coming, true);
  pushed({status: "starting", started: "simulation"});
  const failing = robotComes();
  pushed({trouble: "mujoco is not installed"});
  assert.equal(await failing, false);
});
