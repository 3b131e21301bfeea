/**
 * The whole component as pages, which the browser prints or saves as PDF.
 *
 * @import {Annotation, Automaton, State, Transition} from "../data/protocol.js"
 */

import {html, nothing, render} from "lit";

import {isFrame} from "../measures/areas.js";
import {TRIGGERS} from "../canvas/glyphs.js";
import {picture} from "../canvas/export.js";
import {verdictOf} from "../code/verdicts.js";
import {outgoing, ownerOf} from "../data/outline.js";
import {page} from "../data/page.js";
import {spokenTime, t} from "../kit/texts.js";

/** What stands above columns, by the names of their fields. @type {Record<string, string>} */
const COLUMNS = {
  name: t("Name"),
  type: t("Type"),
  default: t("Default"),
  description: t("Description"),
  identity: t("Identity"),
  kind: t("Kind"),
  target: t("Name in ROS"),
  qos: t("QoS"),
  within: t("Within"),
  expression: t("Expression"),
  verdict: t("Verdict"),
};

/** Show the print dialog of the browser with the pages of the shown document. */
export async function printComponent() {
  document.querySelector("body > .pages")?.remove(); // left by a dialog whose end was not reported
  const pages = document.createElement("div");
  pages.className = "pages";
  render(content(), pages);
  document.body.append(pages);
  document.body.classList.add("printing");
  await new Promise((resolve) => {
    addEventListener("afterprint", resolve, {once: true});
    requestAnimationFrame(() => window.print());
  });
  document.body.classList.remove("printing");
  pages.remove();
}

/**
 * All of the shown document.
 *
 * @param {string} [prefix] of the ids of its parts @param {unknown} [more] what is said before its automata
 */
export function content(prefix = "", more = nothing) {
  const {fields, automata} = page.shownDocument;
  const properties = fields.properties.map((each, index) => ({
    ...each,
    verdict: verdictOf(page.shownDocument, index)?.words,
  }));
  return html`<h1>${page.component}</h1>
    ${fields.description ? html`<p class="lead">${fields.description}</p>` : nothing}
    ${table(t("Parameters"), ["name", "type", "default", "description"], fields.parameters, 2)}
    ${table(t("Events"), ["name", "description"], fields.events, 2)}
    ${table(t("Interfaces"), ["name", "identity", "type"], fields.interfaces, 2)}
    ${table(t("Interfaces of ROS"), ["name", "kind", "target", "type", "qos"], fields.ros, 2)}
    ${table(t("Properties"), ["name", "kind", "within", "expression", "verdict"], properties, 2)}
    ${table(t("Failures that it survives"), ["part", "kind", "amount", "after", "must"], fields.survives, 2)}
    ${code(t("After an error"), fields.onError, 2)}${code(t("After a refused command"), fields.onRefused, 2)} ${more}
    ${[...automata.values()].map((each) => automatonPage(each, prefix))}`;
}

/** The id of an automaton, or of a state, in these pages. @param {string} prefix @param {number} automaton @param {number} [state] */
export const anchor = (prefix, automaton, state) => `${prefix}a${automaton}${state === undefined ? "" : `s${state}`}`;

/** @param {Automaton} automaton @param {string} prefix */
function automatonPage(automaton, prefix) {
  const owner = ownerOf(page.shownDocument, automaton);
  /** @param {State} state */
  const href = ({id, children: [child]}) =>
    `#${child === undefined ? anchor(prefix, automaton.id, id) : anchor(prefix, child)}`;
  return html`<section id=${anchor(prefix, automaton.id)}>
    <h2>${numbered(automaton)}</h2>
    <p>
      ${
        automaton.imported
          ? t("Comes from {file}.", {file: automaton.imported.file || t("another document")})
          : t("A cycle every {period} ms.", {period: automaton.period})
      }
      ${owner ? t("Part of the state {name}.", {name: owner.name}) : ""}
    </p>
    ${automaton.states.length ? html`<figure>${picture(automaton, "light", href)}</figure>` : nothing}
    ${automatonPart(automaton)} ${automaton.annotations.map(notePart)}
    ${automaton.states.map(
      (state) =>
        html`<div id=${anchor(prefix, automaton.id, state.id)}>
          ${statePart(automaton, state)}
          ${state.children.map((child) => {
            const below = page.shownDocument.automata.get(child);
            return (
              below &&
              html`<p class="arc">
                <a href="#${anchor(prefix, child)}">${t("Its automaton: {name}", {name: numbered(below)})}</a>
              </p>`
            );
          })}
        </div>`,
    )}
  </section>`;
}

/** The name of an automaton, with its number if its state has several. @param {Automaton} automaton */
export function numbered(automaton) {
  const children = ownerOf(page.shownDocument, automaton)?.children ?? [];
  const title = page.title(automaton);
  return children.length > 1
    ? t("{title}, automaton {number}", {title, number: children.indexOf(automaton.id) + 1})
    : title;
}

/** The data and the functions of an automaton. @param {Automaton} automaton */
export const automatonPart = ({inputs, outputs, variables, functions}) =>
  html`${table(t("Inputs"), ["name", "type", "default", "description"], inputs)}
  ${table(t("Outputs"), ["name", "type", "default", "description"], outputs)}
  ${code(t("Variables"), variables, 3)}${code(t("Functions"), functions, 3)}`;

/** All of the text of a note, or the title of a frame. @param {Annotation} annotation */
export const notePart = (annotation) =>
  html`<h3>${isFrame(annotation) ? t("Frame") : t("Note")}</h3>
    <p class="note-text">${annotation.text}</p>`;

/** A state with its code and the transitions out of it. @param {Automaton} automaton @param {State} state */
export const statePart = (automaton, state) =>
  html`<h3>
      ${[t("State {name}", {name: state.name}), state.initial && t("initial"), state.final && t("final")].filter(Boolean).join(", ")}
    </h3>
    ${code(t("Entry"), state.entry)}${code(t("Each cycle"), state.code)}${code(t("Exit"), state.exit)}
    ${outgoing(automaton.transitions.filter(({origin}) => origin === state.id)).map((each) =>
      transitionPart(automaton, each),
    )}`;

/**
 * A transition with its code.
 *
 * @param {Automaton} automaton @param {Transition} transition
 * @param {3 | 4} level of its headings: 4 below a state
 */
export function transitionPart(automaton, {name, destination, type, trigger, guard, code: fired}, level = 4) {
  const to = automaton.states.find((each) => each.id === destination)?.name ?? t("nothing");
  const what =
    type === "time" ? t("after {time}", {time: spokenTime(trigger) || t("no time")}) : (TRIGGERS[type]?.word ?? type);
  return html`<p class="arc">
      → <strong>${to}</strong>:
      ${name ? `${name}, ` : ""}${type === "event" ? t("on the event {trigger}", {trigger}) : what}
    </p>
    ${type === "condition" ? code("", trigger) : nothing}${code(t("If"), guard, level)}${code(t("When it fires"), fired, level)}`;
}

/** @typedef {2 | 3 | 4} Level of a heading: 2 below the component, 3 below an automaton, 4 below a state */
const HEADINGS = {
  2: (/** @type {string} */ title) => html`<h2>${title}</h2>`,
  3: (/** @type {string} */ title) => html`<h3>${title}</h3>`,
  4: (/** @type {string} */ title) => html`<h4>${title}</h4>`,
};

/** @param {string} title @param {string} text @param {Level} [level] */
function code(title, text, level = 4) {
  if (!text.trim()) return nothing;
  return html`${title ? HEADINGS[level](title) : nothing}
    <pre tabindex="0">${text}</pre>`;
}

/** @param {string} title @param {string[]} columns @param {object[]} [rows] @param {Level} [level] */
function table(title, columns, rows, level = 3) {
  if (!rows?.length) return nothing;
  return html`${HEADINGS[level](title)}
    <table>
      <thead>
        <tr>
          ${columns.map((each) => html`<th>${COLUMNS[each]}</th>`)}
        </tr>
      </thead>
      <tbody>
        ${rows.map((row) => {
          const values = new Map(Object.entries(row));
          return html`<tr>
            ${columns.map((each) => html`<td>${values.get(each)}</td>`)}
          </tr>`;
        })}
      </tbody>
    </table>`;
}
