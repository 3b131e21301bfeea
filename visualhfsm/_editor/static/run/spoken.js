/**
 * Say what a run does, for users of screen readers: how it is at once, and every few seconds where its root is.
 *
 * The bar says more, such as how long something hangs, which would be read once a second. Errors are notices.
 */

import {started} from "../data/component-status.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {statusOf} from "./bar.js";
import {monitor} from "./monitor.js";

const PAUSE = 4000; // ms between two states
/** @type {Record<string, string>} */
const STARTS = {generating: t("Starting"), starting: t("Starting"), stopping: t("Stopping")};

/** A region that screen readers read when a part of it changes, and only that part. */
const region = document.createElement("div");
const [status, place] = [document.createElement("span"), document.createElement("span")];

let last = -Infinity;
let later = 0;

/** How the run of the shown document is. */
function spokenStatus() {
  const run = started.of(page.tab);
  if (!monitor.component || !monitor.isShownBeside(page.tab)) return STARTS[run?.status ?? ""] ?? "";
  const {word, spoken = word} = statusOf();
  return spoken;
}

/** The current state of the root that runs now. */
function spokenPlace() {
  if (!monitor.component || !monitor.isLive || monitor.ended || !monitor.newest) return "";
  const {id = 0} = monitor.structure?.automata.find(({parent}) => !parent) ?? {};
  const root = monitor.newest.component.automata.find((each) => each.id === id);
  return root ? t("in {state}", {state: monitor.stateName(root.id, root.state)}) : "";
}

/** @param {HTMLElement} element @param {string} text */
function write(element, text) {
  if (element.textContent === text) return false;
  element.textContent = text;
  return true;
}

function look() {
  write(status, spokenStatus());
  if (later || place.textContent === spokenPlace()) return;
  later = window.setTimeout(
    () => {
      later = 0;
      if (write(place, spokenPlace())) last = performance.now();
    },
    Math.max(0, last + PAUSE - performance.now()),
  );
}

region.className = "for-readers";
region.setAttribute("role", "status");
region.setAttribute("aria-atomic", "false");
region.append(status, " ", place);
document.body.append(region);
for (const kind of /** @type {const} */ (["mode", "snapshot", "structure"])) monitor.addEventListener(kind, look);
store.addEventListener("started", look);
page.addEventListener("tab", look);
setTimeout(look, 100); // readers know the region by then
