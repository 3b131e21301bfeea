/**
 * The outputs of the automata of a state, each with the variable that takes it.
 *
 * @import {From} from "../data/element.js"
 * @import {Automaton, Parameter, Place, Result, State} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{child: number, output: Parameter}} Output of an automaton of a state
 * @typedef {{name: string, child: number, output?: Parameter, taken?: Result, words: string}} Row
 * @typedef {{document: OpenDocument, automaton: Automaton, state: State, readonly: boolean}} About
 */

import {html, live, nothing} from "lit";
import {apply} from "../data/commands.js";
import {placed} from "../data/problems.js";
import {t, translated} from "../kit/texts.js";
import {placeOf} from "../code/places.js";
import {badge, problemLines} from "../kit/tabs.js";

/** Names that a line of variables assigns, before its first `=`. */
const ASSIGNED = /^([\p{L}_][\p{L}\p{N}_]*(?:\s*[,=]\s*[\p{L}_][\p{L}\p{N}_]*)*)\s*(?::[^=\n]*)?=(?!=)/gmu;
const NEW = " "; // no variable has this name

/** The outputs of the automata of a state. @param {OpenDocument} document @param {State} state @returns {Output[]} */
export function outputsOf(document, state) {
  return state.children.flatMap((child) =>
    (document.automata.get(child)?.outputs ?? []).map((output) => ({child, output})),
  );
}

/** @param {About} about @param {Place} place of the state */
export function resultList(about, place) {
  const {document, automaton, state} = about;
  const variables = variablesOf(automaton);
  return html`<p class="explain">
      ${t(
        "What the automata below hand up: each cycle of this automaton begins with their outputs in these variables.",
      )}
    </p>
    <ul class="entries">
      ${rowsOf(state, outputsOf(document, state)).map((row) => rowOf(about, place, row, variables))}
    </ul>`;
}

/** @param {State} state @param {Output[]} outputs @returns {Row[]} */
function rowsOf({results}, outputs) {
  const names = outputs.map(({output}) => output.name);
  /** @param {Result} result @param {Output} output */
  const isOf = (result, {child, output}) => result.name === output.name && [child, 0].includes(result.child);
  /** @type {Row[]} */
  const rows = outputs.map((each) => {
    const {child, output} = each;
    const taken = results.find((result) => isOf(result, each));
    const several = names.filter((name) => name === output.name).length > 1;
    const words = several ? t("of automaton {child}", {child}) : "";
    return {name: output.name, child: taken?.child ?? (several ? child : 0), output, taken, words};
  });
  for (const taken of results.filter((result) => !outputs.some((each) => isOf(result, each))))
    rows.push({name: taken.name, child: taken.child, taken, words: t("none of its automata has it")});
  return rows;
}

/** @param {About} about @param {Place} place @param {Row} row @param {string[]} variables */
function rowOf({document, automaton, state, readonly}, place, {name, child, output, taken, words}, variables) {
  const where = {automaton: automaton.id, state: state.id, name, child};
  const problems = placed(document.problems).filter((each) => {
    const other = placeOf(each);
    return (
      other.kind === "state" &&
      other.automaton === place.automaton &&
      other.id === place.id &&
      other.part === "result" &&
      other.name === name
    );
  });
  /** @param {From<HTMLSelectElement>} event */
  const choose = ({target}) => {
    const {value} = target;
    if (value === NEW) apply("takeOutput", where);
    else if (value) apply("setText", {place: {...place, part: "result", name, child}, text: value});
    else apply("removeResult", where);
  };
  const variable = taken?.variable.trim() ?? "";
  const offered = variable && !variables.includes(variable) ? [variable, ...variables] : variables;
  return html`<li class="entry">
    <div class="entry-head">
      <strong class="mono">${name}</strong>
      <span class="faint">${output ? `${output.type}, ${output.default}` : ""} ${words}</span>${badge(problems)}
    </div>
    <label class="taken"
      >${t("into")}
      <span class="field-box"
        ><select
          class="mono"
          data-part="result"
          data-name=${name}
          aria-label=${t("Variable for the output {name}", {name})}
          ?disabled=${readonly}
          .value=${live(variable)}
          @change=${choose}
        >
          <option value="" ?selected=${!variable}>${t("nothing: it is not taken")}</option>
          ${offered.map((each) => html`<option value=${each} ?selected=${each === variable}>${each}</option>`)}
          ${output ? html`<option value=${NEW}>${t("a new variable")}</option>` : nothing}
        </select></span
      ></label
    >
    ${output?.description ? html`<p class="explain">${translated(output.description)}</p>` : nothing}
    ${problemLines(problems)}
  </li>`;
}

/** The names into which an automaton may take outputs: its own outputs, and what its variables assign. @param {Automaton} automaton */
function variablesOf({variables, outputs}) {
  const assigned = [...variables.matchAll(ASSIGNED)].flatMap(([, names]) => names.split(/\s*[,=]\s*/));
  return [...new Set([...outputs.map(({name}) => name), ...assigned])];
}
