/**
 * The operator's stop button: it asks no question, does not wait, and works in every mode.
 *
 * @typedef {import("../data/messages.js").Answers["emergencyStop"]} Stopped
 */

import {socketAddress} from "../kit/address.js";
import {clearErrors, messageOf, notify} from "../kit/notices.js";
import {started} from "../data/started.js";
import {store} from "../data/store.js";
import {language, t} from "../kit/texts.js";
import {monitor} from "./monitor.js";

/** Three keys at once, among them the largest: easy to find, and not hit by accident while typing. */
export const STOP_KEY = "Ctrl+Shift+Space";

const LATE = 3000; // ms: by then the components have ended, and a robot nearby has confirmed
const LATEST = 15_000; // ms: then the server does not answer

/** What the errors of a stop are about: those of an earlier one go. */
const STOP = "stop";
/** @param {string} text */
const report = (text) => notify(text, "error", undefined, {about: STOP});

/** Those that STOP has not ended yet, each with what takes back the error that says so. @type {Map<string, () => void>} */
const late = new Map();

/** Stop by a connection for that alone, which a page may open even when it is locked out. @returns {Promise<Stopped>} */
const stopAside = () =>
  new Promise((resolve, reject) => {
    const socket = new WebSocket(socketAddress(`stop?language=${language}`));
    const fail = () => reject(new Error(store.whyOffline));
    socket.addEventListener("message", ({data}) => resolve(JSON.parse(data).ok));
    socket.addEventListener("close", fail);
    setTimeout(fail, LATEST);
  });

/** Stop the robot and all that runs, whatever is shown. */
export async function stopRobot() {
  clearErrors(STOP);
  late.clear();
  started.stopHere();
  const running = monitor.present;
  let confirmed = () => {};
  const isLate = t(
    "STOP is not confirmed yet, and repeated. If the robot moves, use its own button, or `nao stop` in a terminal.",
  );
  const timer = setTimeout(() => (confirmed = report(isLate)), LATE);
  try {
    const {stopped, failed} = await (store.online ? store.request("emergencyStop") : stopAside());
    const problems = [];
    for (const [name, reason] of Object.entries(failed)) {
      const problem = `${name}: ${reason}`;
      if (monitor.present.includes(name)) late.set(name, report(t("Not stopped. {problems}", {problems: problem})));
      else problems.push(problem);
    }
    const hung = started.failed(monitor.tab)?.component === monitor.component; // and where is said already
    if (stopped.includes(monitor.component) && !hung) monitor.end(t("it was stopped by STOP"));
    const names = stopped.filter((name) => running.includes(name)).join(", ");
    const ended = names && t("Ended: {names}.", {names});
    const parts = stopped.filter((name) => !running.includes(name)).join(", ");
    const still = parts && (problems.length ? t("Stopped: {names}.", {names: parts}) : t("The robot stands still."));
    if (stopped.length) notify(`${still} ${ended}`.trim());
    else if (!problems.length && !late.size)
      report(t("There was nothing to stop: no robot is here, and nothing runs."));
    if (problems.length) report(t("Not stopped. {problems}", {problems: problems.join("; ")}));
  } catch (error) {
    const reason = messageOf(error);
    report(t("STOP did not reach the robot: {reason} Use its own button, or `nao stop` in a terminal.", {reason}));
  } finally {
    clearTimeout(timer);
    confirmed();
  }
}

/** Say of those that ended late that they have ended. */
function look() {
  for (const [name, takeBack] of late) {
    if (monitor.present.includes(name)) continue;
    late.delete(name);
    takeBack();
    notify(t("{name} has ended, too.", {name}));
  }
}

/** Listen before all others, also while an open dialog keeps the button behind it from being pressed. */
export function listenForStop() {
  monitor.addEventListener("present", look);
  window.addEventListener(
    "pointerdown",
    (event) => {
      const {target, clientX: x, clientY: y} = event;
      if (!(target instanceof HTMLDialogElement) || isInside(target, x, y)) return;
      const button = document.querySelector(".stop-button");
      if (!button || !isInside(button, x, y)) return;
      event.stopImmediatePropagation();
      stopRobot();
    },
    {capture: true},
  );
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.code !== "Space" || !event.shiftKey || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault(); // while the key is held down, too: the button with the focus must not be pressed
      event.stopImmediatePropagation();
      if (!event.repeat) stopRobot();
    },
    {capture: true},
  );
}

/** @param {Element} element @param {number} x @param {number} y */
function isInside(element, x, y) {
  const {left, right, top, bottom} = element.getBoundingClientRect();
  return x >= left && x < right && y >= top && y < bottom;
}
