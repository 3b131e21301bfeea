/**
 * A short guided tour through the page.
 *
 * @import {TemplateResult} from "lit"
 */

import {html, render} from "lit";

import {openNew} from "./files.js";
import {keyOf, spoken} from "./keys.js";
import {STOP_KEY} from "./monitor/stop.js";
import {notify} from "./notices.js";
import {page} from "./page.js";
import {store} from "./store.js";
import {laterStyles} from "./styles.js";

await laterStyles();

/** @import {Context} from "./registry.js" */

/**
 * An element of the page, and its explanation. `enter` is performed there; with `types` the user types there, so the
 * tour does not take the focus.
 *
 * @typedef {{selector: string, title: string, text: TemplateResult, next?: string, types?: boolean,
 *   enter?: (context: Context) => Promise<unknown>}} Step
 */

const EXAMPLE = "dance_and_follow";
const GAP = 12;

/** @type {Step[]} */
const STEPS = [
  {
    selector: "hfsm-canvas",
    title: "The canvas",
    text: html`Circles are states: blue ones do something, green ones contain another automaton. The double circle is
    the initial state. Arcs lead from state to state.`,
  },
  {
    selector: ".state.parent",
    title: "Going inside",
    text: html`Double-click a green state to see what is inside. <kbd>${keyOf("up")}</kbd> leads back up.`,
  },
  {
    selector: "hfsm-tree",
    title: "The whole tree",
    text: html`Every automaton with all its states. An element selected here is also selected on the canvas.`,
  },
  {
    selector: "hfsm-tools",
    title: "Drawing",
    text: html`Press <kbd>S</kbd> for a state and <kbd>T</kbd> for a transition, or drag from the rim of one state to
      another. <kbd>F2</kbd> renames. <kbd>${keyOf("undo")}</kbd> undoes any change.`,
  },
  {
    selector: "hfsm-menubar",
    title: "Data and code",
    text: html`<kbd>${keyOf("editCode")}</kbd> opens the code of the selected element beside the canvas. The menu Data
      has the parts of the robot that the component uses, its cycle, variables and functions.`,
  },
  {
    selector: "hfsm-status",
    title: "Problems",
    text: html`The document is checked as you draw. Click here for the list of problems; each leads to its place.`,
  },
  {
    selector: ".robot-pill",
    title: "The robot",
    text: html`Here you see the present robot, and start a simulated one. If there is none, Run
    (<kbd>${keyOf("run")}</kbd>) starts one automatically. Let us run this behavior.`,
    next: "Run",
  },
  {
    selector: ".side",
    title: "It runs",
    text: html`The simulation takes some seconds to start. Then the filled state is the current one, and the head
    follows a ball. Ten seconds later, the robot dances.`,
    enter: runExample,
  },
  {
    selector: ".stop-button",
    title: "STOP",
    text: html`This stops the robot and everything that runs at once. So does <kbd>${spoken(STOP_KEY)}</kbd>, wherever
      you are.`,
  },
  {
    selector: ".side",
    title: "Change it while it runs",
    text: html`This is how long it follows the ball before it dances. Enter a shorter time, and press
      <kbd>${keyOf("reload")}</kbd>: the robot continues with the change, without a restart. The help lists all keys:
      <kbd>?</kbd>.`,
    enter: editExample,
    types: true,
  },
];

/** Run the example, unless a real robot would move. @param {Context} context */
async function runExample({app}) {
  const {status, simulated} = store.robot;
  const mayRun = status !== "present" || simulated;
  if (!mayRun) notify("A real robot is connected. Press Run when it may move.");
  await Promise.all([app.showLive("view"), mayRun && (await import("./robot-run.js")).runSimulated(app)]);
}

/** Show how long the example follows the ball. @param {Context} context */
async function editExample({app}) {
  const root = [...(page.document?.automata.values() ?? [])].find((each) => !each.father);
  const initial = root?.states.find((each) => each.initial);
  const timed = root?.transitions.find((each) => each.type === "time" && each.origin === initial?.id);
  if (!root || !timed) return;
  page.open(root.id, {transitions: [timed.id]});
  await app.showSide("hfsm-code-panel");
  page.edit({kind: "transition", automaton: root.id, id: timed.id, part: "trigger"});
}

/** @param {import("./registry.js").Context} context */
export async function startTour(context) {
  if (page.tabState?.title !== EXAMPLE) await openNew(EXAMPLE);
  const bubble = document.createElement("div");
  bubble.className = "tour";
  bubble.setAttribute("role", "dialog");
  bubble.setAttribute("aria-labelledby", "tour-title");
  const frame = document.createElement("div");
  frame.className = "tour-frame";
  document.body.append(frame, bubble);
  let index = 0;

  const end = () => {
    frame.remove();
    bubble.remove();
    removeEventListener("resize", show);
    context.canvas.focusSelected();
  };
  /** @param {number} step */
  const go = async (step) => {
    index += step;
    if (index >= STEPS.length) return end();
    show();
    const {enter} = STEPS[index];
    if (step > 0 && enter) {
      await enter(context);
      if (bubble.isConnected) show(); // the element may have moved
    }
  };
  const show = () => {
    const {selector, title, text, next = "Next", types} = STEPS[index];
    const last = index === STEPS.length - 1;
    render(
      html`<h2 id="tour-title">${title}</h2>
        <p>${text}</p>
        <div class="steps">
          <span class="count">${index + 1} of ${STEPS.length}</span>
          ${last ? "" : html`<button type="button" class="button" @click=${end}>End</button>`}
          ${index ? html`<button type="button" class="button" @click=${() => go(-1)}>Back</button>` : ""}
          <button type="button" class="button primary" @click=${() => go(1)}>${last ? "Done" : next}</button>
        </div>`,
      bubble,
    );
    place(document.querySelector(selector) ?? context.canvas, frame, bubble);
    if (!types) /** @type {HTMLElement | null} */ (bubble.querySelector(".primary"))?.focus();
  };
  bubble.addEventListener("keydown", (event) => {
    const step = /** @type {Record<string, number>} */ ({ArrowRight: 1, ArrowLeft: -1})[event.key];
    if (event.key === "Escape") end();
    else if (step && index + step >= 0) go(step);
    else if (event.key !== "Tab") {
      event.stopPropagation(); // keys of the page wait until the tour is over
      return;
    } else {
      const buttons = [...bubble.querySelectorAll("button")];
      const at = buttons.findIndex((each) => each === document.activeElement);
      buttons.at((at + (event.shiftKey ? -1 : 1)) % buttons.length)?.focus();
    }
    event.preventDefault();
    event.stopPropagation();
  });
  addEventListener("resize", show);
  show();
}

/**
 * Place the frame around an element, and the bubble on the side with the most room.
 *
 * @param {Element} element
 * @param {HTMLElement} frame
 * @param {HTMLElement} bubble
 */
function place(element, frame, bubble) {
  const box = element.getBoundingClientRect();
  const {width, height} = bubble.getBoundingClientRect();
  Object.assign(frame.style, {
    left: `${box.left - 4}px`,
    top: `${box.top - 4}px`,
    width: `${box.width + 8}px`,
    height: `${box.height + 8}px`,
  });
  /** @param {number} value @param {number} size @param {number} most */
  const within = (value, size, most) => Math.max(GAP, Math.min(value, most - size - GAP));
  const rooms = [
    [innerWidth - box.right, box.right + GAP, box.top],
    [box.left, box.left - width - GAP, box.top],
    [innerHeight - box.bottom, box.left, box.bottom + GAP],
    [box.top, box.left, box.top - height - GAP],
  ];
  const beside = rooms.find(([room], side) => room > (side < 2 ? width : height) + 2 * GAP) ?? [
    0,
    box.left + (box.width - width) / 2,
    box.top + GAP,
  ];
  bubble.style.left = `${within(beside[1], width, innerWidth)}px`;
  bubble.style.top = `${within(beside[2], height, innerHeight)}px`;
}
