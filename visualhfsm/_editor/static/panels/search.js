/** Search in the names and all code of the document, or of all open ones, and replace in its code. */

import {html, nothing} from "lit";
import {PageElement, properties} from "../data/element.js";
import {apply} from "../data/commands.js";
import {spoken} from "../kit/keys.js";
import {messageOf, notify} from "../kit/notices.js";
import {wordButton} from "../kit/buttons.js";
import {tickBox} from "../kit/tick-box.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {n, t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";
import {keyOf, wordsFor} from "../data/places.js";
import {moveAmongRows, pathOf} from "../kit/rows.js";

const PAUSE = 150; // ms
const SHOWN = 200;
const MOST = 1000; // hits that the server finds
/** The parts of a document that hold code, of which the lines have numbers, and the others. */
const LINES = /^(entry|code|exit|fired|variables|functions)$/;
const PHRASES = /^(trigger|guard|argument)$/;
/** @param {Hit} hit */
const inCode = ({place: {part = ""}}) => LINES.test(part) || PHRASES.test(part);

/**
 * @import {From} from "../data/element.js"
 * @import {Place} from "../data/protocol.js"
 * @typedef {import("../data/protocol.js").Hit & {tab: number}} Hit
 */

class Search extends PageElement {
  static properties = properties("text", "by", "whole", "hits", "everywhere", "failed", "shown");
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab"], store: []};

  #timer = 0;
  #asked = 0;
  /** Resolves once the hits are those of what was typed. */
  #asking = Promise.resolve();
  #last = 0; // index of the hit that was shown last, or of what took its place

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
    /** What identifies the hit that was shown last, "" for none. */
    this.shown = "";
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
    const current = hits?.[this.#current];
    const listed = Math.max(SHOWN, lines.findIndex((line) => current && line.includes(current)) + 1);
    return html`<div class="list-panel">
      <form class="list-tools" role="search" @submit=${this.#submit}>
        <input
          type="search"
          aria-label=${t("Search in names and code")}
          placeholder=${t("Search in names and code")}
          .value=${text}
          @input=${(/** @type {From<HTMLInputElement>} */ {target}) => this.#afresh({text: target.value})}
          @keydown=${this.#press}
          aria-description=${t("{next} shows the next hit, {former} the one before", {next: spoken("Enter"), former: spoken("Shift+Enter")})}
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
        ${tickBox(t("Whole word, same case"), this.whole, ({target}) => this.#afresh({whole: target.checked}))}
        ${tickBox(t("In all open documents"), this.everywhere, ({target}) => this.#afresh({everywhere: target.checked}))}
        <span class="room"></span><span class="faint" role="status">${this.failed || this.#count()}</span>
      </form>
      ${
        hits?.length
          ? html`<ol class="rows" aria-label=${t("Found")} @keydown=${moveAmongRows}>
              ${lines.slice(0, listed).map((line) => this.#row(line, current))}
              ${
                lines.length > listed
                  ? html`<li class="faint rest">
                      ${t("{count} more lines: search for more letters.", {count: lines.length - listed})}
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

  /** How many hits there are, and which of them is shown. */
  #count() {
    const count = this.hits?.length;
    if (count === undefined) return "";
    const number = this.#current + 1;
    if (number)
      return count >= MOST
        ? t("{number} of {count} or more", {number, count})
        : t("{number} of {count}", {number, count});
    return count >= MOST ? t("{count} or more found", {count}) : n("{count} found", "{count} found", count);
  }

  /** The button for all code of the shown document. */
  #replaceAll() {
    const count = (this.hits ?? []).filter((hit) => hit.tab === page.tab && inCode(hit)).length;
    if (!count) return nothing;
    const many = (this.hits?.length ?? 0) >= MOST ? t("{count} or more", {count}) : String(count);
    const words = this.by ? t("Replace {many} in code", {many}) : t("Delete {many} in code", {many});
    return wordButton(words, () => this.#replace({}));
  }

  /** Replace in all code of the document, or in a line of it. @param {{place?: Place, line?: number}} where */
  async #replace(where) {
    const {text, by, whole} = this;
    const done = await apply("replaceText", {text, by, whole, ...where});
    if (done) notify(t("{name}: done.", {name: done.name}));
  }

  /** @param {Hit[]} line the hits in one line @param {Hit | undefined} current */
  #row(line, current) {
    const [hit] = line;
    const document = store.documents.get(hit.tab);
    const title = hit.tab !== page.tab ? store.workspace.tabs.find((each) => each.tab === hit.tab)?.title : undefined;
    const words = [...(title ? [title] : []), ...(document ? wordsFor(document, hit.place) : [])];
    if (hit.line > 1 || LINES.test(hit.place.part ?? "")) words.push(`${words.pop() ?? ""}:${hit.line}`);
    return html`<li class="hit-row">
      <button
        type="button"
        class="row hit"
        aria-current=${current && line.includes(current) ? "true" : nothing}
        @click=${() => this.#go(hit)}
      >
        ${pathOf(words)}
        <code class="excerpt">${marked(line)}</code>
      </button>
      ${
        this.by && hit.tab === page.tab && inCode(hit)
          ? wordButton(t("Replace"), () => this.#replace({place: hit.place, line: hit.line}), {
              label: t("Replace in {where}", {where: words.join(" › ")}),
            })
          : nothing
      }
    </li>`;
  }

  /** @param {Hit} hit */
  #go(hit, {focus = true} = {}) {
    const {tab, place, line, column, length} = hit;
    this.shown = idOf(hit);
    this.#last = this.#current;
    page.show(tab);
    page.jump(place, {line, column, length, focus});
  }

  /** The index of the hit that was shown last, -1 if there is none or it is gone. */
  get #current() {
    const {hits, shown} = this;
    if (!hits || !shown) return -1;
    return hits[this.#last] && idOf(hits[this.#last]) === shown
      ? this.#last
      : hits.findIndex((each) => idOf(each) === shown);
  }

  /** Show the hit that many after the one shown last; the focus stays in the field. @param {number} step */
  async #step(step) {
    if (this.#timer) this.#ask();
    await this.#asking;
    const {hits} = this;
    if (!hits?.length) return;
    // Where the one shown last is gone, the next one has its index.
    const from = this.#current >= 0 ? this.#current : step > 0 ? this.#last - 1 : this.#last;
    this.#go(hits[(from + step + hits.length) % hits.length], {focus: false});
    await this.updateComplete;
    this.querySelector("[aria-current]")?.scrollIntoView({block: "nearest"});
  }

  /** Search for something else. @param {{text?: string, whole?: boolean, everywhere?: boolean}} sought */
  #afresh(sought) {
    Object.assign(this, sought);
    this.shown = "";
    this.#last = 0;
    this.#soon();
  }

  /** @param {Event} event */
  #submit = (event) => {
    event.preventDefault();
    this.#step(1);
  };

  /** @param {KeyboardEvent} event */
  #press = (event) => {
    const {key, shiftKey, isComposing} = event;
    if (isComposing || (key !== "ArrowDown" && key !== "Enter")) return;
    event.preventDefault();
    if (key === "Enter") this.#step(shiftKey ? -1 : 1);
    else
      /** @type {HTMLElement | null} */ (
        this.querySelector("[aria-current]") ?? this.querySelector("button.row")
      )?.focus();
  };

  #soon() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#ask(), PAUSE);
  }

  /** Search now. */
  #ask() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    this.#asking = this.#find();
  }

  async #find() {
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
      if (this.#current >= 0) this.#last = this.#current;
      this.failed = "";
    } catch (error) {
      if (number === this.#asked) this.failed = messageOf(error);
    }
  }
}

/** What identifies a hit in a later search for the same. @param {Hit} hit */
const idOf = ({tab, place, line, column}) => `${tab} ${keyOf(place)} ${line} ${column}`;

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
