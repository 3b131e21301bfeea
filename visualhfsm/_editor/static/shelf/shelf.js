/**
 * The shelf: ready states that are drawn by a click, a key, or by carrying them to the canvas.
 *
 * @import {From} from "../data/element.js"
 * @import {ReadyState, ReadyValue} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {PageElement} from "../data/element.js";
import {icon, isIcon} from "../kit/icons.js";
import {isTyping, keyOf} from "../kit/keys.js";
import {page} from "../data/page.js";
import {resizer} from "../kit/resizer.js";
import {browserStorage} from "../kit/location.js";
import {rich, t} from "../kit/texts.js";
import {Carrying} from "./carrying.js";
import {drawReady, findReady, lacking, readyStates} from "./ready-states.js";

const CLOSED = "visualhfsm.shelf";
const TALL = 620; // px of height from which it is open by default

/** The line that changes its height. */
const heightLine = () =>
  resizer({name: t("Height of the shelf"), variable: "--shelf", along: "y", sign: -1, smallest: 120, largest: 900});

export class Shelf extends PageElement {
  static properties = {open: {state: true}, text: {state: true}, chosen: {state: true}, described: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["shelf", "connection", "robot"]};

  constructor() {
    super();
    const remembered = browserStorage.getItem(CLOSED);
    this.open = remembered ? remembered === "open" : innerHeight >= TALL;
    this.text = "";
    /** The id of the one that the keys have chosen. */
    this.chosen = "";
    /** The id of the one that is described beside the shelf: the one below the pointer, or that the keys have chosen. */
    this.described = "";
  }

  connectedCallback() {
    super.connectedCallback();
    /** @type {import("../kit/events.js").Target<{keydown: null}>} */
    const keys = window;
    this.listen(keys, "keydown", ({target}) => {
      if (isTyping(target) && target !== this.querySelector("input")) this.described = ""; // it may lie over what is typed
    });
  }

  /** Open it, and let its search be typed. */
  async search() {
    this.#toggle(true);
    await this.updateComplete;
    const field = /** @type {HTMLInputElement | null} */ (this.querySelector("input"));
    field?.focus();
    field?.select();
  }

  render() {
    if (!page.document) return nothing;
    return html`<section class="shelf ${this.open ? "open" : ""}" aria-label=${t("Shelf")}>
      ${this.open ? heightLine() : nothing}
      <h2>
        <button
          type="button"
          aria-expanded=${this.open}
          aria-controls="shelf-content"
          title=${t("Ready states to draw ({key})", {key: keyOf("shelf")})}
          @click=${() => this.#toggle(!this.open)}
        >
          ${icon("chevron")}<span>${t("Shelf")}</span>
        </button>
      </h2>
      <div class="shelf-content" id="shelf-content" ?hidden=${!this.open}>${this.open ? this.#content() : nothing}</div>
    </section>`;
  }

  /** What is shown, and which of it the keys have chosen; typed keys may come faster than it is drawn. */
  #look() {
    const found = findReady(this.text);
    return {found, chosen: found.find(({id}) => id === this.chosen) ?? (this.text.trim() ? found[0] : undefined)};
  }

  #content() {
    const {found, chosen} = this.#look();
    const described = found.find(({id}) => id === this.described);
    return html`<input
        type="search"
        role="combobox"
        aria-label=${t("Search the shelf")}
        aria-expanded="true"
        aria-controls="shelf-list"
        aria-activedescendant=${chosen ? optionOf(chosen) : nothing}
        aria-describedby="shelf-about"
        placeholder=${t("Search")}
        autocomplete="off"
        spellcheck="false"
        .value=${this.text}
        @input=${(/** @type {From<HTMLInputElement>} */ {target}) => {
          this.text = target.value;
          this.chosen = "";
          this.described = target.value.trim() ? (findReady(target.value)[0]?.id ?? "") : "";
        }}
        @blur=${() => (this.described = "")}
        @keydown=${this.#key}
      />
      <div
        class="shelf-list"
        id="shelf-list"
        role="listbox"
        aria-label=${t("Ready states")}
        @pointerleave=${() => (this.described = "")}
        @scroll=${() => this.requestUpdate()}
      >
        ${this.text.trim() ? found.map((each) => this.#option(each, chosen)) : this.#groups(found, chosen)}
        ${found.length ? nothing : html`<p class="faint" role="presentation">${t("Nothing with these words.")}</p>`}
      </div>
      <p class="shelf-hint faint">${t("Click, or drag to the canvas")}</p>
      <div class="shelf-about" id="shelf-about" ?hidden=${!described}>${described ? about(described) : nothing}</div>`;
  }

  /** The ready states by their categories. @param {ReadyState[]} found @param {ReadyState | undefined} chosen */
  #groups(found, chosen) {
    /** @type {Map<string, ReadyState[]>} */
    const groups = new Map();
    for (const each of found) groups.set(each.category, [...(groups.get(each.category) ?? []), each]);
    return [...groups].map(
      ([category, states], index) =>
        html`<div role="group" aria-labelledby="shelf-group-${index}">
          <div class="shelf-category" id="shelf-group-${index}" role="presentation">${category}</div>
          ${states.map((each) => this.#option(each, chosen))}
        </div>`,
    );
  }

  /** @param {ReadyState} ready @param {ReadyState | undefined} chosen */
  #option(ready, chosen) {
    const lacks = lacking(ready);
    return html`<div
      role="option"
      id=${optionOf(ready)}
      class="ready ${ready.trouble ? "broken" : lacks ? "lacking" : ""}"
      aria-selected=${ready === chosen}
      aria-disabled=${ready.trouble ? "true" : nothing}
      aria-label=${
        ready.trouble
          ? t("{title}, cannot be used: {trouble}", {title: ready.title, trouble: ready.trouble})
          : [ready.title, lacks].filter(Boolean).join(", ")
      }
      @pointerenter=${() => (this.described = ready.id)}
      @pointerdown=${(/** @type {PointerEvent & From<HTMLElement>} */ event) => this.#press(event, ready)}
    >
      ${icon(ready.trouble ? "problems" : isIcon(ready.icon) ? ready.icon : "state")}<span class="text"
        >${ready.title}</span
      >
    </div>`;
  }

  /** @param {PointerEvent & From<HTMLElement>} event @param {ReadyState} ready */
  #press(event, ready) {
    if (event.button !== 0 || !event.isPrimary) return;
    if (event.pointerType !== "touch") event.preventDefault(); // text would be selected
    this.chosen = ready.id;
    const {canvas} = this.context;
    new Carrying(canvas, ready, event, {
      began: () => (this.described = ""),
      ended: (where) => where && this.#draw(ready, where),
    });
  }

  /** @param {KeyboardEvent} event */
  #key = (event) => {
    const {found, chosen} = this.#look();
    const step = /** @type {Record<string, number>} */ ({ArrowDown: 1, ArrowUp: -1})[event.key];
    if (step && found.length) {
      const index = chosen ? found.indexOf(chosen) + step : step > 0 ? 0 : -1;
      const next = found[(index + found.length) % found.length];
      this.chosen = next.id;
      document.getElementById(optionOf(next))?.scrollIntoView({block: "nearest"});
      this.described = next.id;
    } else if (event.key === "Enter" && chosen) {
      this.#draw(chosen, event.shiftKey ? {after: page.state} : {});
    } else if (event.key === "Escape" && this.text) {
      this.text = "";
    } else if (event.key === "Escape") {
      page.dispatchEvent(new Event("focus-canvas"));
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };

  /** Draw one, and show all again. @param {ReadyState} ready @param {Parameters<typeof drawReady>[2]} where */
  #draw(ready, where) {
    if (ready.trouble) return;
    this.text = "";
    this.described = "";
    drawReady(this.context.canvas, ready, where);
  }

  /** The description stands beside what it describes. */
  updated() {
    const card = /** @type {HTMLElement | null} */ (this.querySelector(".shelf-about:not([hidden])"));
    const described = readyStates().find(({id}) => id === this.described);
    const option = described && document.getElementById(optionOf(described));
    if (!card || !option) return;
    const {top} = option.getBoundingClientRect();
    const {right} = /** @type {HTMLElement} */ (card.parentElement).getBoundingClientRect();
    card.style.left = `${Math.min(right + 8, innerWidth - card.offsetWidth - 8)}px`;
    card.style.top = `${Math.max(8, Math.min(top - 8, innerHeight - card.offsetHeight - 8))}px`;
  }

  /** @param {boolean} open */
  #toggle(open) {
    this.open = open;
    browserStorage.setItem(CLOSED, open ? "open" : "closed");
  }
}

/** The id of the element of a ready state. @param {ReadyState} ready */
const optionOf = ({id}) => `shelf-${id.replace(/[^\w-]/g, "-")}`;

/** What a ready state does, and what can be set. @param {ReadyState} ready */
function about(ready) {
  if (ready.trouble)
    return html`<p>${rich("{title} cannot be used.", {title: html`<strong>${ready.title}</strong>`})}</p>
      <p class="trouble">${ready.path}: ${ready.trouble}</p>`;
  const lacks = lacking(ready);
  return html`<p><strong>${ready.title}</strong> ${ready.text || t("has no description.")}</p>
    ${lacks ? html`<p class="trouble">${lacks[0].toUpperCase() + lacks.slice(1)}.</p>` : nothing}
    ${values(ready.inputs)} ${ready.outputs.length ? html`<p>${t("It hands up:")}</p>` : nothing}
    ${values(ready.outputs)} ${ready.own ? html`<p class="faint">${ready.path}</p>` : nothing}`;
}

/** @param {ReadyValue[]} declared */
const values = (declared) =>
  declared.length
    ? html`<dl>
        ${declared.map(
          ({name, default: value, description}) =>
            html`<dt><span class="mono">${name}</span> <span class="faint mono">${value}</span></dt>
              <dd>${description}</dd>`,
        )}
      </dl>`
    : nothing;

customElements.define("hfsm-shelf", Shelf);
