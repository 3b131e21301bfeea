/**
 * A state in the panel beside the canvas: its name, its marks, its code, its arguments and results.
 *
 * @import {From} from "../data/element.js"
 * @import {Argument, Automaton, Commands, Parameter, Place, State} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @import {Tab} from "../kit/tabs.js"
 * @typedef {{tab: number, document: OpenDocument, automaton: Automaton, state: State, part: string,
 *   choose: (part: string) => void, readonly: boolean}} About
 * @typedef {{child: number, automaton: Automaton | undefined, input: Parameter}} Input of an automaton of a state
 */

import {html, keyed, live, nothing} from "lit";
import {apply} from "../data/commands.js";
import {iconButton} from "../kit/icons.js";
import {page} from "../data/page.js";
import {placed} from "../data/problems.js";
import {t, translated} from "../kit/texts.js";
import {keyOf, placeOf} from "../code/places.js";
import {outputsOf, resultList} from "./results.js";
import {badge, problemLines, tabStrip} from "../kit/tabs.js";

const CODES = {
  entry: {label: t("Entry"), hint: t("Runs once on entry")},
  code: {label: t("Code"), hint: t("Runs in every cycle")},
  exit: {label: t("Exit"), hint: t("Runs once on exit")},
};

/** @param {keyof typeof CODES} part @param {string} name */
const codeOf = (part, name) =>
  ({
    entry: t("Entry code of the state {name}", {name}),
    code: t("Code of the state {name}", {name}),
    exit: t("Exit code of the state {name}", {name}),
  })[part];

export const PARTS = /** @type {(keyof typeof CODES)[]} */ (Object.keys(CODES));

/** @param {About} about */
export function stateEditor(about) {
  const {tab, document, automaton, state, choose, readonly} = about;
  /** @type {Place} */
  const place = {kind: "state", automaton: automaton.id, id: state.id};
  const problems = placed(document.problems).filter((each) => isAt(placeOf(each), place));
  const inputs = inputsOf(document, state);
  /** @type {Tab[]} */
  const tabs = PARTS.map((id) => ({
    id,
    label: CODES[id].label,
    filled: state[id].trim() !== "",
    problems: problems.filter((each) => placeOf(each).part === id),
  }));
  if (inputs.length || state.arguments.length) {
    tabs.push({
      id: "argument",
      label: t("Arguments"),
      filled: state.arguments.length > 0,
      problems: problems.filter((each) => placeOf(each).part === "argument"),
    });
  }
  if (outputsOf(document, state).length || state.results.length) {
    tabs.push({
      id: "result",
      label: t("Results"),
      filled: state.results.length > 0,
      problems: problems.filter((each) => placeOf(each).part === "result"),
    });
  }
  const part = PARTS.find((each) => each === about.part) ?? "code";
  const shown = tabs.some((each) => each.id === about.part) ? about.part : part;
  const chosen = shown === "argument" || shown === "result" ? shown : part;
  const own = problems.filter((each) => !placeOf(each).part);
  const write = (/** @type {string} */ id) => page.edit({...place, part: id});
  return html` <div class="about">
      <hfsm-text-field
        class="title"
        data-part="name"
        label=${t("Name of the state")}
        .tab=${tab}
        .place=${{...place, part: "name"}}
        .text=${state.name}
        ?readonly=${readonly}
      ></hfsm-text-field>
      <div class="marks">
        <label
          ><input
            type="checkbox"
            .checked=${live(state.initial)}
            ?disabled=${state.initial || readonly}
            @change=${() => apply("markInitial", at(place))}
          />
          ${t("Initial")}</label
        >
        <label
          ><input
            type="checkbox"
            .checked=${live(isFinal(place, state))}
            ?disabled=${readonly}
            @change=${(/** @type {From<HTMLInputElement>} */ {target}) => markFinal(place, state, target)}
          />
          ${t("Final")}</label
        >
        ${state.children.length ? history(place, state, readonly) : nothing}
      </div>
      ${problemLines(own)}
    </div>
    ${tabStrip({label: t("Code of the state"), tabs, chosen, choose, write, prefix: "state"})}
    <div
      class="tab-panel ${chosen === part ? "" : "scrolling"}"
      role="tabpanel"
      id="state-panel"
      aria-labelledby="state-tab-${chosen}"
    >
      ${
        chosen === "argument"
          ? argumentList(about, place, inputs)
          : chosen === "result"
            ? resultList(about, place)
            : html`<hfsm-code-field
                class="fill"
                data-part=${part}
                .tab=${tab}
                .place=${{...place, part}}
                .text=${state[part]}
                ?readonly=${readonly}
                label=${codeOf(part, state.name)}
                hint=${CODES[part].hint}
              ></hfsm-code-field>`
      }
    </div>`;
}

/**
 * A choice that the server has not answered yet: it stays shown until then.
 *
 * @type {{key: string, final: boolean} | undefined}
 */
let chosenFinal;

/** @param {Place} place @param {State} state */
const isFinal = (place, state) => (chosenFinal?.key === keyOf(place) ? chosenFinal.final : state.final);

/** @param {Place} place @param {State} state @param {HTMLInputElement} target */
async function markFinal(place, state, target) {
  const mine = (chosenFinal = {key: keyOf(place), final: target.checked});
  const done = await apply("markFinal", {...at(place), final: target.checked});
  if (chosenFinal !== mine) return;
  chosenFinal = undefined;
  if (done === undefined) target.checked = state.final;
}

/** @param {Place} place */
const at = ({automaton = 0, id = 0}) => ({automaton, state: id});
/** @param {Place} one @param {Place} place */
const isAt = (one, place) => one.kind === place.kind && one.automaton === place.automaton && one.id === place.id;

/** @param {Place} place @param {State} state @param {boolean} readonly */
function history(place, state, readonly) {
  /** @param {From<HTMLSelectElement>} event */
  const choose = ({target}) => {
    const chosen = /** @type {Commands["setHistory"]["history"]} */ (target.value);
    return apply("setHistory", {...at(place), history: chosen});
  };
  return html`<label class="again"
    >${t("When entered again")}
    <select ?disabled=${readonly} @change=${choose}>
      <option value="" ?selected=${state.history !== "restart"}>${t("it goes on where it was")}</option>
      <option value="restart" ?selected=${state.history === "restart"}>${t("it restarts")}</option>
    </select></label
  >`;
}

/**
 * The inputs of the automata of a state, with their arguments.
 *
 * @param {OpenDocument} document
 * @param {State} state
 * @returns {Input[]}
 */
function inputsOf(document, state) {
  return state.children.flatMap((child) => {
    const automaton = document.automata.get(child);
    return (automaton?.inputs ?? []).map((input) => ({child, automaton, input}));
  });
}

/** Whether a state has no code, and automata with inputs. @param {OpenDocument} document @param {State} state */
export const isSetByArguments = (document, state) =>
  PARTS.every((part) => !state[part].trim()) && inputsOf(document, state).length > 0;

/** @param {About} about @param {Place} place @param {Input[]} inputs */
function argumentList({tab, document, state, readonly}, place, inputs) {
  const names = inputs.map((each) => each.input.name);
  /** @param {Argument} argument @param {number} child @param {string} name */
  const isFor = (argument, child, name) => argument.name === name && (argument.child === child || argument.child === 0);
  const strays = state.arguments.filter(
    (argument) => !inputs.some(({child, input}) => isFor(argument, child, input.name)),
  );
  /** @type {{name: string, child: number, input?: Parameter, given?: Argument, words: string}[]} */
  const rows = inputs.map(({child, input}) => {
    const given = state.arguments.find((argument) => isFor(argument, child, input.name));
    const several = names.filter((name) => name === input.name).length > 1;
    return {
      name: input.name,
      child: given?.child ?? (several ? child : 0),
      input,
      given,
      words: several ? ` ${t("of automaton {id}", {id: child})}` : "",
    };
  });
  for (const given of strays)
    rows.push({name: given.name, child: given.child, given, words: t("none of its automata has it")});
  return html`<p class="explain">
      ${t("Expressions over the variables of this automaton, passed to the automata below when the state is entered.")}
    </p>
    <ul class="entries">
      ${rows.map(({name, child, input, given, words}) => {
        const where = {...place, part: "argument", name, child};
        const problems = placed(document.problems).filter((each) => {
          const other = placeOf(each);
          return isAt(other, place) && other.part === "argument" && other.name === name;
        });
        return html`<li class="entry">
          <div class="entry-head">
            <strong class="mono">${name}</strong>
            <span class="faint"
              >${
                input
                  ? input.default
                    ? t("{type}, otherwise {value}", {type: input.type, value: input.default})
                    : t("{type}, needed", {type: input.type})
                  : ""
              }${words}</span
            >${badge(problems)}
            ${
              given && !readonly
                ? iconButton(
                    "delete",
                    t("Remove the argument {name}", {name}),
                    () => apply("removeArgument", {...at(place), name, child}),
                    {title: t("Remove")},
                  )
                : nothing
            }
          </div>
          ${keyed(
            `${state.id} ${name} ${child}`,
            html`<hfsm-code-field
              class="grow"
              wraps
              data-part="argument"
              data-name=${name}
              .tab=${tab}
              .place=${where}
              .text=${given?.value ?? ""}
              ?readonly=${readonly}
              label=${t("Argument {name}", {name})}
              hint=${input?.default || t("an expression")}
            ></hfsm-code-field>`,
          )}
          ${input?.description ? html`<p class="explain">${translated(input.description)}</p>` : nothing}
        </li>`;
      })}
    </ul>`;
}
