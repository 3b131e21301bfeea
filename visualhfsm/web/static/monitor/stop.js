/** The operator's stop button: it asks no question, does not wait, and works in every mode. */

import {messageOf, notify} from "../notices.js";
import {monitor} from "./monitor.js";

/** Three keys at once, among them the largest: easy to find, and not hit by accident while typing. */
export const STOP_KEY = "Ctrl+Shift+Space";

/** Stop the robot, whatever is shown, and the followed component. */
export async function stopRobot() {
  try {
    const {stopped, failed} = await monitor.control("emergencyStop");
    const problems = Object.entries(failed).map(([name, reason]) => `${name}: ${reason}`);
    if (stopped.includes(monitor.component)) monitor.end("it was stopped by STOP");
    if (stopped.length) notify(`Stopped: ${stopped.join(", ")}.`);
    else if (!problems.length)
      notify("There was nothing to stop: neither a robot nor a component is present.", "error");
    if (problems.length) notify(`Not stopped. ${problems.join("; ")}`, "error");
  } catch (error) {
    notify(`STOP did not reach the robot: ${messageOf(error)} Use the robot's own button.`, "error");
  }
}

/** Listen before everybody else, also while a dialog is open. */
export function listenForStop() {
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.code !== "Space" || !event.shiftKey || !(event.ctrlKey || event.metaKey) || event.repeat) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      stopRobot();
    },
    {capture: true},
  );
}
