/**
 * A short guided tour through the page.
 *
 * @import {TemplateResult} from "lit"
 */

import {html, render} from "lit";

import {openNew} from "./files.js";
import {keyOf} from "./keys.js";
import {page} from "./page.js";

const EXAMPLE = "dance_and_follow";
const GAP = 12;

/** The elements of the tour, with their texts. @type {[selector: string, title: string, text: TemplateResult][]} */
const STEPS = [
  [
    "hfsm-canvas",
    "The canvas",
    html`Circles are states: blue ones do something, green ones contain another automaton. The double circle is the
    initial state. Arcs lead from state to state.`,
  ],
  [
    ".state.parent",
    "Going inside",
    html`Double-click a green state to see what is inside. <kbd>${keyOf("up")}</kbd> leads back up.`,
  ],
  [
    "hfsm-tree",
    "The whole tree",
    html`Every automaton with all its states. A selection here is also the selection on the canvas.`,
  ],
  [
    '[aria-label="Figures"]',
    "Drawing",
    html`Press <kbd>S</kbd> for a state and <kbd>T</kbd> for a transition, or drag from the rim of one state to another.
      <kbd>F2</kbd> renames.`,
  ],
  [
    '[aria-label="Automaton data"]',
    "Data and code",
    html`<kbd>${keyOf("editCode")}</kbd> opens the code of what is selected beside the canvas. Here are the servants
      that the component uses, its cycle, variables and functions.`,
  ],
  [
    ".live-bar",
    "Run and stop",
    html`Run writes the component as Python and starts it. Then the canvas shows which states are current. The red
      <strong>STOP</strong> stops the robot and all that runs, at any time.`,
  ],
  [
    "hfsm-status",
    "Problems",
    html`The document is checked as you draw. Click here for the list of problems; each leads to its place.`,
  ],
  [
    ".toolbar",
    "Every step can be undone",
    html`<kbd>${keyOf("undo")}</kbd> undoes any change, in any automaton. All keys are listed in the help: press
      <kbd>?</kbd>.`,
  ],
];

/** @param {import("./actions.js").Context} context */
export async function startTour(context) {
  if (!page.document) await openNew(EXAMPLE);
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
  const go = (step) => {
    index += step;
    if (index >= STEPS.length) end();
    else show();
  };
  const show = () => {
    const [selector, title, text] = STEPS[index];
    const last = index === STEPS.length - 1;
    render(
      html`<h2 id="tour-title">${title}</h2>
        <p>${text}</p>
        <div class="steps">
          <span class="count">${index + 1} of ${STEPS.length}</span>
          ${last ? "" : html`<button type="button" class="button" @click=${end}>End</button>`}
          ${index ? html`<button type="button" class="button" @click=${() => go(-1)}>Back</button>` : ""}
          <button type="button" class="button primary" @click=${() => go(1)}>${last ? "Done" : "Next"}</button>
        </div>`,
      bubble,
    );
    place(document.querySelector(selector) ?? context.canvas, frame, bubble);
    /** @type {HTMLElement | null} */ (bubble.querySelector(".primary"))?.focus();
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
 * Put the frame around an element, and the bubble beside it where there is most room.
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
