/**
 * Help: the meaning of the signs of the drawing, and every key.
 *
 * @import {Automaton, State, Transition} from "../data/protocol.js"
 */

import {html} from "lit";

import {picture} from "../canvas/export.js";
import {t} from "../kit/texts.js";
import {currentTheme} from "../kit/theme.js";
import {showDialog} from "../kit/dialog.js";
import {keyTable} from "./key-table.js";

/** @type {State} */
const plain = {
  id: 1,
  name: "state",
  x: 0,
  y: 0,
  initial: false,
  final: false,
  children: [],
  history: "",
  entry: "",
  code: "",
  exit: "",
  arguments: [],
  results: [],
};
/** @type {Transition} */
const arc = {
  id: 1,
  name: "",
  x: 0,
  y: 0,
  origin: 9,
  destination: 9,
  type: "condition",
  trigger: "",
  guard: "",
  priority: "",
  code: "",
};

/** @type {[text: string, fields: Partial<State>][]} */
const SIGNS = [
  [t("State"), {}],
  [t("Initial state"), {initial: true}],
  [t("Final state"), {final: true}],
  [t("With a sub-automaton"), {children: [1]}],
  [t("With two parallel sub-automata"), {children: [1, 2]}],
  [t("Restarts on entry"), {children: [1], history: "restart"}],
  [t("With code"), {code: "-"}],
];
const TRIGGERS = [
  [t("After a time"), "time", "1000"],
  [t("On a condition"), "condition"],
  [t("On an event"), "event", t("event")],
  [t("When all below have finished"), "finished"],
];

/** @param {import("../kit/registry.js").Context} context */
export async function showHelp(context) {
  const tour = await showDialog({
    title: t("Help"),
    wide: true,
    content: (/** @type {import("../kit/dialog.js").Close<boolean>} */ _close) =>
      html`<div class="signs">
          ${SIGNS.map(
            ([text, fields]) =>
              html`<figure>
                ${stateSign(fields)}
                <figcaption>${text}</figcaption>
              </figure>`,
          )}
          ${TRIGGERS.map(
            ([text, type, trigger]) =>
              html`<figure>
                ${transitionSign(type, trigger)}
                <figcaption>${text}</figcaption>
              </figure>`,
          )}
        </div>
        <p>
          ${t("Drag from the rim of a state to another state to connect them, or to the ground for a new state. Drag the handle of an arc to bend it; double-click it to edit the condition. The wheel zooms. The middle button pans, and so does the left button while Space is held. Two fingers on a trackpad or a screen pan, and zoom when they pinch; a finger that rests opens the menu. A dot on a handle: code runs when the transition fires. A number: the order in which the transitions of a state are evaluated.")}
        </p>
        <div class="help">
          ${keyTable().map(
            ({title, rows}) =>
              html`<section>
                <h3>${title}</h3>
                <dl>
                  ${rows.map(
                    ({keys, text}) =>
                      html`<dd>${text}</dd>
                        <dt>${keys.map((key) => html` <kbd>${key}</kbd>`)}</dt>`,
                  )}
                </dl>
              </section>`,
          )}
        </div>`,
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close(true)}>${t("Take the tour")}</button
        ><button type="button" class="button primary" autofocus @click=${() => close()}>${t("Close")}</button>`,
  });
  if (tour) (await import("../shell/tour.js")).startTour(context);
}

/** @param {Partial<State>} fields */
const stateSign = (fields) =>
  sign({
    states: [{...plain, ...fields, name: fields.initial ? t("initial") : fields.final ? t("final") : t("state")}],
    transitions: [],
  });
/** @param {string} type */
const transitionSign = (type, trigger = "") =>
  sign(
    {
      states: [
        {...plain, id: 9, x: -100, name: ""},
        {...plain, id: 8, x: 100, name: ""},
      ],
      transitions: [{...arc, destination: 8, type, trigger, y: 0.01}],
    },
    "-52 -48 104 96",
  );

/** @param {Pick<Automaton, "states" | "transitions">} drawn @param {string} [viewBox] */
function sign(drawn, viewBox) {
  const automaton = {
    id: 0,
    father: 0,
    period: "",
    variables: "",
    functions: "",
    inputs: [],
    outputs: [],
    annotations: [],
    imported: null,
    ...drawn,
  };
  const made = picture(automaton, currentTheme());
  made.querySelector("rect")?.remove();
  made.querySelector("title")?.remove();
  made.setAttribute("aria-hidden", "true");
  if (viewBox) made.setAttribute("viewBox", viewBox);
  return made;
}
