/**
 * The run that an agent asks for, with the buttons that allow and refuse it.
 *
 * @import {AskedRun} from "./messages.js"
 */

import {html} from "lit";
import {PageElement} from "visualhfsm/data/element.js";
import {page} from "visualhfsm/data/page.js";
import {store} from "visualhfsm/data/store.js";
import {notifyError} from "visualhfsm/kit/notices.js";
import {t} from "visualhfsm/kit/texts.js";
import {addStyles} from "visualhfsm/kit/theme.js";

await addStyles(new URL("./agent.css", import.meta.url));

const PERIOD = 1000; // ms

class AgentPanel extends PageElement {
  static properties = {asked: {state: true}, answering: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {};

  constructor() {
    super();
    /** @type {AskedRun | null} */
    this.asked = null;
    this.answering = false;
  }

  /** @type {ReturnType<typeof setInterval> | undefined} */
  #timer;

  connectedCallback() {
    super.connectedCallback();
    this.#timer = setInterval(() => this.#look(), PERIOD);
    this.#look();
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    clearInterval(this.#timer);
  }

  async focusFirst() {
    await this.updateComplete;
    this.querySelector("button")?.focus();
  }

  render() {
    const {asked, answering} = this;
    if (!asked) return html`<p class="empty" role="status">${t("No agent asks for anything.")}</p>`;
    const {path, seconds} = asked;
    return html`<div class="asked" role="alert">
      <p>${t("An agent asks to run {path} on the robot, for at most {seconds} s.", {path, seconds})}</p>
      <p>
        <button type="button" class="button primary" ?disabled=${answering} @click=${() => this.#answer(true)}>${t("Allow it once")}</button>
        <button type="button" class="button" ?disabled=${answering} @click=${() => this.#answer(false)}>${t("Refuse")}</button>
      </p>
    </div>`;
  }

  async #look() {
    const {tab} = page;
    try {
      this.asked = tab ? await store.request("agentAsked", {tab}) : null;
    } catch {
      this.asked = null; // the server is gone, which the page says
    }
  }

  /** @param {boolean} allowed */
  async #answer(allowed) {
    const {asked} = this;
    if (!asked || this.answering) return;
    this.answering = true;
    await store.request("answerAgent", {tab: page.tab, at: asked.at, allowed}).catch(notifyError);
    await this.#look();
    this.answering = false;
  }
}

customElements.define("hfsm-agent", AgentPanel);
