/**
 * A short guided tour through the page.
 *
 * @import {TemplateResult} from "lit"
 */

import {html, render} from "lit";

import {ask} from "../data/commands.js";
import {openNew} from "../data/files.js";
import {keyOf, spoken} from "../kit/keys.js";
import {STOP_KEY} from "../run/stop.js";
import {notify} from "../kit/notices.js";
import {page} from "../data/page.js";
import {started} from "../data/component-status.js";
import {store} from "../data/store.js";
import {laterStyles} from "../kit/theme.js";
import {rich, t} from "../kit/texts.js";

/** @import {Context} from "../kit/registry.js" */

/**
 * An element of the page, and its explanation. `enter` is performed there; with `types` the user types there, so the
 * tour does not take the focus. What it says `otherwise` is shown after that while the example does not run.
 *
 * @typedef {{selector: string, title: string, text: TemplateResult, next?: string, types?: boolean,
 *   enter?: (context: Context) => Promise<unknown>, otherwise?: Pick<Step, "title" | "text">}} Step
 */

const EXAMPLE = "dance_and_follow";
const GAP = 12;

/** @param {string} key */
const kbd = (key) => html`<kbd>${key}</kbd>`;

/** @type {Step[]} */
const STEPS = [
  {
    selector: "hfsm-canvas",
    title: t("The canvas"),
    text: html`${t("Circles are states: blue ones do something, green ones contain another automaton. The double circle is the initial state. Arcs lead from state to state.")}`,
  },
  {
    selector: ".state.parent",
    title: t("Going inside"),
    text: html`${rich("Double-click a green state to see what is inside. {key} leads back up.", {key: kbd(keyOf("up"))})}`,
  },
  {
    selector: "hfsm-tree",
    title: t("The whole tree"),
    text: html`${t("Every automaton with all its states. An element selected here is also selected on the canvas.")}`,
  },
  {
    selector: "hfsm-tools",
    title: t("Drawing"),
    text: html`${rich(
      "Press {state} for a state and {transition} for a transition, or drag from the rim of one state to another. {rename} renames. {undo} undoes any change.",
      {state: kbd("S"), transition: kbd("T"), rename: kbd("F2"), undo: kbd(keyOf("undo"))},
    )}`,
  },
  {
    selector: "hfsm-menubar",
    title: t("Data and code"),
    text: html`${rich("{key} opens the code of the selected element beside the canvas. The menu Data has the parts of the robot that the behavior uses, its cycle, variables and functions.", {key: kbd(keyOf("editCode"))})}`,
  },
  {
    selector: "hfsm-status",
    title: t("Problems"),
    text: html`${t("The document is checked as you draw. Click here for the list of problems; each leads to its place.")}`,
  },
  {
    selector: ".robot-pill",
    title: t("The robot"),
    text: html`${rich("Here you see the present robot, and start a simulated one. If there is none, Run ({key}) starts one automatically. Let us run this behavior.", {key: kbd(keyOf("run"))})}`,
    next: t("Run"),
  },
  {
    selector: ".side",
    title: t("It runs"),
    text: html`${t("The simulation takes some seconds to start. Then the filled state is the current one, and the head follows a ball. Ten seconds later, the robot dances.")}`,
    enter: runExample,
    otherwise: {
      title: t("It does not run"),
      text: html`${rich(
        "If the robot lacks what this behavior needs, the output says so. Choose another robot with {robot}, and press Run ({key}).",
        {robot: kbd(keyOf("robot")), key: kbd(keyOf("run"))},
      )}`,
    },
  },
  {
    selector: ".stop-button",
    title: "STOP",
    text: html`${rich("This stops the robot and everything that runs at once. So does {key}, wherever you are.", {key: kbd(spoken(STOP_KEY))})}`,
  },
  {
    selector: ".side",
    title: t("Change it while it runs"),
    text: html`${rich(
      "This is how long it follows the ball before it dances. Enter a shorter time, and press {key}: the robot continues with the change, without a restart. The help lists all keys: {help}.",
      {key: kbd(keyOf("reload")), help: kbd("?")},
    )}`,
    enter: editExample,
    types: true,
  },
];

/** Run the example instead of what runs, unless a real robot would move. @param {Context} context */
async function runExample({app}) {
  const {status, simulated} = store.robot;
  const mayRun = status !== "present" || simulated;
  if (!mayRun) notify(t("A real robot is connected. Press Run when it may move."));
  await Promise.all([app.showLive("view"), mayRun && runAlone(app)]);
}

/** @param {Context["app"]} app */
async function runAlone(app) {
  const others = store.workspace.tabs.filter(({tab}) => tab !== page.tab && started.isAlive(tab));
  for (const {tab} of others) started.stopHere(tab);
  await Promise.all(others.map(({tab}) => ask("stop", {tab})));
  await (await import("./robot-run.js")).runSimulated(app);
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

/** @param {import("../kit/registry.js").Context} context */
export async function startTour(context) {
  await laterStyles();
  if (page.tabState?.title !== EXAMPLE) await openNew(EXAMPLE);
  const bubble = document.createElement("div");
  bubble.className = "tour";
  bubble.setAttribute("role", "dialog");
  bubble.setAttribute("aria-labelledby", "tour-title");
  const frame = document.createElement("div");
  frame.className = "tour-frame";
  document.body.append(frame, bubble);
  let index = 0;
  let entered = -1;
  const ended = new AbortController();

  const end = () => {
    frame.remove();
    bubble.remove();
    ended.abort();
    context.canvas.focusSelected();
  };
  /** @param {number} step */
  const go = async (step) => {
    index += step;
    if (index >= STEPS.length) return end();
    show();
    const at = index;
    const {enter} = STEPS[at];
    if (step > 0 && enter) {
      await enter(context);
      entered = at;
      if (bubble.isConnected) show(); // the element may have moved
    }
  };
  const show = () => {
    const {selector, next = t("Next"), types, otherwise, ...runs} = STEPS[index];
    const {title, text} = (entered === index && !started.isAlive(page.tab) && otherwise) || runs;
    const last = index === STEPS.length - 1;
    render(
      html`<h2 id="tour-title">${title}</h2>
        <p>${text}</p>
        <div class="steps">
          <span class="count">${t("{number} of {count}", {number: index + 1, count: STEPS.length})}</span>
          ${last ? "" : html`<button type="button" class="button" @click=${end}>${t("End the tour")}</button>`}
          ${index ? html`<button type="button" class="button" @click=${() => go(-1)}>${t("Back")}</button>` : ""}
          <button type="button" class="button primary" @click=${() => go(1)}>${last ? t("Done") : next}</button>
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
  addEventListener("resize", show, ended);
  store.addEventListener("started", () => STEPS[index].otherwise && show(), ended);
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
