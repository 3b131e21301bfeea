/**
 * The whole component as pages, which the browser prints or saves as PDF.
 *
 * @import {Annotation, Automaton, State, Transition} from "../data/protocol.js"
 */

import {html, nothing, render} from "lit";

import {isFrame} from "../measures/areas.js";
import {TRIGGERS} from "../canvas/glyphs.js";
import {picture} from "../canvas/export.js";
import {outgoing, ownerOf} from "../data/outline.js";
import {page} from "../data/page.js";
import {spokenTime, t} from "../kit/texts.js";

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

function content() {
  const {fields, automata} = page.shownDocument;
  return html`<h1>${page.component}</h1>
    ${fields.description ? html`<p class="lead">${fields.description}</p>` : nothing}
    ${table(t("Parameters"), ["name", "type", "default", "description"], fields.parameters)}
    ${table(t("Events"), ["name", "description"], fields.events)}
    ${table(t("Interfaces"), ["name", "identity", "type"], fields.interfaces)}
    ${table(t("Interfaces of ROS"), ["name", "kind", "target", "type", "qos"], fields.ros)}
    ${table(t("Properties"), ["name", "kind", "within", "expression"], fields.properties)}
    ${[...automata.values()].map(automatonPage)}`;
}

/** @param {Automaton} automaton */
function automatonPage(automaton) {
  const owner = ownerOf(page.shownDocument, automaton);
  return html`<section>
    <h2>
      ${
        owner && owner.children.length > 1
          ? t("{title}, automaton {number}", {
              title: page.title(automaton),
              number: owner.children.indexOf(automaton.id) + 1,
            })
          : page.title(automaton)
      }
    </h2>
    <p>
      ${
        automaton.imported
          ? t("Comes from {file}.", {file: automaton.imported.file || t("another document")})
          : t("A cycle every {period} ms.", {period: automaton.period})
      }
      ${owner ? t("Part of the state {name}.", {name: owner.name}) : ""}
    </p>
    ${automaton.states.length ? html`<figure>${picture(automaton)}</figure>` : nothing} ${automatonPart(automaton)}
    ${automaton.states.map((state) => statePart(automaton, state))}
  </section>`;
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

/** @param {string} title @param {string} text @param {3 | 4} [level] of its heading */
function code(title, text, level = 4) {
  if (!text.trim()) return nothing;
  const heading = level === 3 ? html`<h3>${title}</h3>` : html`<h4>${title}</h4>`;
  return html`${title ? heading : nothing}
    <pre tabindex="0">${text}</pre>`;
}

/** @param {string} title @param {string[]} columns @param {object[]} [rows] */
function table(title, columns, rows) {
  if (!rows?.length) return nothing;
  return html`<h3>${title}</h3>
    <table>
      <thead>
        <tr>
          ${columns.map((each) => html`<th>${each[0].toUpperCase()}${each.slice(1)}</th>`)}
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
