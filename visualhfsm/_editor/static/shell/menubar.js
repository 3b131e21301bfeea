/**
 * The menus of the header, and the drawing tools on the canvas.
 *
 * @import {From} from "../data/element.js"
 * @import {Target} from "../kit/events.js"
 */

import {html, nothing} from "lit";

import {MENUS, selectionTitle} from "./actions.js";
import {PageElement} from "../data/element.js";
import {page} from "../data/page.js";
import {monitor} from "../run/monitor.js";
import {isOffered, withAdded} from "../kit/registry.js";
import {viewing} from "../kit/viewers.js";
import {actionButton, menuButton} from "../kit/buttons.js";
import {t} from "../kit/texts.js";

const menu = () => import("./menu.js");

/** The menus that have anything for this page. */
const menus = () =>
  MENUS.map(({title, groups}) => ({title, groups: groups.map((ids) => withAdded(ids).filter(isOffered))})).filter(
    ({groups}) => groups.flat()[0],
  );

class Menubar extends PageElement {
  static properties = {at: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["connection"]};

  constructor() {
    super();
    /** The title that Tab reaches. */
    this.at = 0;
  }

  render() {
    return html`<div role="menubar" aria-label=${t("Menus")} @keydown=${this.#key}>
        ${menus().map(
          ({title}, index) =>
            html`<button
              type="button"
              role="menuitem"
              aria-haspopup="menu"
              aria-expanded="false"
              tabindex=${index === this.at ? 0 : -1}
              @click=${() => this.#open(index)}
              @pointerenter=${() => this.querySelector('[aria-expanded="true"]') && this.#open(index, true)}
            >
              ${title}
            </button>`,
        )}
      </div>
      ${menuButton(t("Menus"), "menu", this.#openAll, {kind: "bare all-menus"})}`;
  }

  /** @returns {NodeListOf<HTMLElement>} */
  get #titles() {
    return this.querySelectorAll("[role=menuitem]");
  }

  /** @param {number} index @param {boolean} [stay] whether an open menu stays open */
  async #open(index, stay = false) {
    const {dropMenu} = await menu();
    /** @param {number} at @param {boolean} [remain] */
    const drop = (at, remain = true) => {
      this.at = at;
      const {title, groups} = menus()[at];
      const beside = (/** @type {number} */ step) => drop((at + step + menus().length) % menus().length);
      dropMenu(this.#titles[at], {groups, label: title, beside, stay: remain}, this.context);
    };
    drop(index, stay);
  }

  /** The list of the menus, in a narrow window. @param {MouseEvent & From<HTMLElement>} event */
  #openAll = async ({currentTarget: button}) => {
    const {dropMenu} = await menu();
    const titles = menus().map(({title, groups}) => ({
      id: title,
      label: title,
      icon: "",
      run: () => dropMenu(button, {groups, title}, this.context),
    }));
    dropMenu(button, {groups: [titles], label: t("Menus")}, this.context);
  };

  /** @param {KeyboardEvent} event */
  #key = (event) => {
    const step = /** @type {Record<string, number>} */ ({ArrowLeft: -1, ArrowRight: 1})[event.key];
    if (step) {
      this.at = (this.at + step + menus().length) % menus().length;
      this.#titles[this.at].focus();
    } else if (event.key === "ArrowDown") this.#open(this.at, true);
    else return;
    event.preventDefault();
  };
}

const TOOLS = ["select", "newState", "newTransition", "newNote"];

class Tools extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["document", "workspace", "connection"]};

  connectedCallback() {
    super.connectedCallback();
    this.listen(/** @type {Target<{tool: null}>} */ (this.context.canvas), "tool", () => this.requestUpdate());
    this.listen(monitor, "mode", () => this.requestUpdate());
  }

  render() {
    if (!page.document || viewing.on) return nothing;
    const selection = selectionTitle();
    const title = selection
      ? t("Actions on {selection} (right mouse button, Shift+F10)", {selection})
      : t("Actions on the automaton (right mouse button, Shift+F10)");
    return html`<div class="tools" role="group" aria-label=${t("Drawing tools")}>
      ${TOOLS.map((id) => actionButton(id, this.context))}
      ${menuButton(t("Actions"), "dots", this.#more, {kind: "more", title, label: true})}
    </div>`;
  }

  /** @param {MouseEvent & From<HTMLElement>} event */
  #more = async ({currentTarget}) => (await menu()).dropMenu(currentTarget, {}, this.context);
}

customElements.define("hfsm-menubar", Menubar);
customElements.define("hfsm-tools", Tools);
