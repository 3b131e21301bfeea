/** Conditions of a run: a robot is present, and accepts commands. */

import {ask} from "../data/commands.js";
import {confirm} from "../kit/dialog.js";
import {openNew} from "../data/files.js";
import {notify, notifyError} from "../kit/notices.js";
import {page} from "../data/page.js";
import {connect} from "./robot-menu.js";
import {
  chooseBody,
  chosenBody,
  isElsewhere,
  isReadyFor,
  needsRobot,
  ROBOT,
  robotComes,
  simulate,
  simulationFor,
} from "../data/robot.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";

/** @import {HfsmApp} from "./app.js" */
/** @import {Fields} from "../data/protocol.js" */

const DANCE = "dance";

/** The user's choice when there is no robot; asked only once. @type {string | undefined} */
let chosen;

/**
 * Provide what a document needs to run; asks the user if necessary.
 *
 * @param {Fields} fields of the document
 * @returns {Promise<boolean | "dryRun">} whether it may run, or is to be tried without a robot
 */
export async function settle(fields) {
  if (store.robot.stopped && !(await resetStop())) return false;
  if (!needsRobot(fields)) return true;
  if (isReadyFor(fields)) return true;
  const {status, started, simulation} = store.robot;
  if (["none", "lost", "stopping"].includes(status)) {
    const choice = chosen ?? (await choose());
    if (choice === "connect") {
      await connect().catch(notifyError);
      return false; // the user checks the real robot before the run
    }
    if (!choice) return false;
    if (choice === "dryRun") return choice;
    chosen = choice;
    if (choice === "without") return true;
    return begin(simulate(simulationFor(fields)));
  }
  if (status === "starting" && started === "real") {
    notify(t("The robot is being connected. Press Run when it is there and may move."));
    return false;
  }
  if (isElsewhere(fields)) {
    const choice = await moveTo(fields.world);
    if (choice !== "without") return choice === "restart" && begin(simulate(simulationFor(fields)));
    chooseBody(simulation.body);
    return status === "present" || begin(Promise.resolve());
  }
  if (status !== "present") return begin(Promise.resolve());
  if (!isReadyFor(fields)) await ask("moveBalls", {moving: true});
  return true;
}

/** Open the behavior that ships, and run it on a simulated robot. @param {HfsmApp} app */
export async function watchDance(app) {
  const {status, simulated} = store.robot;
  const isFree = status === "none" || status === "lost";
  const coming = isFree ? begin(simulate()) : Promise.resolve(simulated);
  await openNew(DANCE);
  if (page.tabState?.title !== DANCE) return;
  if (isFree) chosen = "simulate";
  if (await coming) await app.runs.start();
  else if (status === "present") notify(t("A real robot is connected. Press Run when it may move."));
}

/** Run the shown document, on a simulated robot where there is none. @param {HfsmApp} app */
export function runSimulated(app) {
  chosen = "simulate";
  return app.runs.start();
}

/** Wait for the robot that was requested, which a former server may have left stopped. @param {Promise<unknown>} request */
async function begin(request) {
  try {
    await request;
  } catch (error) {
    notifyError(error);
    return false;
  }
  const came = await robotComes();
  if (!came && !store.robot.trouble)
    notify(t("The robot did not appear. Press Run again when it is there."), "error", undefined, {about: ROBOT});
  return came && (!store.robot.stopped || resetStop());
}

const choose = () =>
  confirm({
    title: t("There is no robot here"),
    text: t("Start a simulated one and run? This is asked once."),
    choices: [
      ["without", t("Run anyway")],
      ["connect", t("Use a real one")],
      ["dryRun", t("Try it without one")],
      ["simulate", t("Start and run"), "primary"],
    ],
  });

/** Ask whether the simulation may be another one; a robot that does nothing is exchanged at once. @param {string} world */
async function moveTo(world) {
  const {title, simulation} = store.robot;
  const robot = chosenBody();
  const names = (store.workspace.present ?? []).map(({component}) => component).join(", ");
  const isOther = robot !== simulation.body;
  if (isOther && !names) return "restart";
  return confirm({
    title: isOther ? t("Another robot is chosen") : t("The simulation has another world"),
    text: isOther
      ? t("{names} runs on {title}. Restart the simulation with {robot} and run?", {names, title, robot})
      : t("This behavior is made for the world {world}. Restart the simulation there and run?", {world}),
    choices: [
      ["without", t("Run here")],
      ["restart", t("Restart and run"), "primary"],
    ],
  });
}

async function resetStop() {
  const choice = await confirm({
    title: t("The robot is stopped"),
    text: t("It refuses commands: {reason}. Check the robot first.", {reason: store.robot.stopped}),
    choices: [["reset", t("Reset the emergency stop and run"), "primary"]],
  });
  if (choice !== "reset") return false;
  return (await ask("resetEmergencyStop")) !== undefined;
}
