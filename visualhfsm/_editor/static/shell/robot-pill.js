/**
 * The robot of the realm, in the header, with a menu to start, change and end it.
 *
 * @import {From} from "../data/element.js"
 */

import {html, nothing} from "lit";

import {PageElement} from "../data/element.js";
import {icon} from "../kit/icons.js";
import {keyOf} from "../kit/keys.js";
import {notify, notifyError, clearErrors} from "../kit/notices.js";
import {ROBOT, shownOf, simulate} from "../data/robot.js";
import {store} from "../data/store.js";
import {laterStyles} from "../kit/theme.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";

export class RobotPill extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["robot", "connection"]};

  constructor() {
    super();
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
        popovertarget=${kind === "none" ? nothing : "robot-menu"}
        ?disabled=${!store.online}
        @click=${() => kind === "none" && simulate().catch(notifyError)}
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
        popovertarget="robot-menu"
        ?disabled=${!store.online}
      >
        ${icon("chevron")}
      </button>
      <hfsm-robot-menu
        id="robot-menu"
        class="menu robot-menu"
        role="dialog"
        aria-label=${t("Robot")}
        tabindex="-1"
        popover
        @beforetoggle=${this.#load}
      ></hfsm-robot-menu>
    </div>`;
  }

  /** Load the menu before it is first shown. @param {ToggleEvent & From<HTMLElement>} event */
  #load = async (event) => {
    const {target: menu} = event;
    if (event.newState === "closed" || customElements.get("hfsm-robot-menu")) return;
    event.preventDefault();
    try {
      await Promise.all([import("./robot-menu.js"), laterStyles()]);
      menu.showPopover();
    } catch (error) {
      notifyError(error);
    }
  };
}

customElements.define("hfsm-robot", RobotPill);
