/** The robot of the realm, in the header, with a menu to start, change and end it. */

import {html, nothing} from "lit";

import {PageElement} from "../data/element.js";
import {icon} from "../kit/icons.js";
import {keyOf} from "../kit/keys.js";
import {notify, notifyError, clearErrors} from "../kit/notices.js";
import {ROBOT, shownOf, simulate} from "../data/robot.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewing.js";

export class RobotPill extends PageElement {
  static properties = {open: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["robot", "connection"]};

  constructor() {
    super();
    this.open = false;
    /** The menu, once it was opened. @type {HTMLElement | undefined} */
    this.menu = undefined;
    this.trouble = "";
  }

  connectedCallback() {
    super.connectedCallback();
    this.listen(store, "robot", ({detail}) => {
      if (detail.status === "present") clearErrors(ROBOT);
      if (detail.trouble && detail.trouble !== this.trouble) notify(detail.trouble, "error", undefined, {about: ROBOT});
      this.trouble = detail.trouble ?? "";
    });
  }

  render() {
    const {word, short, kind} = shownOf(store.robot);
    if (viewing.on) {
      return kind === "none"
        ? nothing
        : html`<div class="robot-pill ${kind}">
            <span class="robot-now" role="img" title=${store.robot.trouble || word} aria-label=${word}
              ><span class="pulse"></span><span class="word">${word}</span><span class="short">${short}</span></span
            >
          </div>`;
    }
    return html`<div class="robot-pill ${kind}">
      <button
        type="button"
        class="robot-now"
        title=${store.robot.trouble || (kind === "none" ? t("Start a simulated robot") : word)}
        aria-label=${word}
        ?disabled=${!store.online}
        @click=${() => (kind === "none" ? this.#start() : this.toggle())}
      >
        <span class="pulse" aria-hidden="true"></span><span class="word">${word}</span
        ><span class="short" aria-hidden="true">${short}</span>
      </button>
      <button
        type="button"
        class="robot-more"
        aria-label=${t("Robot")}
        title=${t("Robot: which one, world, speed, balls, a real one ({key})", {key: keyOf("robot")})}
        aria-keyshortcuts="Alt+B"
        aria-haspopup="dialog"
        aria-expanded=${Boolean(this.open)}
        ?disabled=${!store.online}
        @click=${() => this.toggle()}
      >
        ${icon("chevron")}
      </button>
      ${this.open ? this.menu : nothing}
    </div>`;
  }

  async #start() {
    await simulate().catch(notifyError);
  }

  /** Show the menu, or hide it. */
  async toggle(open = !this.open) {
    if (open && !this.menu) {
      try {
        await import("./robot-menu.js");
      } catch (error) {
        notifyError(error);
        return;
      }
      this.menu = Object.assign(document.createElement("hfsm-robot-menu"), {close: () => this.toggle(false)});
    }
    this.open = open;
    await this.updateComplete;
    if (!open) /** @type {HTMLElement | null} */ (this.querySelector(".robot-more"))?.focus();
  }
}

customElements.define("hfsm-robot", RobotPill);
