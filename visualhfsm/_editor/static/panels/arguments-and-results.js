/**
 * What is handed to the automata of a state, and by them: their inputs with arguments, their outputs with results.
 *
 * @import {From} from "../data/element.js"
 * @import {Argument, Automaton, Parameter, Place, Problem, Result, State} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{tab: number, document: OpenDocument, automaton: Automaton, state: State, readonly: boolean}} About
 * @typedef {{child: number, parameter: Parameter}} Declared an input or output of an automaton of the state
 */

/**
 * @template Handed
 * @typedef {{name: string, child: number, parameter?: Parameter, handed?: Handed, words: string}} Row
 */

import {html, keyed, live, nothing} from "lit";
import {apply} from "../data/commands.js";
import {iconButton} from "../kit/icons.js";
import {t, translated} from "../kit/texts.js";
import {problemsOf} from "../data/places.js";
import {badge, problemLines} from "../kit/tabs.js";
import {codeField} from "./fields.js";

/** Names that a line of variables assigns, before its first `=`. */
const ASSIGNED = /^([\p{L}_][\p{L}\p{N}_]*(?:\s*[,=]\s*[\p{L}_][\p{L}\p{N}_]*)*)\s*(?::[^=\n]*)?=(?!=)/gmu;
const NEW = " "; // no variable has this name

/**
 * The inputs or the outputs of the automata of a state.
 *
 * @param {OpenDocument} document @param {State} state @param {"inputs" | "outputs"} list
 * @returns {Declared[]}
 */
export const declaredIn = ({automata}, {children}, list) =>
  children.flatMap((child) => (automata.get(child)?.[list] ?? []).map((parameter) => ({child, parameter})));

/**
 * A row for each that is declared, and for what a state hands though nothing declares it.
 *
 * @template {Argument | Result} Handed
 * @param {Declared[]} declared @param {Handed[]} handed
 * @returns {Row<Handed>[]}
 */
function rowsOf(declared, handed) {
  /** @param {Handed} one @param {Declared} each */
  const isOf = (one, {child, parameter}) => one.name === parameter.name && [child, 0].includes(one.child);
  const rows = declared.map((each) => {
    const {child, parameter} = each;
    const {name} = parameter;
    const found = handed.find((one) => isOf(one, each));
    const several = declared.filter((other) => other.parameter.name === name).length > 1;
    const words = several ? t("of automaton {child}", {child}) : "";
    return {name, child: found?.child ?? (several ? child : 0), parameter, handed: found, words};
  });
  const strays = handed.filter((one) => !declared.some((each) => isOf(one, each)));
  const words = t("none of its automata has it");
  return [...rows, ...strays.map((one) => ({name: one.name, child: one.child, handed: one, words}))];
}

/** The problems of a row. @param {About} about @param {Place} place of the row */
const problemsIn = ({document}, place) =>
  problemsOf(document.problems, place).filter(({place: at}) => at?.part === place.part && at?.name === place.name);

/**
 * @param {Row<unknown>} row @param {string} type in words @param {Problem[]} problems @param {unknown} [button]
 */
const rowHead = ({name, words}, type, problems, button = nothing) =>
  html`<div class="entry-head">
    <strong class="mono">${name}</strong> <span class="faint">${type} ${words}</span>${badge(problems)} ${button}
  </div>`;

/** @param {Row<unknown>} row */
const explained = ({parameter}) =>
  parameter?.description ? html`<p class="explain">${translated(parameter.description)}</p>` : nothing;

/** @param {About} about @param {Place} place of the state */
export function argumentList(about, place) {
  const {document, state} = about;
  return html`<p class="explain">
      ${t("Expressions over the variables of this automaton, passed to the automata below when the state is entered.")}
    </p>
    <ul class="entries">
      ${rowsOf(declaredIn(document, state, "inputs"), state.arguments).map((row) => argumentRow(about, place, row))}
    </ul>`;
}

/** @param {About} about @param {Place} place @param {Row<Argument>} row */
function argumentRow(about, place, row) {
  const {automaton, state, readonly} = about;
  const {name, child, parameter, handed} = row;
  const where = {...place, part: "argument", name, child};
  const {type = "", default: value} = parameter ?? {};
  const words = value ? t("{type}, otherwise {value}", {type, value}) : parameter ? t("{type}, needed", {type}) : "";
  const remove = () => apply("removeArgument", {automaton: automaton.id, state: state.id, name, child});
  const button = iconButton("delete", t("Remove the argument {name}", {name}), remove, {title: t("Remove")});
  return html`<li class="entry">
    ${rowHead(row, words, problemsIn(about, where), handed && !readonly ? button : nothing)}
    ${keyed(
      `${state.id} ${name} ${child}`,
      codeField(about, where, handed?.value ?? "", {
        label: t("Argument {name}", {name}),
        hint: value || t("an expression"),
      }),
    )}
    ${explained(row)}
  </li>`;
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
      ${rowsOf(declaredIn(document, state, "outputs"), state.results).map((row) => resultRow(about, place, row, variables))}
    </ul>`;
}

/** @param {About} about @param {Place} place @param {Row<Result>} row @param {string[]} variables */
function resultRow(about, place, row, variables) {
  const {automaton, state, readonly} = about;
  const {name, child, parameter, handed} = row;
  const where = {automaton: automaton.id, state: state.id, name, child};
  const problems = problemsIn(about, {...place, part: "result", name});
  /** @param {From<HTMLSelectElement>} event */
  const choose = ({target}) => {
    const {value} = target;
    if (value === NEW) apply("takeOutput", where);
    else if (value) apply("setText", {place: {...place, part: "result", name, child}, text: value});
    else apply("removeResult", where);
  };
  const variable = handed?.variable.trim() ?? "";
  const offered = variable && !variables.includes(variable) ? [variable, ...variables] : variables;
  return html`<li class="entry">
    ${rowHead(row, parameter ? `${parameter.type}, ${parameter.default}` : "", problems)}
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
          ${parameter ? html`<option value=${NEW}>${t("a new variable")}</option>` : nothing}
        </select></span
      ></label
    >
    ${explained(row)} ${problemLines(problems)}
  </li>`;
}

/** The names into which an automaton may take outputs: its own outputs, and what its variables assign. @param {Automaton} automaton */
function variablesOf({variables, outputs}) {
  const assigned = [...variables.matchAll(ASSIGNED)].flatMap(([, names]) => names.split(/\s*[,=]\s*/));
  return [...new Set([...outputs.map(({name}) => name), ...assigned])];
}
