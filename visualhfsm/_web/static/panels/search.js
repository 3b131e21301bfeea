/** Search in the names and all code of the document, or of all open ones, and replace in its code. */

import {html, nothing} from "lit";
import {PageElement} from "../element.js";
import {apply} from "../commands.js";
import {messageOf, notify} from "../notices.js";
import {page} from "../page.js";
import {store} from "../store.js";
import {n, t} from "../texts.js";
import {viewing} from "../viewing.js";
import {keyOf, wordsFor} from "./places.js";
import {moveAmongRows} from "./rows.js";

const PAUSE = 150; // ms
const SHOWN = 200;
const MOST = 1000; // hits that the server finds
/** The parts of a document that hold code, of which the lines have numbers, and the others. */
const LINES = /^(entry|code|exit|fired|variables|functions)$/;
const PHRASES = /^(trigger|guard|argument)$/;
/** @param {Hit} hit */
const inCode = ({place: {part = ""}}) => LINES.test(part) || PHRASES.test(part);

/**
 * @import {From} from "../element.js"
 * @import {Place} from "../protocol.js"
 * @typedef {import("../protocol.js").Hit & {tab: number}} Hit
 */

class Search extends PageElement {
  static properties = {
    text: {state: true},
    by: {state: true},
    whole: {state: true},
    hits: {state: true},
    everywhere: {state: true},
    failed: {state: true},
  };
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab"], store: []};

  #timer = 0;
  #asked = 0;

  constructor() {
    super();
    this.text = "";
    /** The replacement. */
    this.by = "";
    this.whole = false;
    /** @type {Hit[] | null} */
    this.hits = null;
    this.everywhere = false;
    this.failed = "";
  }

  connectedCallback() {
    super.connectedCallback();
    this.listen(store, "document", () => this.text && this.#soon());
    this.listen(page, "tab", () => this.text && this.#soon());
    if (this.text) this.#soon();
  }

  focusFirst() {
    /** @type {HTMLInputElement | null} */
    const input = this.querySelector("input[type=search]");
    input?.focus();
    input?.select();
  }

  render() {
    const {hits, text} = this;
    const lines = byLine(hits ?? []);
    const more = lines.length > SHOWN;
    return html`<div class="list-panel">
      <form class="list-tools" role="search" @submit=${this.#submit}>
        <input
          type="search"
          aria-label=${t("Search in names and code")}
          placeholder=${t("Search in names and code")}
          .value=${text}
          @input=${this.#type}
          @keydown=${this.#press}
          spellcheck="false"
          autocomplete="off"
        />
        ${
          viewing.on
            ? nothing
            : html`<input
                  type="text"
                  aria-label=${t("Replace by")}
                  placeholder=${t("Replace by")}
                  .value=${this.by}
                  @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (this.by = target.value)}
                  spellcheck="false"
                  autocomplete="off"
                />
                ${this.#replaceAll()}`
        }
        <label
          ><input
            type="checkbox"
            .checked=${this.whole}
            @change=${(/** @type {From<HTMLInputElement>} */ {target}) => {
              this.whole = target.checked;
              this.#soon();
            }}
          />
          ${t("Whole word, same case")}</label
        >
        <label
          ><input type="checkbox" .checked=${this.everywhere} @change=${this.#widen} />
          ${t("In all open documents")}</label
        >
        <span class="room"></span
        ><span class="faint" role="status"
          >${this.failed || (hits ? (hits.length >= MOST ? t("{count} or more found", {count: hits.length}) : n("{count} found", "{count} found", hits.length)) : "")}</span
        >
      </form>
      ${
        hits?.length
          ? html`<ol class="rows" aria-label=${t("Found")} @keydown=${moveAmongRows}>
              ${lines.slice(0, SHOWN).map((line) => this.#row(line))}
              ${
                more
                  ? html`<li class="faint rest">
                      ${t("{count} more lines: search for more letters.", {count: lines.length - SHOWN})}
                    </li>`
                  : nothing
              }
            </ol>`
          : html`<p class="empty">
              ${
                text && hits
                  ? t("No matches for “{text}”.", {text})
                  : t("The search covers names of states and transitions, all code, and the data.")
              }
            </p>`
      }
    </div>`;
  }

  /** The button for all code of the shown document. */
  #replaceAll() {
    const count = (this.hits ?? []).filter((hit) => hit.tab === page.tab && inCode(hit)).length;
    if (!count) return nothing;
    const many = (this.hits?.length ?? 0) >= MOST ? t("{count} or more", {count}) : String(count);
    return html`<button type="button" class="tool" @click=${() => this.#replace({})}>
      ${this.by ? t("Replace {many} in code", {many}) : t("Delete {many} in code", {many})}
    </button>`;
  }

  /** Replace in all code of the document, or in a line of it. @param {{place?: Place, line?: number}} where */
  async #replace(where) {
    const {text, by, whole} = this;
    const done = await apply("replaceText", {text, by, whole, ...where});
    if (done) notify(t("{name}: done.", {name: done.name}));
  }

  /** @param {Hit[]} line the hits in one line */
  #row(line) {
    const [hit] = line;
    const document = store.documents.get(hit.tab);
    const title = hit.tab !== page.tab ? store.workspace.tabs.find((each) => each.tab === hit.tab)?.title : undefined;
    const words = document ? wordsFor(document, hit.place) : [];
    const number = hit.line > 1 || LINES.test(hit.place.part ?? "") ? `:${hit.line}` : "";
    const where = `${[title, ...words].filter(Boolean).join(" › ")}${number}`;
    return html`<li class="hit-row">
      <button type="button" class="row hit" @click=${() => this.#go(hit)}>
        <span class="where" title=${where}><bdi>${where}</bdi></span>
        <code class="excerpt">${marked(line)}</code>
      </button>
      ${
        this.by && hit.tab === page.tab && inCode(hit)
          ? html`<button
              type="button"
              class="tool"
              aria-label=${t("Replace in {where}", {where})}
              @click=${() => this.#replace({place: hit.place, line: hit.line})}
            >
              ${t("Replace")}
            </button>`
          : nothing
      }
    </li>`;
  }

  /** @param {Hit} hit */
  #go(hit) {
    page.show(hit.tab);
    page.jump(hit.place, {line: hit.line, column: hit.column});
  }

  /** @param {From<HTMLInputElement>} event */
  #type = ({target}) => {
    this.text = target.value;
    this.#soon();
  };

  /** @param {From<HTMLInputElement>} event */
  #widen = ({target}) => {
    this.everywhere = target.checked;
    this.#soon();
  };

  /** @param {Event} event */
  #submit = (event) => {
    event.preventDefault();
    this.#first?.click();
  };

  /** @param {KeyboardEvent} event */
  #press = (event) => {
    if (event.key !== "ArrowDown") return;
    event.preventDefault();
    this.#first?.focus();
  };

  /** The first hit. @returns {HTMLElement | null} */
  get #first() {
    return this.querySelector("button.row");
  }

  #soon() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#ask(), PAUSE);
  }

  async #ask() {
    const {text, whole} = this;
    const number = ++this.#asked;
    if (!text || !page.tab) {
      this.hits = null;
      return;
    }
    try {
      const found = await store.request("search", {text, whole, ...(this.everywhere ? {} : {tab: page.tab})});
      if (number !== this.#asked) return;
      this.hits = found.flatMap(({tab, hits}) => hits.map((hit) => ({...hit, tab})));
      this.failed = "";
    } catch (error) {
      if (number === this.#asked) this.failed = messageOf(error);
    }
  }
}

/** Hits grouped by their lines. @param {Hit[]} hits */
function byLine(hits) {
  /** @type {Hit[][]} */
  const lines = [];
  for (const hit of hits) {
    const last = lines.at(-1);
    const former = last?.[0];
    const isSame =
      former?.tab === hit.tab &&
      former.line === hit.line &&
      former.excerpt === hit.excerpt &&
      keyOf(former.place) === keyOf(hit.place);
    if (last && isSame) last.push(hit);
    else lines.push([hit]);
  }
  return lines;
}

/** The excerpt of a line with all its hits marked. @param {Hit[]} line */
function marked(line) {
  const [{excerpt}] = line;
  const ends = line.map(({start, length}) => start + length);
  return [
    ...line.map(
      ({start}, index) =>
        html`${excerpt.slice(index ? ends[index - 1] : 0, start)}<mark>${excerpt.slice(start, ends[index])}</mark>`,
    ),
    excerpt.slice(ends.at(-1)),
  ];
}

customElements.define("hfsm-search", Search);
