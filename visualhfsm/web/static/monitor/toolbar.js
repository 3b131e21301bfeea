/** Which components run, in the header: to follow one of them. */

import {html, nothing} from "lit";

import {perform} from "../actions.js";
import {icon} from "../icons.js";
import {keyOf} from "../keys.js";
import {MonitorElement} from "./element.js";
import {monitor} from "./monitor.js";

export class MonitorToolbar extends MonitorElement {
  static properties = {open: {state: true}};
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "running"];

  constructor() {
    super();
    this.open = false;
  }

  render() {
    const {running} = monitor;
    const words = running.length ? `${running.length} running` : "Nothing runs";
    return html`<button
        type="button"
        class="running-now ${running.length ? "some" : ""}"
        aria-label=${words}
        aria-haspopup="menu"
        aria-expanded=${Boolean(this.open)}
        title="Components that run in the realm (${keyOf("attach")})"
        @click=${() => this.toggle()}
      >
        <span class="pulse" aria-hidden="true"></span><span class="word">${words}</span
        ><span class="short" aria-hidden="true">${running.length || ""}</span>
      </button>
      ${this.open ? this.#menu(running) : nothing}`;
  }

  /** Show the list, or hide it. */
  async toggle(open = !this.open) {
    this.open = open;
    await this.updateComplete;
    /** @type {HTMLElement | null} */ (this.querySelector(open ? "[role=menuitem]" : "button"))?.focus();
  }

  /** @param {string[]} running */
  #menu(running) {
    return html`<div
      class="menu running-menu"
      role="menu"
      aria-label="Running now"
      @keydown=${this.#key}
      @focusout=${this.#left}
    >
      <div class="title" role="presentation">${running.length ? "Running now" : "No component runs in this realm"}</div>
      ${running.map(
        (name) =>
          html`<button type="button" role="menuitem" tabindex="-1" @click=${() => this.#choose(name)}>
            ${icon(name === monitor.component ? "properties" : "link")}<span>${name}</span>${
              name === monitor.component ? html`<kbd>followed</kbd>` : nothing
            }
          </button>`,
      )}
      ${running.length ? html`<div role="separator"></div>` : nothing}
      <button type="button" role="menuitem" tabindex="-1" @click=${() => this.#do("openRecording")}>
        ${icon("film")}<span>Open a recording</span><kbd>${keyOf("openRecording")}</kbd>
      </button>
      ${
        monitor.component
          ? html`<button type="button" role="menuitem" tabindex="-1" @click=${() => this.#do("detach")}>
              ${icon("unlink")}<span>Detach from ${monitor.component}</span>
            </button>`
          : nothing
      }
    </div>`;
  }

  /** @param {string} name */
  async #choose(name) {
    this.open = false;
    await this.context.app.follow(name);
    this.context.canvas.focusSelected();
  }

  /** @param {string} id */
  #do(id) {
    this.open = false;
    perform(id, this.context);
  }

  /** @param {FocusEvent} event */
  #left = (event) => {
    if (!this.contains(/** @type {Node | null} */ (event.relatedTarget))) this.open = false;
  };

  /** @param {KeyboardEvent} event */
  #key = (event) => {
    const items = [.../** @type {NodeListOf<HTMLElement>} */ (this.querySelectorAll("[role=menuitem]"))];
    const index = items.findIndex((each) => each === document.activeElement);
    const next = /** @type {Record<string, number>} */ ({
      ArrowDown: index + 1,
      ArrowUp: index - 1,
      Home: 0,
      End: items.length - 1,
    })[event.key];
    if (next !== undefined) items.at(next % items.length)?.focus();
    else if (event.key === "Escape" || event.key === "Tab") this.toggle(false);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
}

customElements.define("hfsm-monitor-toolbar", MonitorToolbar);
