/** The output of the component of the shown tab; a line about a piece of code leads to it. */

import {html, nothing} from "lit";
import {PageElement} from "../data/element.js";
import {offers} from "../kit/buttons.js";
import {tickBox} from "../kit/tick-box.js";
import {monitor, spokenStatus} from "../run/monitor.js";
import {page} from "../data/page.js";
import {required} from "../kit/existence.js";
import {started, spokenEnd} from "../data/component-status.js";
import {t} from "../kit/texts.js";
import {outputLog} from "../data/output-log.js";

const SHOWN = 2000; // lines
const LONGEST = 200_000; // characters of these lines, all of which are laid out
const NEAR = 30; // px from the end that count as the end

/** @type {Record<string, string>} */
const STATUS = {
  generating: t("Generating…"),
  starting: t("Starting…"),
  started: t("Running"),
  stopping: t("Stopping…"),
};

class Output extends PageElement {
  static properties = {follows: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["tab"], store: ["started"]};

  constructor() {
    super();
    this.follows = true;
    this.shownTab = -1;
    /** Lines that the next frame adds. @type {import("../data/output-log.js").Line[]} */
    this.waiting = [];
    this.frame = 0;
    /** Characters of the lines that are shown. */
    this.size = 0;
    /** How far the lines were scrolled last. */
    this.top = 0;
  }

  connectedCallback() {
    super.connectedCallback();
    this.shownTab = -1;
    this.listen(monitor, "mode", () => this.requestUpdate());
    this.listen(outputLog, "lines", ({detail}) => detail.tab === this.shownTab && this.#append(detail.lines));
    this.listen(outputLog, "reset", ({detail}) => detail.tab === this.shownTab && this.#fill());
  }

  focusFirst() {
    this.#lines?.focus();
  }

  render() {
    return html`<div class="list-panel">
      <div class="list-tools">
        <span>${this.#status()}</span>${started.of(page.tab) ? nothing : offers({run: t("Run")}, this.context)}<span
          class="room"
        ></span>
        ${tickBox(t("Follow"), this.follows, this.#follow)}
        <button type="button" class="tool" @click=${() => outputLog.clear(page.tab)}>${t("Clear")}</button>
      </div>
      <div
        class="lines"
        role="log"
        aria-live="off"
        aria-label=${t("Output of the behavior")}
        tabindex="0"
        @scroll=${this.#scrolled}
      ></div>
    </div>`;
  }

  updated() {
    if (this.shownTab === page.tab) return;
    this.shownTab = page.tab;
    this.#fill();
  }

  #status() {
    const run = started.of(page.tab);
    if (!run) return t("Not run yet.");
    // Whether it is paused is known while it is followed.
    if (run.status === "started" && monitor.newest && !monitor.recording && monitor.tab === page.tab)
      return spokenStatus(monitor.newest.component.status);
    if (run.status !== "ended") return STATUS[run.status] ?? run.status;
    return spokenEnd(started.endOf(run));
  }

  /** @returns {HTMLElement | null} */
  get #lines() {
    return this.querySelector(".lines");
  }

  #fill() {
    this.#lines?.replaceChildren();
    this.size = 0;
    this.waiting = [];
    this.#append(outputLog.of(this.shownTab));
  }

  /**
   * Thousands of lines may arrive per second: each frame appends what has come, without redrawing the others.
   *
   * @param {import("../data/output-log.js").Line[]} lines
   */
  #append(lines) {
    this.waiting.push(...lines.slice(-SHOWN));
    this.waiting.splice(0, this.waiting.length - SHOWN);
    this.frame ||= requestAnimationFrame(() => this.#showWaiting());
  }

  #showWaiting() {
    this.frame = 0;
    const list = this.#lines;
    if (!list) return;
    const elements = this.waiting.map(asElement);
    this.waiting = [];
    for (const each of elements) this.size += each.textContent.length;
    list.append(...elements);
    while (list.childElementCount > SHOWN || this.size > LONGEST) {
      const first = required(list.firstElementChild, "line");
      this.size -= first.textContent.length;
      first.remove();
    }
    if (this.follows) this.#scrollToEnd(list);
  }

  /** @param {HTMLElement} list */
  #scrollToEnd(list) {
    list.scrollTop = list.scrollHeight;
    this.top = list.scrollTop;
  }

  /** @param {import("../data/element.js").From<HTMLInputElement>} event */
  #follow = ({target}) => {
    this.follows = target.checked;
    const list = this.#lines;
    if (this.follows && list) this.#scrollToEnd(list);
  };

  /**
   * Scrolling back stops following, and scrolling to the end resumes it. The end also moves away by itself: lines that
   * come into view turn out to be longer than they were taken to be.
   *
   * @param {import("../data/element.js").From<HTMLElement>} event
   */
  #scrolled = ({target}) => {
    const isAtEnd = target.scrollHeight - target.scrollTop - target.clientHeight < NEAR;
    const isBack = target.scrollTop < this.top;
    this.top = target.scrollTop;
    if (isAtEnd) this.follows = true;
    else if (isBack) this.follows = false;
    else if (this.follows) this.#scrollToEnd(target);
  };
}

/** @param {import("../data/output-log.js").Line} line */
function asElement({text, stream, place, line}) {
  const element = document.createElement("div");
  element.className = stream === "err" ? "line err" : "line";
  if (!place) {
    element.textContent = text || "\u200b";
    return element;
  }
  const link = document.createElement("button");
  link.type = "button";
  link.className = "link";
  link.textContent = text;
  link.title = t("Show the code");
  link.addEventListener("click", () => page.jump(place, {line: line || 1}));
  element.append(link);
  return element;
}

customElements.define("hfsm-output", Output);
