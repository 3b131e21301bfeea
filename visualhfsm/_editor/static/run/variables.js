/**
 * Variables of the automata and parameters of the component; they can be set while it is steered.
 *
 * @import {From} from "../data/element.js"
 * @typedef {{type: string, description: string}} Note beside a name: its type, or what it has to do with others
 */

import {html, live, nothing} from "lit";

import {notify} from "../kit/notices.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {MonitorElement} from "./element.js";
import {monitor} from "./monitor.js";
import {spokenAngle, valueIn} from "./values.js";

const FRESH = 600; // ms for which a value that has changed is marked

class LiveVariables extends MonitorElement {
  /** @type {typeof MonitorElement.watches} */
  static watches = {page: ["automaton", "tab"], store: []};

  /** Values of the previous moment, to mark changes. */
  #before = /** @type {Map<string, string>} */ (new Map());
  #values = /** @type {Map<string, string>} */ (new Map());
  /** When each was seen to change, ms. @type {Map<string, number>} */
  #changed = new Map();
  /** The value that is being typed, and which one it is. @type {string | undefined} */
  editing = undefined;
  typed = "";

  render() {
    const {snapshot} = monitor;
    if (!snapshot) return html`<p class="empty">${t("Waiting for the first values.")}</p>`;
    const {component, robot} = snapshot;
    const here = page.automaton && page.tab === monitor.tab ? page.automaton.id : 0;
    const automata = component.automata.filter((each) => Object.keys(each.variables).length);
    automata.sort((a, b) => Number(b.id === here) - Number(a.id === here));
    const types = new Map((monitor.structure?.parameters ?? []).map((each) => [each.name, each]));
    [this.#before, this.#values] = [this.#values, new Map()];
    const none = !automata.length && !Object.keys(component.parameters).length;
    return html`<div class="live-values">
      ${none ? html`<p class="empty">${t("There are no variables and no parameters at this moment.")}</p>` : nothing}
      ${automata.map(({id, state, variables, ghost}) =>
        this.#table(
          monitor.automaton(id)?.name ?? t("automaton {id}", {id}),
          id,
          Object.entries(variables),
          ghost ? t("ghost") : "",
          exchanged(id, state),
        ),
      )}
      ${
        Object.keys(component.parameters).length
          ? this.#table(t("Parameters"), 0, Object.entries(component.parameters), "", types)
          : nothing
      }
      ${
        robot.pan === null && robot.tilt === null
          ? nothing
          : html`<section>
              <h3>${t("Head")}</h3>
              <table>
                <tbody>
                  ${angle("pan", robot.pan)}${angle("tilt", robot.tilt)}
                </tbody>
              </table>
            </section>`
      }
    </div>`;
  }

  /**
   * @param {string} title
   * @param {number} automaton
   * @param {[string, string][]} entries
   * @param {string} note
   * @param {Map<string, Note>} [notes]
   */
  #table(title, automaton, entries, note, notes) {
    return html`<section>
      <h3>${title}${note ? html` <span class="faint">${note}</span>` : nothing}</h3>
      <table aria-label=${title}>
        <tbody>
          ${entries.map(([name, text]) => this.#row(automaton, name, text, notes?.get(name)))}
        </tbody>
      </table>
    </section>`;
  }

  /** @param {number} automaton @param {string} name @param {string} text @param {Note} [type] */
  #row(automaton, name, text, type) {
    const key = `${automaton}.${name}`;
    this.#values.set(key, text);
    if (this.#before.has(key) && this.#before.get(key) !== text) this.#changed.set(key, performance.now());
    const fresh = performance.now() - (this.#changed.get(key) ?? -Infinity) < FRESH;
    if (!fresh) this.#changed.delete(key);
    return html`<tr class=${fresh ? "fresh" : ""}>
      <th scope="row" title=${type?.description ?? ""}>
        ${name}${type ? html` <span class="faint">${type.type}</span>` : nothing}
      </th>
      <td>
        ${
          monitor.steers
            ? html`<input
                class="mono"
                aria-label="${name}"
                spellcheck="false"
                .value=${live(this.editing === key ? this.typed : text)}
                @focus=${(/** @type {From<HTMLInputElement>} */ {target}) => this.#begin(key, text, target)}
                @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (this.typed = target.value)}
                @keydown=${(/** @type {KeyboardEvent & From<HTMLInputElement>} */ event) =>
                  this.#key(event, automaton, name, text)}
                @blur=${() => this.#end()}
              />`
            : html`<span class="mono" title=${text}>${text}</span>`
        }
      </td>
    </tr>`;
  }

  /** @param {string} key @param {string} text @param {HTMLInputElement} input */
  #begin(key, text, input) {
    this.editing = key;
    this.typed = text;
    input.select();
  }

  #end() {
    this.editing = undefined;
    this.requestUpdate();
  }

  /**
   * Enter sets the value, Escape leaves it.
   *
   * @param {KeyboardEvent & From<HTMLInputElement>} event
   * @param {number} automaton
   * @param {string} name
   * @param {string} text
   */
  async #key(event, automaton, name, text) {
    if (event.key === "Escape") {
      event.target.blur();
      return;
    }
    if (event.key !== "Enter") return;
    const value = valueIn(this.typed);
    if (value === undefined) {
      notify(
        t('{typed} is not a value: write a number, "a text", True, None, or a list or tuple of these.', {
          typed: this.typed,
        }),
        "error",
      );
      return;
    }
    const {target} = event;
    if ((await monitor.steer("setVariable", {automaton, name, value: JSON.stringify(value)})) === undefined) return;
    this.typed = target.value;
    target.blur();
    if (target.value !== text) notify(t("Set {name} to {value}.", {name, value: target.value}));
  }
}

/**
 * What the variables of an automaton have to do with others: its inputs and outputs, and the outputs that its state
 * takes into them. It is known where the document is open.
 *
 * @param {number} id
 * @param {number} state
 * @returns {Map<string, Note>}
 */
function exchanged(id, state) {
  const document = monitor.tab === undefined ? undefined : store.documents.get(monitor.tab);
  const automaton = document?.automata.get(id);
  /** @type {Map<string, Note>} */
  const found = new Map();
  for (const {name, variable} of automaton?.states.find((each) => each.id === state)?.results ?? [])
    found.set(variable.trim(), {type: t("from {output}", {output: name}), description: ""});
  for (const {name, description} of automaton?.inputs ?? []) found.set(name, {type: t("input"), description});
  for (const {name, description} of automaton?.outputs ?? []) found.set(name, {type: t("output"), description});
  return found;
}

/** @param {string} name @param {number | null} radians */
const angle = (name, radians) =>
  radians === null
    ? nothing
    : html`<tr>
        <th scope="row">${name}</th>
        <td>${spokenAngle(radians)}</td>
      </tr>`;

customElements.define("hfsm-live-variables", LiveVariables);
