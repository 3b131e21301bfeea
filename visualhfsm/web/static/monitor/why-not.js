/** "Why not?": what keeps the transitions out of a state from firing, beside the pointer or the selected thing. */

import {html, nothing, render} from "lit";

import {page} from "../page.js";
import {monitor} from "./monitor.js";

const PATIENCE = 220; // ms that the pointer rests before anything is shown
const AGAIN = 400; // ms after which an explanation is asked for again

let element;
let timer = 0;
let shown; // {automaton, transition, spot, pinned}

/**
 * Explain what the pointer rests on, for as long as a component is followed.
 *
 * @param {import("../canvas/canvas.js").HfsmCanvas} canvas
 */
export function explainUnderPointer(canvas) {
  canvas.svg.addEventListener("pointerover", (event) => {
    const group = event.target.closest?.("[data-key]");
    clearTimeout(timer);
    if (shown && !shown.pinned && shown.group !== group) hide();
    if (!group || !isExplained() || event.buttons) return;
    canvas.tip.remove();
    timer = setTimeout(() => show(canvas, group, false), PATIENCE);
  });
  canvas.svg.addEventListener("pointerleave", () => {
    clearTimeout(timer);
    if (!shown?.pinned) hide();
  });
  canvas.svg.addEventListener("pointerdown", () => {
    clearTimeout(timer);
    hide();
  });
  canvas.addEventListener("view", () => hide());
  for (const kind of ["tab", "automaton"]) page.addEventListener(kind, () => hide());
  monitor.addEventListener("mode", () => !isExplained() && hide());
  document.addEventListener(
    "keydown",
    (event) => {
      if (event.key !== "Escape" || !shown) return;
      hide();
      event.preventDefault();
      event.stopPropagation();
    },
    {capture: true},
  );
}

/**
 * Explain the selected state or transition, or the state that the shown automaton is in.
 *
 * @param {import("../canvas/canvas.js").HfsmCanvas} canvas
 */
export function explainSelected(canvas) {
  if (shown?.pinned) return hide();
  const key = canvas.selectedKeys()[0] ?? `s${monitor.now(page.automaton.id)?.state}`;
  const view = canvas.scene.view(key);
  return view && show(canvas, view.group, true);
}

const isExplained = () => monitor.isLive && page.tab === monitor.tab;

async function show(canvas, group, pinned) {
  hide();
  const {key} = group.dataset;
  const id = Number(key.slice(1).replaceAll("'", ""));
  const transition = key.startsWith("t") ? id : 0;
  const now = monitor.now(page.automaton.id);
  if (!now) return;
  const origin = transition ? page.automaton.transitions.find((each) => each.id === transition)?.origin : id;
  if (origin !== now.state) {
    if (pinned) canvas.announce(`The automaton is in ${monitor.stateName(now.id, now.state)} now.`);
    else return;
  }
  const current = {
    canvas,
    group,
    pinned,
    automaton: page.automaton.id,
    transition: origin === now.state ? transition : 0,
  };
  shown = current;
  let said = false;
  while (shown === current && monitor.isLive) {
    let explanation;
    try {
      explanation = await monitor.control("explain", {automaton: current.automaton});
    } catch {
      break; // it is gone; the canvas says so
    }
    if (shown !== current) return;
    // It has left the state.
    if (current.transition && !explanation.transitions.some((each) => each.transition === current.transition)) break;
    draw(current, explanation);
    if (pinned && !said) canvas.announce(explanation.summary);
    said = true;
    await new Promise((resolve) => setTimeout(resolve, AGAIN));
  }
  if (shown === current) hide();
}

function draw({canvas, group, automaton, transition}, explanation) {
  if (!element) {
    element = document.createElement("div");
    element.className = "why-not";
    element.setAttribute("role", "tooltip");
    canvas.append(element);
  }
  const asked = explanation.transitions.filter((each) => !transition || each.transition === transition);
  const state = monitor.stateName(automaton, explanation.state);
  render(
    html`<h3>
        ${transition ? nameOf(automaton, transition) : `In ${state}`}${
          explanation.ghost ? html` <span class="faint">ghost: its state above is not active</span>` : nothing
        }
      </h3>
      ${
        asked.length
          ? html`<ul>
              ${asked.map(
                (each) =>
                  html`<li class=${each.asked ? (each.value ? "true" : "false") : "unasked"}>
                    <span class="verdict-sign" aria-hidden="true">${each.value ? "✓" : "✕"}</span>
                    <span><strong>${transition ? "" : nameOf(automaton, each.transition)}</strong> ${each.reason}</span>
                  </li>`,
              )}
            </ul>`
          : html`<p>${explanation.summary || "No transition leads out of it."}</p>`
      }`,
    element,
  );
  place(group.getBoundingClientRect());
}

function nameOf(automaton, id) {
  const transition = monitor.transition(automaton, id);
  return transition
    ? transition.name || `to ${monitor.stateName(automaton, transition.destination)}`
    : `transition ${id}`;
}

/** Beside what it is about, where there is room. */
function place(box) {
  const {width, height} = element.getBoundingClientRect();
  const middle = Math.min(Math.max(8, box.left + box.width / 2 - width / 2), innerWidth - width - 8);
  const below = box.bottom + 10 + height < innerHeight;
  element.style.left = `${middle}px`;
  element.style.top = `${below ? box.bottom + 10 : Math.max(8, box.top - height - 10)}px`;
}

function hide() {
  shown = undefined;
  element?.remove();
  element = undefined;
}
