/**
 * The run from its beginning to now: below the canvas the shown automaton and those above and below it, as a panel all
 * that were active in the shown time, with a list of changes.
 *
 * @import {PropertyValues} from "lit"
 * @import {From} from "../data/element.js"
 * @import {Range} from "./lanes.js"
 */

import {html, nothing} from "lit";

import {iconButton} from "../kit/icons.js";
import {keyOf} from "../kit/keys.js";
import {page} from "../data/page.js";
import {required} from "../kit/existence.js";
import {n, t, spokenSeconds} from "../kit/texts.js";
import {MonitorElement, nothingRuns} from "./element.js";
import {spokenFailing} from "./failures.js";
import {drawLanes, FAILING, nameOf, seen, spansOf, wasActive} from "./lanes.js";
import {monitor} from "./monitor.js";
import {scrubbing} from "./scrubbing.js";

const LANE = 21; // px
const GAP = 3;
const AXIS = 13;
const MOST_LANES = 3; // below the canvas
const LISTED = 200; // changes in the list
const WINDOW = 60; // s that are shown of a longer run by default

class Timeline extends MonitorElement {
  static properties = {compact: {type: Boolean}, whole: {state: true}};
  /** @type {typeof MonitorElement.watches} */
  static watches = {page: ["tab", "automaton"], store: ["document"]};

  constructor() {
    super();
    this.compact = false;
    this.whole = false;
    /** What is drawn, from top to bottom. @type {{id: number, name: string, drawn: boolean}[]} */
    this.lanes = [];
    this.sizes = new ResizeObserver(() => this.#draw());
    /** The canvas whose size is watched. @type {HTMLCanvasElement | undefined} */
    this.watched = undefined;
  }

  connectedCallback() {
    super.connectedCallback();
    this.listen(scrubbing, "play", () => this.requestUpdate());
    this.listen(window, "theme", () => this.#draw());
    if (this.watched) this.sizes.observe(this.watched);
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.sizes.disconnect();
  }

  focusFirst() {
    /** @type {HTMLElement | null} */ (this.querySelector("[role=slider]"))?.focus();
  }

  render() {
    if (!monitor.component) return html`<div class="empty">${nothingRuns(this.context)}</div>`;
    const failing = seen(monitor.past.failures, this.#range()).length
      ? [{id: FAILING, name: t("Fails"), drawn: false}]
      : [];
    const lanes = (this.lanes = [...this.#findLanes(), ...failing]);
    const height = lanes.length * (LANE + GAP) + AXIS;
    const {start, end} = monitor.past;
    const {time} = scrubbing;
    const live = !monitor.looking;
    return html`<div class="timeline ${this.compact ? "compact" : ""}">
      <div class="timeline-tools" role="group" aria-label=${t("Playback")}>
        ${iconButton(
          scrubbing.plays ? "pause" : monitor.recording ? "run" : "history", // beside *Run*, another sign
          scrubbing.plays ? t("Pause the playback") : t("Play from here"),
          () => (scrubbing.plays ? scrubbing.pause() : scrubbing.play()),
        )}
        ${iconButton("previous", t("Previous change"), () => scrubbing.toChange(-1))}
        ${iconButton("next", t("Next change"), () => scrubbing.toChange(1))}
        ${
          monitor.recording
            ? nothing
            : html`<button
                type="button"
                class="now ${live ? "live" : ""}"
                aria-pressed=${live}
                title=${t("Back to live ({key})", {key: keyOf("backToLive")})}
                @click=${() => scrubbing.to(Infinity)}
              >
                ${t("Now")}
              </button>`
        }
        ${
          this.compact
            ? nothing
            : html`<label
                ><span class="faint">${t("Speed")}</span>
                <select aria-label=${t("Speed")} @change=${this.#setSpeed}>
                  ${[0.25, 0.5, 1, 2, 5, 10].map(
                    (each) => html`<option value=${each} ?selected=${each === scrubbing.speed}>${each}×</option>`,
                  )}
                </select></label
              >`
        }
        ${
          monitor.recording
            ? nothing
            : html`<label class="whole"
                ><input
                  type="checkbox"
                  .checked=${this.whole}
                  @change=${(/** @type {From<HTMLInputElement>} */ {target}) => (this.whole = target.checked)}
                />
                ${t("All")}</label
              >`
        }
      </div>
      <div class="lanes-area">
        <ul class="lane-names" aria-label=${t("Automata")}>
          ${lanes.map(
            ({id, name, drawn}) =>
              html`<li>
                <button
                  type="button"
                  ?disabled=${!drawn}
                  title=${id === FAILING ? t("What was made to fail") : t("Show {name}", {name})}
                  @click=${() => page.open(id)}
                >
                  ${name}
                </button>
              </li>`,
          )}
        </ul>
        <div
          class="lanes"
          role="slider"
          tabindex="0"
          aria-label=${t("Moment of the run")}
          aria-valuemin=${round(start)}
          aria-valuemax=${round(end)}
          aria-valuenow=${round(time)}
          aria-valuetext=${[
            live ? t("now, {time}", {time: spokenSeconds(time)}) : spokenSeconds(time),
            spokenFailing(monitor.snapshot?.robot.failing ?? []),
          ]
            .filter(Boolean)
            .join(". ")}
          @pointerdown=${this.#down}
          @pointermove=${this.#move}
          @pointerup=${this.#up}
          @lostpointercapture=${this.#up}
          @keydown=${this.#key}
        >
          <canvas height=${height} data-height=${height}></canvas>
          <div class="cursor ${live ? "live" : ""}"><span>${spokenSeconds(time)}</span></div>
        </div>
      </div>
      ${this.compact ? nothing : this.#list()}
    </div>`;
  }

  /** @param {PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    const canvas = this.querySelector("canvas");
    if (!canvas) return;
    canvas.style.height = `${canvas.dataset.height}px`;
    if (this.watched !== canvas) {
      this.sizes.disconnect();
      this.sizes.observe(canvas);
      this.watched = canvas;
    }
    this.#draw();
  }

  /** The shown time: the last minute, another one while looking back, or everything. */
  #range() {
    const {start, end} = monitor.past;
    const first = Number.isFinite(start) ? start : 0;
    if (this.whole || monitor.recording || end - first < 10) return {start: first, end: Math.max(end, first + 10)};
    if (this.#dragged) return this.#dragged;
    const long = Math.min(WINDOW, end - first);
    const right = monitor.looking ? Math.min(end, Math.max(first + long, scrubbing.time + long / 2)) : end;
    return {start: right - long, end: right};
  }

  #draw() {
    const canvas = this.querySelector("canvas");
    if (!canvas?.clientWidth) return;
    const range = this.#range();
    const x = drawLanes(canvas, {lanes: this.lanes, range, laneHeight: LANE, gap: GAP, axis: AXIS});
    /** @type {HTMLElement | null} */
    const cursor = this.querySelector(".cursor");
    if (!cursor) return;
    const at = Math.min(canvas.clientWidth - 1, Math.max(0, x(scrubbing.time)));
    cursor.style.transform = `translateX(${at.toFixed(1)}px)`;
    cursor.classList.toggle("left", at > canvas.clientWidth - 70);
  }

  /**
   * The automata that were active in the shown time, and the shown one.
   *
   * @returns {{id: number, name: string, drawn: boolean}[]} `drawn` says whether the open document has it
   */
  #findLanes() {
    const document = page.tab === monitor.tab ? page.document : undefined;
    const range = this.#range();
    const all = (monitor.structure?.automata ?? []).map(({id, name, states}) => ({
      id,
      name,
      drawn: Boolean(document?.automata.has(id)),
      active: wasActive(spansOf(id), range, (state) => states.some((each) => each.id === state && each.final)),
    }));
    const shown = document ? page.automaton?.id : undefined;
    const active = all.filter((each) => each.active || each.id === shown);
    if (!this.compact) return active.length ? active : all;
    const path = document ? page.path.map((each) => each.id) : [];
    const below = document ? (page.automaton?.states.flatMap((each) => each.children) ?? []) : [];
    const isActive = (/** @type {number} */ id) => active.some((each) => each.id === id);
    const above = path.filter(isActive).slice(-MOST_LANES);
    const chosen = [...above, ...below.filter(isActive)].slice(0, MOST_LANES);
    if (chosen.length) return chosen.flatMap((id) => active.find((each) => each.id === id) ?? []);
    return (active.length ? active : all).slice(0, MOST_LANES);
  }

  #list() {
    const {changes} = monitor.past;
    const {time} = scrubbing;
    const shown = changes.slice(-LISTED).reverse();
    const more = changes.length - shown.length;
    return html`<ol class="change-list" aria-label=${t("Changes, the latest first")} tabindex="0">
      ${shown.map((change) => {
        const {automaton, origin, destination, transition} = change;
        const by = transition && monitor.transition(automaton, transition)?.name;
        return html`<li class=${change.time > time + 1e-3 ? "later" : ""}>
          <button type="button" @click=${() => scrubbing.to(change.time + 0.001)}>
            <span class="time">${spokenSeconds(change.time)}</span
            ><span class="who">${monitor.automaton(automaton)?.name ?? automaton}</span>
            <span
              >${
                origin ? `${monitor.stateName(automaton, origin)} → ` : ""
              }${monitor.stateName(automaton, destination)}</span
            >${by ? html`<span class="faint">${t("by {by}", {by})}</span>` : nothing}
          </button>
        </li>`;
      })}
      ${more ? html`<li class="faint">${n("{count} more is not listed.", "{count} more are not listed.", more)}</li>` : nothing}
    </ol>`;
  }

  /** The shown range when a drag began: it stays until the drag ends. @type {Range | undefined} */
  #dragged;

  /** @param {PointerEvent} event */
  #timeAt({clientX}) {
    const box = required(this.querySelector("canvas"), "canvas").getBoundingClientRect();
    const {start, end} = this.#range();
    return start + ((clientX - box.left) / box.width) * (end - start);
  }

  /** @param {From<HTMLSelectElement>} event */
  #setSpeed = ({target}) => {
    scrubbing.speed = Number(target.value);
  };

  /** @param {PointerEvent & From<HTMLElement>} event */
  #down = (event) => {
    if (event.button !== 0) return;
    this.#dragged = this.#range();
    event.currentTarget.setPointerCapture(event.pointerId);
    scrubbing.pause();
    scrubbing.to(this.#timeAt(event));
  };

  /** @param {PointerEvent & From<HTMLElement>} event */
  #move = (event) => {
    if (this.#dragged) scrubbing.to(this.#timeAt(event));
    else this.#name(event);
  };

  /** Say what is below the pointer: narrow spans have no name. @param {PointerEvent & From<HTMLElement>} event */
  #name(event) {
    const {top} = event.currentTarget.getBoundingClientRect();
    const {id = 0} = this.lanes[Math.floor((event.clientY - top) / (LANE + GAP))] ?? {};
    const time = this.#timeAt(event);
    const [span] = seen(spansOf(id), {start: time, end: time});
    event.currentTarget.title = span ? `${nameOf(id, span)}, ${spokenSeconds(time)}` : "";
  }

  #up = () => {
    this.#dragged = undefined;
    this.#draw();
  };

  /** @param {KeyboardEvent} event */
  #key = (event) => {
    const {time} = scrubbing;
    const far = event.shiftKey ? 10 : 1;
    const act = /** @type {Record<string, () => unknown>} */ ({
      ArrowLeft: () => scrubbing.to(time - 0.1 * far),
      ArrowRight: () => scrubbing.to(time + 0.1 * far),
      PageDown: () => scrubbing.toChange(-1),
      PageUp: () => scrubbing.toChange(1),
      Home: () => scrubbing.to(monitor.past.start),
      End: () => scrubbing.to(monitor.recording ? monitor.past.end : Infinity),
      " ": () => (scrubbing.plays ? scrubbing.pause() : scrubbing.play()),
    })[event.key];
    if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    act();
  };
}

/** @param {number} value */
const round = (value) => (Number.isFinite(value) ? value.toFixed(1) : 0);

customElements.define("hfsm-monitor-timeline", Timeline);
