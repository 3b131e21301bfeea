/**
 * A transition in the panel beside the canvas: its trigger, guard, priority and code.
 *
 * @import {From} from "../data/element.js"
 * @import {Automaton, Commands, Place, Transition} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{tab: number, document: OpenDocument, automaton: Automaton, transition: Transition, readonly: boolean}}
 *   About
 * @typedef {{automaton: number, transition: number}} Fields of a command about the transition
 */

import {html, live, nothing} from "lit";
import {apply} from "../data/commands.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {iconButton} from "../kit/icons.js";
import {firstPart, outgoing} from "../data/outline.js";
import {page} from "../data/page.js";
import {rich, t} from "../kit/texts.js";
import {problemsOf} from "../data/places.js";
import {problemLines} from "../kit/tabs.js";
import {codeField, nameField, textField} from "./fields.js";

/** @type {[type: Commands["setTransitionType"]["type"], label: string, words: string][]} */
const TYPES = [
  ["condition", t("Condition"), t("when an expression is true")],
  ["time", t("Time"), t("after a time in the state")],
  ["event", t("Event"), t("when an event arrives")],
  ["finished", t("Finished"), t("when every automaton of the state has finished")],
];

/** @param {About} about */
export function transitionEditor(about) {
  const {document, automaton, transition, readonly} = about;
  /** @type {Place} */
  const place = {kind: "transition", automaton: automaton.id, id: transition.id};
  const own = problemsOf(document.problems, place).filter((each) => !each.place?.part);
  const fields = {automaton: automaton.id, transition: transition.id};
  /** @param {"origin" | "destination"} end */
  const retarget =
    (end) =>
    (/** @type {From<HTMLSelectElement>} */ {target}) =>
      apply("retargetTransition", {...fields, [end]: Number(target.value)});
  /** @param {"origin" | "destination"} end @param {string} label */
  const ends = (end, label) =>
    html`<label
      >${label}
      <select ?disabled=${readonly} @change=${retarget(end)}>
        ${automaton.states.map(
          (state) =>
            html` <option value=${state.id} ?selected=${state.id === transition[end]}>
              ${state.name || t("state {id}", {id: state.id})}
            </option>`,
        )}
      </select></label
    >`;
  return html` <div class="about">
      ${nameField(about, place, transition.name, t("Name of the transition"))}
      <div class="ends">${ends("origin", t("From"))} ${ends("destination", t("To"))}</div>
      ${problemLines(own)}
    </div>
    <div class="tab-panel sections">
      ${typeChoice(transition, fields, readonly)} ${trigger(about, place)}
      ${
        transition.type === "condition" && !transition.guard.trim()
          ? nothing
          : html`<div class="section">
              <h3 id="guard-title">${t("Guard")} <span class="faint">${t("must hold as well")}</span></h3>
              ${codeField(about, {...place, part: "guard"}, transition.guard, {
                label: t("Guard of {name}", {name: transition.name}),
                hint: t("always"),
              })}
              ${
                transition.type === "condition"
                  ? html`<p class="explain">
                      ${rich(
                        "A condition has no guard: the behavior cannot run. Write both into the condition, joined by {and}, or delete the guard.",
                        {and: html`<code>and</code>`},
                      )}
                    </p>`
                  : nothing
              }
            </div>`
      }
      ${priority(about, place, fields)}
      <div class="section code">
        <h3>${t("Code")} <span class="faint">${t("runs when it fires")}</span></h3>
        ${codeField(about, {...place, part: "fired"}, transition.code, {
          look: "fill",
          label: t("Code of the transition {name}", {name: transition.name}),
          hint: t("Runs once"),
        })}
      </div>
    </div>`;
}

/** @param {Transition} transition @param {Fields} fields @param {boolean} readonly */
function typeChoice(transition, fields, readonly) {
  /** @param {Commands["setTransitionType"]["type"]} type @param {HTMLElement} radio */
  const choose = async (type, radio) => {
    const set = () => apply("setTransitionType", {...fields, type});
    if (radio.matches(":focus-visible")) return set(); // with the arrows, perhaps to the next type
    return holdKeys(async () => {
      const done = await set();
      if (done) write(type);
      return done;
    });
  };
  /** @param {Commands["setTransitionType"]["type"]} type */
  const write = (type) =>
    page.edit({kind: "transition", automaton: fields.automaton, id: fields.transition, part: firstPart(type)});
  return html`<fieldset class="type-choice">
    <legend>${t("Fires")}</legend>
    ${TYPES.map(
      ([type, label, words]) =>
        html` <label title=${words}
          ><input
            type="radio"
            name="transition-type"
            value=${type}
            .checked=${live(transition.type === type)}
            ?disabled=${readonly}
            @change=${(/** @type {From<HTMLInputElement>} */ {target}) => choose(type, target)}
            @click=${() => transition.type === type && write(type)}
          /><span>${label}</span></label
        >`,
    )}
  </fieldset>`;
}

/** @param {About} about @param {Place} place */
function trigger(about, place) {
  const {document, transition} = about;
  const {type, name} = transition;
  const where = {...place, part: "trigger"};
  if (type === "finished")
    return html`<p class="explain">${t("Fires when every automaton of its origin has reached a final state.")}</p>`;
  if (type === "time")
    return textField(about, where, transition.trigger, {kind: type, label: t("After"), hint: t("1 s, or 500 ms")});
  if (type === "event") {
    const suggestions = knownEvents(document, transition);
    return textField(about, where, transition.trigger, {label: t("Event"), hint: t("its name"), suggestions});
  }
  const [label, hint] = [t("Condition of {name}", {name}), t("never: write an expression")];
  return html`<div class="section">
    <h3>${t("Condition")} <span class="faint">${t("an expression, or statements that return")}</span></h3>
    ${codeField(about, where, transition.trigger, {label, hint})}
  </div>`;
}

/** @param {About} about @param {Place} place @param {Fields} fields */
function priority(about, place, fields) {
  const {automaton, transition, readonly} = about;
  const order = outgoing(automaton.transitions.filter((each) => each.origin === transition.origin));
  const index = order.indexOf(transition);
  /** @param {number} step */
  const move = (step) => apply("reorderTransition", {...fields, index: index + step});
  return html`<div class="section inline">
    ${textField(about, {...place, part: "priority"}, transition.priority, {
      look: "",
      kind: "number",
      label: t("Priority"),
      hint: t("not set"),
    })}
    ${
      order.length < 2
        ? html`<span class="faint">${t("the only transition out of its state")}</span>`
        : html`<span class="faint"
              >${t("tried as number {number} of {count}", {number: index + 1, count: order.length})}</span
            >
            ${iconButton("up", t("Evaluate earlier"), () => move(-1), {disabled: index <= 0 || readonly})}
            ${iconButton("up", t("Evaluate later"), () => move(1), {
              kind: "down",
              disabled: index >= order.length - 1 || readonly,
            })}`
    }
  </div>`;
}

/**
 * Names of events: declared ones, those that code sends, and triggers of other transitions.
 *
 * @param {OpenDocument} document @param {Transition} shown
 */
function knownEvents(document, shown) {
  const names = new Set(document.fields.events.map((each) => each.name));
  const sent = /\bself\.send\(\s*(["'])((?:(?!\1).){1,100})\1/g;
  for (const {states, transitions, functions} of document.automata.values()) {
    const texts = [
      functions,
      ...states.flatMap((each) => [each.entry, each.code, each.exit]),
      ...transitions.map((each) => each.code),
    ];
    for (const text of texts) for (const match of text.matchAll(sent)) names.add(match[2]);
    for (const each of transitions)
      if (each !== shown && each.type === "event" && each.trigger.trim()) names.add(each.trigger.trim());
  }
  return [...names].sort();
}
