/**
 * A state in the panel beside the canvas: its name, its marks, its code, its arguments and results.
 *
 * @import {From} from "../data/element.js"
 * @import {Automaton, Commands, Place, State} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @typedef {{tab: number, document: OpenDocument, automaton: Automaton, state: State, part: string,
 *   choose: (part: string) => void, readonly: boolean}} About
 */

import {html, nothing} from "lit";
import {apply} from "../data/commands.js";
import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {keyOf, placeOf, problemsOf} from "../data/places.js";
import {tickBox} from "../kit/tick-box.js";
import {problemLines, tabStrip} from "../kit/tabs.js";
import {codeField, nameField} from "./fields.js";
import {argumentList, declaredIn, resultList} from "./arguments-and-results.js";

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

/** @type {{id: string, label: string, declared: "inputs" | "outputs", handed: "arguments" | "results"}[]} */
const LISTS = [
  {id: "argument", label: t("Arguments"), declared: "inputs", handed: "arguments"},
  {id: "result", label: t("Results"), declared: "outputs", handed: "results"},
];

export const PARTS = /** @type {(keyof typeof CODES)[]} */ (Object.keys(CODES));

/** @param {About} about */
export function stateEditor(about) {
  const {document, automaton, state, choose, readonly} = about;
  /** @type {Place} */
  const place = {kind: "state", automaton: automaton.id, id: state.id};
  const problems = problemsOf(document.problems, place);
  const parts = [
    ...PARTS.map((id) => ({id, label: CODES[id].label, filled: state[id].trim() !== "", isThere: true})),
    ...LISTS.map(({id, label, declared, handed}) => {
      const filled = state[handed].length > 0;
      return {id, label, filled, isThere: filled || declaredIn(document, state, declared).length > 0};
    }),
  ];
  const tabs = parts
    .filter(({isThere}) => isThere)
    .map((each) => ({...each, problems: problems.filter((one) => placeOf(one).part === each.id)}));
  const part = PARTS.find((each) => each === about.part) ?? "code";
  const shown = tabs.some((each) => each.id === about.part) ? about.part : part;
  const chosen = shown === "argument" || shown === "result" ? shown : part;
  const own = problems.filter((each) => !placeOf(each).part);
  const write = (/** @type {string} */ id) => page.edit({...place, part: id});
  return html` <div class="about">
      ${nameField(about, place, state.name, t("Name of the state"))}
      <div class="marks">
        ${tickBox(t("Initial"), state.initial, () => apply("markInitial", at(place)), {disabled: state.initial || readonly})}
        ${tickBox(t("Final"), isFinal(place, state), ({target}) => markFinal(place, state, target), {disabled: readonly})}
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
          ? argumentList(about, place)
          : chosen === "result"
            ? resultList(about, place)
            : codeField(about, {...place, part}, state[part], {
                look: "fill",
                label: codeOf(part, state.name),
                hint: CODES[part].hint,
              })
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

/** Whether a state has no code, and automata with inputs. @param {OpenDocument} document @param {State} state */
export const isSetByArguments = (document, state) =>
  PARTS.every((part) => !state[part].trim()) && declaredIn(document, state, "inputs").length > 0;
