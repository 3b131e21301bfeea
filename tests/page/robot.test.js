import assert from "node:assert/strict";
import {test} from "node:test";

import {Socket, STATIC} from "./page.js";

const {store} = await import(new URL("store.js", STATIC).href);
const {shownOf} = await import(new URL("robot.js", STATIC).href);

store.connect();
const socket = Socket.made.at(-1);
socket.open();

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
  const {word, kind} = pushed({status: "present", simulated: true, speed: 1, started: "simulation"});
  assert.deepEqual([word, kind], ["Simulated Nao, 1.0 x", "here"]);
});

test("a real robot is shown by its address, and one of somebody else as a real one", () => {
  assert.equal(pushed({status: "starting", started: "real", name: "nao.local"}).word, "Connecting to nao.local");
  assert.equal(pushed({status: "present", started: "real", name: "nao.local"}).word, "nao.local");
  assert.equal(pushed({status: "present"}).word, "Real Nao");
});

test("a robot that is stopped or lost is not shown as one that works", () => {
  const stopped = pushed({status: "present", simulated: true, stopped: "STOP was pressed"});
  assert.deepEqual([stopped.word, stopped.kind], ["Simulated Nao, stopped", "stopped"]);
  const lost = pushed({status: "lost", since: new Date(2026, 1, 3, 19, 52, 14).getTime() / 1000});
  assert.match(lost.word, /^Robot lost since (19|07):52/);
  assert.equal(lost.kind, "amber");
});
