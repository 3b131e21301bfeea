/**
 * "Why not?": what keeps the transitions out of a state from firing, beside the pointer or the selected thing.
 *
 * @import {HfsmCanvas} from "../canvas/canvas.js"
 * @import {Explanation} from "../data/protocol.js"
 * @typedef {{canvas: HfsmCanvas, group: SVGElement, pinned: boolean, automaton: number, state: number, transition: number}} Shown
 */

import {html, nothing, render} from "lit";

import {page} from "../data/page.js";
import {isTyping} from "../kit/keys.js";
import {coded, t} from "../kit/texts.js";
import {spokenFailing} from "./failures.js";
import {monitor} from "./monitor.js";
import {scrubbing} from "./scrubbing.js";

const PATIENCE = 220; // ms that the pointer must rest before an explanation is shown
const AGAIN = 400; // ms after which an explanation is asked for again

/** @type {HTMLElement | undefined} */
let element;
let timer = 0;
/** @type {Shown | undefined} */
let shown;

/**
 * Explain what the pointer rests on, for as long as a component is followed.
 *
 * @param {HfsmCanvas} canvas
 */
export function explainUnderPointer(canvas) {
  /** @param {SVGElement | null} group under the pointer */
  const rest = (group) => {
    clearTimeout(timer);
    if (shown && !shown.pinned && shown.group !== group) hide();
    if (!group || !isExplained()) return;
    canvas.tip.remove();
    timer = setTimeout(() => show(canvas, group, false), PATIENCE);
  };
  canvas.surface.addEventListener("pointerover", ({target, buttons}) =>
    rest(buttons || !(target instanceof Element) ? null : target.closest("[data-key]")),
  );
  canvas.surface.addEventListener("pointerleave", () => {
    clearTimeout(timer);
    if (!shown?.pinned) hide();
  });
  canvas.surface.addEventListener("pointerdown", () => {
    clearTimeout(timer);
    hide();
  });
  canvas.addEventListener("view", () => hide());
  for (const kind of /** @type {const} */ (["tab", "automaton"])) page.addEventListener(kind, () => hide());
  monitor.addEventListener("mode", () => !isExplained() && hide());
  document.addEventListener(
    "keydown",
    (event) => {
      if (isTyping(event.target)) clearTimeout(timer);
      if (!shown) return;
      if (event.key !== "Escape") return isTyping(event.target) && hide(); // it may lie over what is typed
      hide();
      event.preventDefault();
      event.stopPropagation();
    },
    {capture: true},
  );
  rest(canvas.surface.querySelector("[data-key]:hover")); // the pointer may have come to rest before this was loaded
}

/**
 * Explain the selected state or transition, or the state that the shown automaton is in.
 *
 * @param {HfsmCanvas} canvas
 */
export function explainSelected(canvas) {
  if (shown?.pinned) return hide();
  const key = canvas.selectedKeys()[0] ?? `s${monitor.now(page.shownAutomaton.id)?.state}`;
  const group = canvas.drawing.find(key)?.group;
  return group && show(canvas, group, true);
}

const isExplained = () => (monitor.isLive || Boolean(monitor.looking)) && page.tab === monitor.tab;

/** @param {HfsmCanvas} canvas @param {SVGElement} group @param {boolean} pinned */
async function show(canvas, group, pinned) {
  hide();
  const {key = ""} = group.dataset;
  const automaton = page.shownAutomaton;
  const id = Number(key.slice(1).replaceAll("'", ""));
  const transition = key.startsWith("t") ? id : 0;
  const now = monitor.now(automaton.id);
  if (!now) return;
  const origin = transition ? automaton.transitions.find((each) => each.id === transition)?.origin : id;
  if (origin !== now.state) {
    if (pinned) canvas.announce(t("The automaton is in {state} now.", {state: monitor.stateName(now.id, now.state)}));
    else return;
  }
  const {state} = now;
  const current = {
    canvas,
    group,
    pinned,
    automaton: automaton.id,
    state,
    transition: origin === state ? transition : 0,
  };
  shown = current;
  let said = false;
  while (shown === current && isExplained()) {
    let explanation;
    try {
      const {automaton: about} = current;
      explanation = monitor.looking
        ? await monitor.ask("explainMoment", {automaton: about, time: scrubbing.time})
        : await monitor.ask("explain", {automaton: about});
    } catch {
      break; // the component was lost; the canvas shows that
    }
    if (shown !== current) return;
    if (!explanation) break;
    if (pinned && !current.transition) current.state = explanation.state;
    draw(current, explanation);
    if (pinned && !said) canvas.announce(`${explanation.summary} ${failing()}`.trim());
    said = true;
    await new Promise((resolve) => setTimeout(resolve, AGAIN));
  }
  if (shown === current) hide();
}

const failing = () => spokenFailing(monitor.snapshot?.robot.failing ?? []);

/** @param {Shown} about @param {Explanation} explanation */
function draw({canvas, group, automaton, state, transition}, explanation) {
  if (!element) {
    element = document.createElement("div");
    element.className = "why-not";
    element.setAttribute("role", "tooltip");
    canvas.append(element);
  }
  /** @param {number} id */
  const name = (id) => monitor.stateName(automaton, id);
  const left = explanation.state !== state && t("The automaton is in {state} now.", {state: name(explanation.state)});
  const asked = explanation.transitions.filter((each) => !left && (!transition || each.transition === transition));
  render(
    html`<p class="title">
        ${transition ? nameOf(automaton, transition) : t("In {state}", {state: name(state)})}${
          explanation.ghost ? html` <span class="faint">${t("ghost: its state above is not active")}</span>` : nothing
        }
      </p>
      ${
        asked.length
          ? html`<ul>
              ${asked.map(
                (each) =>
                  html`<li class=${each.asked ? (each.value ? "true" : "false") : "unasked"}>
                    <span class="verdict-sign" aria-hidden="true">${each.value ? "✓" : "✕"}</span>
                    <span
                      ><strong>${transition ? "" : nameOf(automaton, each.transition)}</strong>
                      ${coded(each.reason)}</span
                    >
                  </li>`,
              )}
            </ul>`
          : html`<p>${left || explanation.summary || t("No transition leads out of it.")}</p>`
      }${failing() ? html`<p class="fails">${failing()}</p>` : nothing}`,
    element,
  );
  place(element, {canvas, group});
}

/** @param {number} automaton @param {number} id */
function nameOf(automaton, id) {
  const transition = monitor.transition(automaton, id);
  return transition
    ? transition.name || t("to {name}", {name: monitor.stateName(automaton, transition.destination)})
    : t("transition {id}", {id});
}

/**
 * Place the explanation beside its element, inside the canvas, where it covers the fewest names.
 *
 * @param {HTMLElement} bubble @param {Pick<Shown, "canvas" | "group">} where
 */
function place(bubble, {canvas, group}) {
  const {width, height} = bubble.getBoundingClientRect();
  const area = canvas.getBoundingClientRect();
  const box = group.getBoundingClientRect();
  const [x, y] = [box.left + (box.width - width) / 2, box.top + (box.height - height) / 2];
  const words = [...canvas.surface.querySelectorAll(".label text, .state")].map((each) => each.getBoundingClientRect());
  /** @param {number} left @param {number} top */
  const covered = (left, top) =>
    words.filter(
      (each) => each.left < left + width && left < each.right && each.top < top + height && top < each.bottom,
    ).length;
  const spots = [box.bottom + 10, box.top - height - 10]
    .flatMap((top) => [x, box.right - width, box.left].map((left) => [left, top]))
    .concat([
      [box.right + 10, y],
      [box.left - width - 10, y],
    ])
    .map(([left, top]) => ({
      left: Math.max(area.left + 8, Math.min(area.right - width - 8, left)),
      top: Math.max(area.top + 8, Math.min(innerHeight - height - 8, top)),
    }))
    .map(({left, top}) => ({left, top, covers: covered(left, top)}));
  const [spot] = spots.toSorted((one, other) => one.covers - other.covers);
  bubble.style.left = `${spot.left}px`;
  bubble.style.top = `${spot.top}px`;
}

function hide() {
  shown = undefined;
  element?.remove();
  element = undefined;
}
