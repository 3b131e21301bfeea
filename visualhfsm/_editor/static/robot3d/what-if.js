/**
 * What if a part of the robot failed? Somebody picks it in a list or by a click in 3D, lets it fail, and heals it. Only a
 * simulation and a fake robot can do that.
 *
 * @import {From} from "../data/element.js"
 * @import {RobotView} from "./robot-view.js"
 * @import {RobotDrawing} from "./robot-drawing.js"
 * @typedef {{name: string, text: string, unit: string, least: number, greatest: number, usual: number}} Kind
 * @typedef {{part: string, kind: string, amount: number}} Failure
 * @typedef {{can: {parts: string[], kinds: Kind[]}[], now: Failure[]}} Failing as
 *   visualhfsm/_monitor/realm/faults.py makes it
 * @typedef {{part: string, kinds: Kind[], group: string}} Entry
 */

import {html, nothing} from "lit";

import {Finder} from "../kit/finder.js";
import {messageOf} from "../kit/notices.js";
import {containsWords, language, t} from "../kit/texts.js";
import {drawn} from "../data/element.js";
import {store} from "../data/store.js";
import {monitor} from "../run/monitor.js";
import {onClick} from "./aiming.js";
import {cameraNames} from "./cameras.js";
import {Painting} from "./painting.js";

const ROBOT = "Robot";
const LONGEST = 10_000; // ms until it is known what can fail
/** Parts beside the body. */
const BESIDE = ["Server", "Link"];
const [JOINTS, SENSES, CAMERAS, LINKS, WHOLE, NETWORK] = [
  t("Joints and motors"),
  t("Senses, lights and voice"),
  t("Cameras"),
  t("Links of the body"),
  t("The whole robot"),
  t("Server and network"),
];
/** Units that are words. @type {Record<string, string>} */
const UNITS = {share: t("of the whole"), pixels: t("pixels")};

/** @param {Kind | undefined} kind @param {number} amount */
const measured = (kind, amount) =>
  kind?.unit ? `${amount.toLocaleString(language, {maximumFractionDigits: 3})} ${UNITS[kind.unit] ?? kind.unit}` : "";

export class WhatIf {
  /** @param {RobotView} view */
  constructor(view) {
    this.view = view;
    this.finder = new Finder("failing");
    /** @type {Failing} */
    this.failing = {can: [], now: []};
    /** Whether it is asked what should fail. */
    this.open = false;
    /** The name of the chosen kind. */
    this.kind = "";
    /** The amount that is typed, if it is not the usual one. @type {number | undefined} */
    this.amount = undefined;
    /** What screen readers say. */
    this.said = "";
    /** @type {Painting | undefined} */
    this.painting = undefined;
  }

  #ended = new AbortController();
  /** Told when the search has the focus. @type {((there?: boolean) => void) | undefined} */
  #begun = undefined;

  /** Paint in a drawing, and pick what is clicked there. @param {RobotDrawing} drawing */
  begin(drawing) {
    this.painting = new Painting(drawing);
    this.#ended = new AbortController();
    onClick(drawing, this.#ended.signal, (event) => this.view.asks && this.#pick(event));
  }

  end() {
    this.#ended.abort();
    this.painting?.close();
    this.painting = undefined;
    this.failing = {can: [], now: []};
  }

  /** Ask what should fail; resolves when the search has the focus, to undefined if what can fail is not known in time. */
  async ask() {
    this.open = true;
    await drawn(); // perhaps at another place of the page
    this.view.requestUpdate();
    return new Promise((resolve) => {
      this.#begun = resolve;
      setTimeout(resolve, LONGEST);
    });
  }

  /** Take what can fail and what does. @param {Failing} failing */
  learn(failing) {
    const {now: before} = this.failing;
    const others = (/** @type {Failure[]} */ list, /** @type {Failure[]} */ known) =>
      list.filter(({part, kind}) => !known.some((each) => each.part === part && each.kind === kind));
    this.said = [
      ...others(failing.now, before).map((each) => t("{part} fails: {kind}", {...each})),
      ...others(before, failing.now).map((each) => t("{part} works again, no longer {kind}", {...each})),
    ].join(". ");
    this.failing = failing;
    this.view.requestUpdate();
  }

  /** Paint what fails now, and what is chosen. */
  show() {
    if (this.#begun && this.#focus("input")) {
      this.#begun(true);
      this.#begun = undefined;
    }
    const failing = this.view.isNow ? this.failing.now : (monitor.looking?.robot.failing ?? []);
    const parts = failing.map(({part}) => part);
    this.painting?.show(parts, this.view.asks ? this.#chosen?.part : undefined);
  }

  /** All parts, in groups. @returns {Entry[]} */
  get #all() {
    const cameras = cameraNames();
    const body = this.view.drawing?.body;
    const joints = new Set(body?.joints.map(({joint}) => joint));
    const groupOf = (/** @type {string} */ part) => {
      if (part === ROBOT) return WHOLE;
      if (BESIDE.includes(part)) return NETWORK;
      if (joints.has(part)) return JOINTS;
      if (cameras.includes(part)) return CAMERAS;
      return body?.links.has(part) ? LINKS : SENSES;
    };
    const all = this.failing.can.flatMap(({parts, kinds}) =>
      parts.map((part) => ({part, kinds, group: groupOf(part)})),
    );
    return [JOINTS, SENSES, CAMERAS, LINKS, WHOLE, NETWORK].flatMap((group) =>
      all.filter((each) => each.group === group),
    );
  }

  /** The parts that the typed text leaves. */
  get #found() {
    return this.#all.filter(({part, group}) => containsWords(`${part} ${group}`, this.finder.text));
  }

  get #chosen() {
    return this.#found.at(this.finder.chosen);
  }

  /** @param {string} part @param {string} kind */
  #kindOf(part, kind) {
    return this.failing.can.find(({parts}) => parts.includes(part))?.kinds.find(({name}) => name === kind);
  }

  render() {
    return html`${this.view.asks ? this.#section() : nothing}
      <p class="for-readers" role="status">${this.said}</p>`;
  }

  #section() {
    const found = this.#found;
    const chosen = this.#chosen;
    const press = (/** @type {KeyboardEvent} */ {key}) => key === "Enter" && this.#focus("select");
    return html`<section class="what-if" aria-label=${t("What if…")}>
      ${this.failing.now.length ? this.#present() : nothing}
      ${this.finder.field({label: t("Part that is to fail"), count: found.length, press, redraw: this.#redraw})}
      <div class="files" id=${this.finder.listId} role="listbox" aria-label=${t("Parts")}>
        ${[...new Set(found.map(({group}) => group))].map(
          (group) =>
            html`<div role="group" aria-label=${group}>
              <div class="title" role="presentation">${group}</div>
              ${found.map((entry, index) => (entry.group === group ? this.#option(entry, index) : nothing))}
            </div>`,
        )}
        ${found.length ? nothing : html`<p class="faint">${t("No part is called that.")}</p>`}
      </div>
      ${chosen ? this.#form(chosen) : nothing}
    </section>`;
  }

  /** What fails now: a click heals it. */
  #present() {
    const parts = [...new Set(this.failing.now.map(({part}) => part))];
    return html`<div class="failing" role="group" aria-label=${t("What fails now")} tabindex="-1">
      ${parts.map((part) => {
        const ways = this.failing.now
          .filter((each) => each.part === part)
          .map(({kind, amount}) => `${kind} ${measured(this.#kindOf(part, kind), amount)}`.trim());
        const words = `${part}: ${ways.join(", ")}`;
        return html`<button
          type="button"
          class="fails"
          title=${t("Heal it")}
          aria-label=${t("Heal {part}", {part: words})}
          @click=${() => this.#heal(part)}
        >
          ${words}<span aria-hidden="true"> ×</span>
        </button>`;
      })}
      <button type="button" @click=${() => this.#heal()}>${t("Heal all")}</button>
    </div>`;
  }

  /** @param {Entry} entry @param {number} index */
  #option({part}, index) {
    const fails = this.failing.now.some((each) => each.part === part);
    return html`<div
      role="option"
      id=${this.finder.entryId(index)}
      class=${fails ? "fails" : ""}
      aria-label=${fails ? t("{part}, fails", {part}) : nothing}
      aria-selected=${index === this.finder.chosen}
      @click=${() => this.finder.choose(index, this.#redraw)}
    >
      ${part}
    </div>`;
  }

  /** How the chosen part is to fail. @param {Entry} entry */
  #form({part, kinds}) {
    const kind = kinds.find(({name}) => name === this.kind) ?? kinds[0];
    const {unit, least, greatest, usual} = kind;
    return html`<form
      novalidate
      @submit=${(/** @type {Event} */ event) => {
        event.preventDefault();
        this.#act(store.request("inject", {part, kind: kind.name, amount: unit ? this.amount : undefined}));
      }}
    >
      <label
        ><span>${t("How {part} fails", {part})}</span
        ><select
          @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => {
            this.kind = target.value;
            this.#redraw();
          }}
        >
          ${kinds.map(
            ({name, text}) => html`<option value=${name} .selected=${name === kind.name}>${name}: ${text}</option>`,
          )}
        </select></label
      >
      ${
        unit
          ? html`<label
              ><span>${t("How much: {least} to {greatest}", {least, greatest: measured(kind, greatest)})}</span
              ><input
                type="number"
                step="any"
                .value=${String(this.amount ?? usual)}
                @input=${(/** @type {From<HTMLInputElement>} */ {target}) => {
                  this.amount = Number.isFinite(target.valueAsNumber) ? target.valueAsNumber : undefined;
                }}
            /></label>`
          : nothing
      }
      <button type="submit" class="button primary" ?disabled=${!store.online}>${t("Let it fail")}</button>
    </form>`;
  }

  /** Draw another choice, with its usual amount. */
  #redraw = () => {
    this.amount = undefined;
    this.view.message = "";
    this.view.requestUpdate();
  };

  /** Choose what is clicked; the next click on the same chooses what else is there. @param {PointerEvent} event */
  async #pick(event) {
    const there =
      this.painting?.partsAt(
        event,
        this.#all.map(({part}) => part),
      ) ?? [];
    if (!there.length) return;
    const next = there[(there.indexOf(this.#chosen?.part ?? "") + 1) % there.length];
    this.finder.clear();
    this.#redraw();
    await this.view.updateComplete;
    this.finder.choose(
      this.#all.findIndex(({part}) => part === next),
      this.#redraw,
    );
  }

  /** @param {string} [part] all without one */
  #heal(part) {
    this.#focus(".failing"); // its button goes
    this.#act(store.request("heal", {part}));
  }

  /** @param {Promise<unknown>} request */
  async #act(request) {
    this.view.message = await request.then(() => "", messageOf);
  }

  /** @param {string} selector */
  #focus(selector) {
    /** @type {HTMLElement | null} */
    const element = this.view.querySelector(`.what-if ${selector}`);
    element?.focus();
    return Boolean(element);
  }
}
