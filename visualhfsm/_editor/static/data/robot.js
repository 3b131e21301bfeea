/** The robot of the realm in words, and requests for a robot. */

import {browserStorage} from "../kit/location.js";
import {store} from "./store.js";
import {decimal, language, t} from "../kit/texts.js";

/**
 * @import {Fields} from "./protocol.js"
 * @import {Robot} from "./store.js"
 */

/** A time of the day without its seconds. @param {number} seconds since 1970 */
const minutes = (seconds) => new Date(seconds * 1000).toLocaleTimeString(language, {timeStyle: "short"});

/**
 * The status of a robot: in words, in fewer words for narrow windows, and as a color.
 *
 * @param {Robot} robot
 * @returns {{word: string, short: string, kind: "none" | "busy" | "here" | "amber" | "stopped"}}
 */
export function shownOf(robot) {
  const {status, simulated, name, title, speed, since, stopped, started} = robot;
  switch (status) {
    case "present": {
      const found = simulated
        ? title
          ? t("Simulated {title}", {title})
          : t("Simulated robot")
        : name || (title ? t("Real {title}", {title}) : t("Real robot"));
      if (stopped) return {word: t("{robot}, stopped", {robot: found}), short: t("Stopped"), kind: "stopped"};
      const pace = simulated && speed ? `, ${decimal(speed, 1)} x` : "";
      return {word: `${found}${pace}`, short: simulated ? t("Simulated") : title || t("Robot"), kind: "here"};
    }
    case "starting":
      return {
        word: started === "real" ? t("Connecting to {name}", {name}) : t("Starting the simulation"),
        short: t("Starting"),
        kind: "busy",
      };
    case "stopping":
      return {
        word: simulated ? t("Stopping the simulation") : t("Stopping the robot"),
        short: t("Stopping"),
        kind: "busy",
      };
    case "lost":
      return {word: t("Robot lost since {time}", {time: minutes(since)}), short: t("Robot lost"), kind: "amber"};
    default:
      return {word: t("No robot: start a simulation"), short: t("No robot"), kind: "none"};
  }
}

const BODY = "visualhfsm.body";

/** What errors are about that end when a robot is there. */
export const ROBOT = "robot";

/** The bodies that can be simulated. */
export const bodies = () => store.greeting.bodies ?? [];

/** The body of the next simulation, or of a dry run: the chosen one, as long as there is such a body. */
export function chosenBody() {
  const wanted = [browserStorage.getItem(BODY), store.robot.simulation.body];
  return wanted.find((each) => bodies().some(({name}) => name === each)) ?? bodies().at(0)?.name ?? "";
}

/** Choose the body of the next simulation. @param {string} name */
export function chooseBody(name) {
  browserStorage.setItem(BODY, name);
  store.dispatchEvent(new CustomEvent("robot", {detail: {push: "robot", ...store.robot}}));
}

/** Request a simulation like the last one, of the chosen body. @param {object} [changes] to it */
export function simulate(changes = {}) {
  const {body: _, ...others} = store.robot.simulation;
  const body = chosenBody();
  return store.request("simulate", {...others, ...(body && {body}), ...changes});
}

const LONGEST_START = 60_000; // ms

/** Whether a document uses parts of a robot. @param {Fields} fields */
export const needsRobot = ({interfaces}) => interfaces.length > 0;

/** What the present robot lacks of the servants in its realm that something needs. @param {{identity: string}[]} needs */
export function lackingOf(needs) {
  const {status, serves} = store.robot;
  if (status !== "present" || !serves.length) return [];
  return needs.map(({identity}) => identity).filter((each) => /^[\w.]+$/.test(each) && !serves.includes(each));
}

/** Whether a document uses eyes or a camera, probably to look for a ball. @param {Fields} fields */
const looks = ({interfaces}) => interfaces.some(({type}) => /\b(Camera|Sight)(Prx)?$/.test(type));

/**
 * The simulation that a document needs: in its world; without one, a document that looks for a ball gets moving balls.
 *
 * @param {Fields} fields
 */
export function simulationFor(fields) {
  if (fields.world) return {world: fields.world, balls: fields.world === "balls" && looks(fields)};
  return looks(fields) ? {world: "balls", balls: true} : {};
}

/** Whether the simulation that was started here is not of the chosen robot, or not in the world of a document. @param {Fields} fields */
export function isElsewhere({world}) {
  const {started, simulation} = store.robot;
  const isThere = ["", simulation.world].includes(world) && ["", simulation.body].includes(chosenBody());
  return started === "simulation" && !isThere;
}

/** Whether a document can run at once: its robot is present and accepts commands. @param {Fields} fields */
export function isReadyFor(fields) {
  const {status, stopped, started, hasBalls, simulation} = store.robot;
  if (!needsRobot(fields)) return true;
  const misses = started === "simulation" && hasBalls && looks(fields) && !simulation.balls;
  return status === "present" && !stopped && !misses && !isElsewhere(fields);
}

/** Wait until the robot that is being started is present. @returns {Promise<boolean>} whether it is */
export function robotComes() {
  return new Promise((resolve) => {
    const ended = new AbortController();
    const end = () => {
      ended.abort();
      clearTimeout(timer);
      resolve(store.online && store.robot.status === "present");
    };
    const look = () => {
      if (!store.online || store.robot.status !== "starting") end();
    };
    const timer = setTimeout(end, LONGEST_START);
    store.addEventListener("robot", look, {signal: ended.signal});
    store.addEventListener("connection", look, {signal: ended.signal});
    look();
  });
}
