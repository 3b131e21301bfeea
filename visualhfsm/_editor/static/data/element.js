/**
 * The base of the elements of the page.
 *
 * @import {Context} from "../kit/registry.js"
 * @import {HfsmApp} from "../shell/app.js"
 * @import {PageEvents} from "./page.js"
 * @import {Target} from "../kit/events.js"
 * @import {StoreEvents} from "./store.js"
 */

/**
 * An event of an element, in a template.
 *
 * @template {Element} E
 * @typedef {Event & {target: E, currentTarget: E}} From
 */

import {LitElement} from "lit";

import {page} from "./page.js";
import {required} from "../kit/existence.js";
import {store} from "./store.js";

/** Resolves when the last message of the server has been drawn. */
export const drawn = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));

/** The declaration of properties that no attribute sets. @param {string[]} names */
export const properties = (...names) => Object.fromEntries(names.map((name) => [name, {attribute: false}]));

/**
 * An element without a shadow root: style sheet, order of focus and labels are those of the page.
 *
 * `watches` names the events of the page and of the store after which it is drawn again.
 */
export class PageElement extends LitElement {
  /** @type {{page?: (keyof PageEvents)[], store?: (keyof StoreEvents)[]}} */
  static watches = {page: ["change"], store: ["document", "workspace"]};

  #stop = new AbortController();
  /** @type {Context | undefined} */
  #context = undefined;

  /** The context of actions, once the element was shown. */
  get context() {
    return required(this.#context, "page around this element");
  }

  createRenderRoot() {
    return this;
  }

  connectedCallback() {
    super.connectedCallback();
    this.#context = /** @type {HfsmApp | null} */ (this.closest("hfsm-app"))?.context ?? this.#context;
    this.#stop = new AbortController();
    const {page: ofPage = [], store: ofStore = []} = /** @type {typeof PageElement} */ (this.constructor).watches;
    const redraw = () => this.requestUpdate();
    for (const kind of ofPage) page.addEventListener(kind, redraw, {signal: this.#stop.signal});
    for (const kind of ofStore) store.addEventListener(kind, redraw, {signal: this.#stop.signal});
    redraw(); // the watched values may have changed while it was hidden
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.#stop.abort();
  }

  /**
   * Handle events of an object while the element is shown.
   *
   * @template M
   * @template {keyof M & string} K
   * @param {Target<M>} target @param {K} kind @param {(event: CustomEvent<M[K]>) => void} handler
   */
  listen(target, kind, handler) {
    target.addEventListener(kind, handler, {signal: this.#stop.signal});
  }
}
