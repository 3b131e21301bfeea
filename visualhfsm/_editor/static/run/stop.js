/**
 * The operator's stop button: it asks no question, does not wait, and works in every mode.
 *
 * @typedef {import("../data/protocol.js").Answers["emergencyStop"]} Stopped
 */

import {socketAddress} from "../kit/location.js";
import {clearErrors, messageOf, notify} from "../kit/notices.js";
import {started} from "../data/component-status.js";
import {store} from "../data/store.js";
import {language, t} from "../kit/texts.js";
import {monitor} from "./monitor.js";

/** Three keys at once, among them the largest: easy to find, and not hit by accident while typing. */
export const STOP_KEY = "Ctrl+Shift+Space";

const LATE = 3000; // ms: by then the components have ended, and a robot nearby has confirmed
const LATEST = 15_000; // ms: then the server does not answer, though it may still do so

/** What the errors of a stop are about: those of an earlier one go. */
const STOP = "stop";
/** @param {string} text */
const report = (text) => notify(text, "error", undefined, {about: STOP});

/** Those that STOP has not ended yet, each with what takes back the error that says so. @type {Map<string, () => void>} */
const late = new Map();

/**
 * Stop by a connection for that alone, which waits for no other request.
 *
 * @param {() => void} heard called when the server has the request, and repeats the stop
 * @returns {Promise<Stopped>}
 */
const stopAside = (heard) =>
  new Promise((resolve, reject) => {
    const socket = new WebSocket(socketAddress(`stop?language=${language}`));
    socket.addEventListener("open", heard);
    socket.addEventListener("message", ({data}) => resolve(JSON.parse(data).ok));
    socket.addEventListener("close", () => reject(new Error(store.whyOffline)));
  });

const REPEATED = t(
  "STOP is not confirmed yet, and repeated. If the robot moves, use its own button, or `nao stop` in a terminal.",
);
const SILENT = t(
  "STOP is not confirmed yet: the editor does not answer, and is asked in a second way. If the robot moves, use its own button, or `nao stop` in a terminal.",
);
/** @param {string} reason */
const unreached = (reason) =>
  t("STOP did not reach the robot: {reason} Use its own button, or `nao stop` in a terminal.", {reason});

/**
 * Ask for a stop; in a second way, too, as soon as the first is silent or breaks.
 *
 * @param {(text: string) => void} say why there is no answer yet, in place of what was said before
 * @returns {Promise<Stopped>} the first answer, however late it comes
 */
async function askForStop(say) {
  let [isLate, isHeard] = [false, false];
  const tell = () => isLate && say(isHeard ? REPEATED : SILENT);
  /** @type {Promise<Stopped> | undefined} */
  let second;
  const aside = () =>
    (second ??= stopAside(() => {
      isHeard = true;
      tell();
    }));
  const first = store.online ? store.request("emergencyStop").catch(aside) : aside();
  const silence = new Promise((resolve) => setTimeout(resolve, LATE));
  const latest = setTimeout(() => isHeard || say(unreached(t("The editor does not answer."))), LATEST);
  try {
    const answer = await Promise.race([first, silence]);
    if (answer) return answer;
    isLate = true;
    tell();
    return await Promise.race([first, aside().catch(() => first)]);
  } finally {
    clearTimeout(latest);
  }
}

/** Stop the robot and all that runs, whatever is shown. */
export async function stopRobot() {
  clearErrors(STOP);
  late.clear();
  started.stopHere();
  const running = [...monitor.present, ...started.names];
  let takeBack = () => {};
  /** @param {string} text */
  const say = (text) => {
    takeBack();
    takeBack = report(text);
  };
  try {
    const {stopped, failed} = await askForStop(say);
    takeBack();
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
    say(unreached(messageOf(error)));
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
