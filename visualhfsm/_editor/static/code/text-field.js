/**
 * A short text in a panel with its label and its problems.
 *
 * @import {From} from "../data/element.js"
 * @import {Done, Place, Problem} from "../data/protocol.js"
 */

import {html, live, nothing} from "lit";
import {PageElement, properties} from "../data/element.js";
import {store} from "../data/store.js";
import {coded, spokenTime, t, toMilliseconds} from "../kit/texts.js";
import {Draft, isTooLong} from "./draft.js";
import {fixButtons} from "./fixes.js";
import {commandFor, keyOf, problemsAt} from "../data/places.js";
import {isVerdict} from "./verdicts.js";

let count = 0;

/**
 * `kind` is `text`, `number`, `time` (such as `1.5 s`, milliseconds in the document), `area`, or `select` with `options` of [value, label]. `suggestions` are optional.
 * `send(tab, text)` replaces the command for its place.
 */
export class TextField extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {store: ["problems", "fixes"]};
  static properties = {
    ...properties("tab", "place", "text", "options", "suggestions", "send"),
    label: {},
    hint: {},
    kind: {},
    readonly: {type: Boolean},
    mono: {type: Boolean},
  };

  constructor() {
    super();
    this.tab = 0;
    /** @type {Place} */
    this.place = {kind: "document"};
    this.label = "";
    this.readonly = false;
    this.mono = false;
    /** @type {((tab: number, text: string) => Promise<Done>) | undefined} */
    this.send = undefined;
    this.text = "";
    this.kind = "text";
    this.hint = "";
    /** @type {string[]} */
    this.suggestions = [];
    /** @type {[value: string, label: string][]} */
    this.options = [];
    this.number = ++count;
    /** The time that is being typed. @type {string | undefined} */
    this.typed = undefined;
  }

  #draft = new Draft(() => this.requestUpdate());

  disconnectedCallback() {
    super.disconnectedCallback();
    this.#draft.flush();
  }

  willUpdate() {
    const {place, send, kind} = this;
    this.#draft.take(
      this.tab,
      keyOf(place),
      this.text,
      send ?? ((tab, text, base) => store.do(tab, commandFor(place, text), base)),
      kind === "area",
    );
  }

  render() {
    const {label, number} = this;
    const problems = problemsAt(store.documents.get(this.tab)?.problems ?? [], this.place).filter(
      (each) => !isVerdict(each),
    );
    const id = `field-${number}`;
    return html` <label for=${id}>${label}</label>
      <span class="field-box">${this.#input(id, problems)}</span>
      ${
        this.suggestions.length
          ? html`<datalist id="${id}-list">
              ${this.suggestions.map((each) => html`<option value=${each}></option>`)}
            </datalist>`
          : nothing
      }
      ${
        problems.length
          ? html`<span class="field-problems" id="${id}-problems"
              >${problems.map((each) => html`<span class=${each.severity}>${coded(each.message)}</span>`)}
              ${fixButtons(store.documents.get(this.tab), problems)}</span
            >`
          : nothing
      }`;
  }

  focus() {
    /** @type {HTMLInputElement | null} */
    const input = this.querySelector("input, textarea, select");
    input?.focus();
    if (this.kind === "time") input?.select();
  }

  /** @param {string} id @param {Problem[]} problems */
  #input(id, problems) {
    const {kind, hint} = this;
    const readonly = this.readonly || store.isRecorded(this.tab);
    const text = kind === "time" ? (this.typed ?? spokenTime(this.#draft.text)) : this.#draft.text;
    const invalid = problems.some((each) => each.severity === "error") ? "true" : nothing;
    const described = problems.length ? `${id}-problems` : nothing;
    if (kind === "select") {
      const known = this.options.some(([value]) => value === text.trim());
      return html`<select
        id=${id}
        ?disabled=${readonly}
        aria-invalid=${invalid}
        aria-describedby=${described}
        @change=${this.#choose}
      >
        ${this.options.map(
          ([value, shown]) => html`<option value=${value} ?selected=${value === text.trim()}>${shown}</option>`,
        )}
        ${known ? nothing : html`<option value=${text} selected>${text || t("none")}</option>`}
      </select>`;
    }
    if (kind === "area") {
      return html`<textarea
        id=${id}
        class=${this.mono ? "mono" : ""}
        rows="2"
        spellcheck=${this.mono ? "false" : "true"}
        placeholder=${hint}
        ?readonly=${readonly}
        .value=${live(text)}
        aria-invalid=${invalid}
        aria-describedby=${described}
        @input=${this.#type}
        @blur=${this.#leave}
      ></textarea>`;
    }
    return html`<input
      id=${id}
      class=${this.mono || kind === "number" || kind === "time" ? "mono" : ""}
      type="text"
      inputmode=${kind === "number" ? "decimal" : nothing}
      spellcheck="false"
      autocomplete="off"
      placeholder=${hint}
      title=${text.length > 14 ? text : nothing}
      ?readonly=${readonly}
      .value=${live(text)}
      list=${this.suggestions.length ? `${id}-list` : nothing}
      aria-invalid=${invalid}
      aria-describedby=${described}
      @input=${this.#type}
      @blur=${this.#leave}
      @keydown=${this.#press}
    />`;
  }

  /** @param {From<HTMLInputElement | HTMLTextAreaElement>} event */
  #type = ({target}) => {
    if (isTooLong(target.value.length)) {
      target.value = this.#draft.text;
      return;
    }
    if (this.kind === "time") this.typed = target.value;
    this.#draft.type(this.kind === "time" ? toMilliseconds(target.value) : target.value);
  };

  /** @param {From<HTMLSelectElement>} event */
  #choose = ({target}) => {
    this.#draft.type(target.value);
    this.#draft.flush();
  };

  #leave = () => {
    this.#draft.flush();
    if (this.typed === undefined) return;
    this.typed = undefined;
    this.requestUpdate();
  };

  /** @param {KeyboardEvent} event */
  #press = (event) => {
    if (event.key === "Enter") this.#draft.flush();
  };
}

customElements.define("hfsm-text-field", TextField);
