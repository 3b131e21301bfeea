/**
 * A violation of a property, played on the canvas step by step.
 *
 * @import {Live} from "../canvas/live-marks.js"
 * @import {Counterexample, Step} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 */

import {html, nothing} from "lit";
import {iconButton} from "../kit/icons.js";
import {page} from "../data/page.js";
import {decimal, t} from "../kit/texts.js";
import {showMarks} from "../data/marks.js";

/**
 * Buttons and the list of steps.
 *
 * @param {Counterexample} counterexample @param {number} index
 * @param {(index: number | null) => void} choose null ends it
 */
export function counterexamplePlayer(counterexample, index, choose) {
  const {steps, repeats} = counterexample;
  const last = steps.length - 1;
  /** @param {KeyboardEvent} event */
  const press = (event) => {
    const to = /** @type {Record<string, number>} */ ({
      ArrowRight: index + 1,
      ArrowLeft: index - 1,
      Home: 0,
      End: last,
    })[event.key];
    if (event.key === "Escape") choose(null);
    else if (to === undefined) return;
    else choose(Math.min(last, Math.max(0, to)));
    event.preventDefault();
    event.stopPropagation();
  };
  return html`<div class="player" role="group" aria-label=${t("Steps until it is violated")} @keydown=${press}>
    <div class="player-tools">
      ${iconButton("collapse", t("Previous step"), () => choose(index - 1), {
        title: t("Previous step (←)"),
        disabled: index <= 0,
      })}
      ${iconButton("collapse", t("Next step"), () => choose(index + 1), {
        title: t("Next step (→)"),
        kind: "next",
        disabled: index >= last,
      })}
      <span role="status"
        >${t("Step {number} of {count}, at {seconds} s: {text}", {
          number: index + 1,
          count: steps.length,
          seconds: decimal(steps[index].timeMs / 1000, 3),
          text: steps[index].text,
        })}</span
      ><span class="room"></span>
      ${iconButton("close", t("Stop playing"), () => choose(null))}
    </div>
    <ol class="steps">
      ${steps.map(
        (step, number) =>
          html`<li>
            <button
              type="button"
              class="step ${number > index ? "later" : ""}"
              aria-current=${number === index ? "step" : nothing}
              @click=${() => choose(number)}
            >
              <span class="time">${decimal(step.timeMs / 1000, 3)} s</span> ${step.text}
            </button>
          </li>`,
      )}
      ${
        repeats === undefined || repeats === null
          ? nothing
          : html`<li class="faint">
              ${repeats < steps.length ? t("and so on from step {number}", {number: repeats + 1}) : t("and so on")}
            </li>`
      }
    </ol>
  </div>`;
}

/**
 * Mark the states that are current after a step, and open the automaton of the step.
 *
 * @param {OpenDocument} document @param {Step[]} steps @param {number} index
 */
export function showStep(document, steps, index) {
  /** @type {Map<number, number>} */
  const current = new Map();
  /** @type {Set<number>} */
  const ghosts = new Set();
  for (const {kind, automaton, state} of steps.slice(0, index + 1)) {
    if (kind === "fires" || kind === "enters" || kind === "resumes" || kind === "ghost") current.set(automaton, state);
    if (kind === "ghost") ghosts.add(automaton);
    else if (kind === "enters" || kind === "resumes") ghosts.delete(automaton);
  }
  /** @type {Map<number, Map<string, Live>>} */
  const highlight = new Map();
  for (const [automaton, state] of current)
    highlight.set(automaton, new Map([[`s${state}`, {status: ghosts.has(automaton) ? "ghost" : "active"}]]));
  const {automaton, kind, transition, origin} = steps[index];
  if (kind === "fires" && transition) {
    highlight.get(automaton)?.set(`t${transition}`, {fired: 1});
    if (origin && origin !== current.get(automaton)) highlight.get(automaton)?.set(`s${origin}`, {trail: true});
  }
  showMarks(highlight);
  if (document.automata.has(automaton) && page.automaton?.id !== automaton) page.open(automaton);
}
