/**
 * A list of a document, such as its parameters: entries to add, change, move and remove.
 *
 * @import {Place, Problem} from "../data/protocol.js"
 * @import {EntryList} from "./data.js"
 * @import {TextField} from "../code/text-field.js"
 * @typedef {Record<string, string>} Entry of a list, such as a parameter
 */

import {html, nothing} from "lit";
import {apply} from "../data/commands.js";
import {drawn, PageElement, properties} from "../data/element.js";
import {icon, iconButton} from "../kit/icons.js";
import {spoken} from "../kit/keys.js";
import {t} from "../kit/texts.js";
import {fixButtons} from "../code/fixes.js";
import {placeOf} from "../data/places.js";
import {page} from "../data/page.js";
import {problemLines} from "../kit/tabs.js";

/**
 * `details(entry, index)` returns the content below the fields of an entry, `suggest(field, entry)` the suggestions for
 * one.
 */
export class Entries extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {store: ["fixes"]};
  static properties = properties("tab", "automaton", "of", "entries", "problems", "details", "suggest");

  constructor() {
    super();
    this.tab = 0;
    this.automaton = 0;
    /** @type {EntryList} */
    this.of = {list: "parameters", title: "", noun: "", add: "", explain: "", fields: []};
    /** @type {Entry[]} */
    this.entries = [];
    /** @type {Problem[]} */
    this.problems = [];
    /** @type {(entry: Entry, index: number) => unknown} */
    this.details = () => nothing;
    /** @type {(field: string, entry: Entry) => string[]} */
    this.suggest = () => [];
  }

  render() {
    const {title, add, explain} = this.of;
    const count = this.entries.length;
    return html` <header class="entries-head">
        <h3>${title}${count ? html` <span class="faint">${count}</span>` : nothing}</h3>
        <button type="button" class="action add" aria-label=${add} @click=${this.#add}>
          ${icon("add")}<span class="text">${t("Add")}</span>
        </button>
      </header>
      <p class="explain">${explain}</p>
      <div class="entries">${this.entries.map((entry, index) => this.#entry(entry, index))}</div>`;
  }

  /** Show a field of an entry. @param {number} index @param {string} [field] */
  async reveal(index, field, {focus = true} = {}) {
    await drawn();
    const entry = this.querySelectorAll(".entry")[index];
    entry?.scrollIntoView({block: "nearest"});
    /** @type {TextField | null | undefined} */
    const wanted = entry?.querySelector(`hfsm-text-field[data-field="${field || this.of.fields[0].name}"]`);
    await wanted?.updateComplete;
    if (focus) wanted?.focus();
  }

  /** @param {Entry} entry @param {number} index */
  #entry(entry, index) {
    const {list, noun, fields} = this.of;
    const words = `${noun} ${entry.name || entry.part || index + 1}`;
    /** @type {Place} */
    const place = {kind: this.automaton ? "automaton" : "document", automaton: this.automaton, part: list, index};
    const own = this.problems.filter((each) => {
      const other = placeOf(each);
      return (
        other.part === list && (other.automaton ?? 0) === this.automaton && (other.index ?? 0) === index && !other.name
      );
    });
    const last = this.entries.length - 1;
    return html`<div
      class="entry"
      role="group"
      aria-label=${words}
      @keydown=${(/** @type {KeyboardEvent} */ event) => this.#press(event, index)}
    >
      <div class="entry-fields">
        ${fields.map(
          (field) =>
            html`<hfsm-text-field
              data-field=${field.name}
              .tab=${this.tab}
              .place=${{...place, name: field.name}}
              .text=${entry[field.name] ?? ""}
              label=${field.label}
              kind=${field.kind ?? "text"}
              .options=${field.options ?? []}
              hint=${field.hint ?? field.example ?? ""}
              ?mono=${field.mono}
              .suggestions=${this.suggest(field.name, entry)}
            ></hfsm-text-field>`,
        )}
      </div>
      <div class="entry-actions">
        ${iconButton("up", t("Move {entry} up", {entry: words}), () => this.#move(index, index - 1), {
          title: t("Move up ({key})", {key: spoken("Alt+ArrowUp")}),
          disabled: index === 0,
        })}
        ${iconButton("up", t("Move {entry} down", {entry: words}), () => this.#move(index, index + 1), {
          title: t("Move down ({key})", {key: spoken("Alt+ArrowDown")}),
          kind: "down",
          disabled: index === last,
        })}
        ${iconButton("delete", t("Remove {entry}", {entry: words}), () => this.#remove(index), {title: t("Remove")})}
      </div>
      ${problemLines(own)} ${fixButtons(page.document, own)} ${this.details(entry, index)}
    </div>`;
  }

  #add = async () => {
    const index = this.entries.length;
    if ((await apply("addEntry", {list: this.of.list, automaton: this.automaton})) === undefined) return;
    await this.reveal(index);
    this.querySelectorAll(".entry")[index]?.querySelector("input")?.select();
  };

  /** @param {number} index @param {number} to */
  async #move(index, to) {
    if (to < 0 || to >= this.entries.length) return;
    if ((await apply("reorderEntry", {list: this.of.list, index, to, automaton: this.automaton})) !== undefined)
      await this.reveal(to);
  }

  /** @param {number} index */
  async #remove(index) {
    if ((await apply("removeEntry", {list: this.of.list, index, automaton: this.automaton})) === undefined) return;
    await drawn();
    const left = this.querySelectorAll(".entry");
    /** @type {HTMLElement | null} */
    const next = left[Math.min(index, left.length - 1)]?.querySelector("input") ?? this.querySelector(".add");
    next?.focus();
  }

  /** @param {KeyboardEvent} event @param {number} index */
  #press(event, index) {
    const step = /** @type {Record<string, number>} */ ({ArrowUp: -1, ArrowDown: 1})[event.key];
    if (!step || !event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    this.#move(index, index + step);
  }
}

customElements.define("hfsm-entries", Entries);
