/**
 * Any number of plots of anything that is a number. uPlot is loaded with this module.
 *
 * @import {PropertyValues} from "lit"
 * @import {From} from "../data/element.js"
 */

import {html, nothing} from "lit";

import {icon, iconButton} from "../kit/icons.js";
import {t} from "../kit/texts.js";
import {MonitorElement} from "./element.js";
import {monitor} from "./monitor.js";
import {Plot} from "./plot.js";
import {numbersOf} from "./values.js";

const MOST_LINES = 8; // of a plot
const MOST_NAMES = 1000; // names to choose from; the server keeps no more

/** Labels of numbers that belong to no automaton, by the prefix of their names. @type {Record<string, string>} */
const GROUPS = {
  joint: t("Joints (rad; m if they slide)"),
  self: t("Parameters"),
  robot: t("Robot"),
  images: t("Images a second"),
  mark: t("Marks (pixels)"),
};
/** The measurements of each automaton. @type {Record<string, string>} */
const MEASURED = {lastCycle: t("cycle (s)"), overruns: t("overruns")};

class Plots extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "structure"];
  static properties = {span: {state: true}};

  /** @type {Plot[]} */
  plots = [];

  constructor() {
    super();
    this.span = 30;
    this.component = "";
    /** Names of all numbers that can be plotted. @type {Set<string>} */
    this.names = new Set();
  }

  connectedCallback() {
    super.connectedCallback();
    this.listen(monitor, "snapshot", () => monitor.newest && this.#learn());
    this.listen(monitor, "shown", () => this.#showMoment());
    this.#learn();
    for (const plot of this.plots) plot.refill();
  }

  render() {
    if (!this.plots.length && this.names.size) this.#add(this.#suggestion());
    return html`<div class="plots">
      <div class="list-tools">
        <button type="button" class="tool" @click=${() => this.#add([])}>${icon("add")}${t("Add a plot")}</button
        ><span class="room"></span>
        <label
          >${t("Window")}
          <select
            aria-label=${t("Window")}
            @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => this.#resize(Number(target.value))}
          >
            ${[10, 30, 60, 300, 1800].map(
              (each) =>
                html`<option value=${each} ?selected=${each === this.span}>
                  ${each < 60 ? `${each} s` : `${each / 60} min`}
                </option>`,
            )}
          </select></label
        >
      </div>
      ${this.plots.map(
        (plot, index) =>
          html`<section class="plot" aria-label=${t("Plot {number}", {number: index + 1})}>
            <div class="plot-head">
              <ul aria-label=${t("Numbers of the plot")}>
                ${plot.names.map(
                  (name, line) =>
                    html`<li>
                      <span class="line-sign line-${line % 8}" aria-hidden="true"></span
                      ><span>${this.#titleOf(name)}</span><output class="number" data-name=${name}></output>
                      ${iconButton(
                        "close",
                        t("Remove {entry}", {entry: this.#titleOf(name)}),
                        () =>
                          this.#choose(
                            plot,
                            plot.names.filter((each) => each !== name),
                          ),
                        {title: t("Remove")},
                      )}
                    </li>`,
                )}
              </ul>
              ${
                plot.names.length < MOST_LINES
                  ? html`<select
                      class="pick"
                      aria-label=${t("Add a number to plot {number}", {number: index + 1})}
                      @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => {
                        if (target.value) this.#choose(plot, [...plot.names, target.value]);
                        target.value = "";
                      }}
                    >
                      <option value="">${t("Add…")}</option>
                      ${this.#groups().map(
                        ([title, names]) =>
                          html`<optgroup label=${title}>
                            ${names
                              .filter((name) => !plot.names.includes(name))
                              .map((name) => html`<option value=${name}>${this.#titleOf(name)}</option>`)}
                          </optgroup>`,
                      )}
                    </select>`
                  : nothing
              }
              ${iconButton("delete", t("Remove plot {number}", {number: index + 1}), () => this.#remove(plot), {title: t("Remove the plot")})}
            </div>
            ${plot.element}
          </section>`,
      )}
      ${this.plots.length ? nothing : html`<p class="empty">${t("There are no numbers to plot yet.")}</p>`}
    </div>`;
  }

  /** The initial plots: variables of automata, else the joints of the head. */
  #suggestion() {
    const variables = [...this.names].filter((name) => /^\d+\./.test(name));
    const head = [...this.names].filter((name) => name.startsWith("joint.Head"));
    return (variables.length ? variables : head.length ? head : [...this.names]).slice(0, 3);
  }

  /** @param {string[]} names */
  #add(names) {
    const plot = new Plot(this.span, (name) => this.#titleOf(name));
    this.plots = [...this.plots, plot];
    this.#choose(plot, names);
  }

  /** @param {Plot} plot @param {string[]} names */
  #choose(plot, names) {
    plot.choose(names);
    this.requestUpdate();
  }

  /** @param {Plot} plot */
  #remove(plot) {
    plot.close();
    this.plots = this.plots.filter((each) => each !== plot);
    this.requestUpdate();
  }

  /** @param {number} span */
  #resize(span) {
    this.span = span;
    for (const plot of this.plots) {
      plot.span = span;
      plot.refill();
    }
  }

  /** @param {PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    this.#showMoment();
  }

  /** Discard the plots of another component. */
  #forget() {
    this.component = monitor.component;
    this.names.clear();
    for (const plot of this.plots) plot.close();
    this.plots = [];
    this.requestUpdate();
  }

  /** Update the known numbers and their newest values. */
  #learn() {
    if (this.component !== monitor.component) this.#forget();
    const numbers = monitor.newest ? numbersOf(monitor.newest) : new Map();
    const before = this.names.size;
    for (const name of [...monitor.past.numbers, ...numbers.keys()])
      if (this.names.size < MOST_NAMES) this.names.add(name);
    if (this.names.size !== before) this.requestUpdate();
    for (const plot of this.plots) plot.append(numbers);
  }

  /** Show the values of the shown moment. */
  #showMoment() {
    for (const plot of this.plots) plot.draw();
    const numbers = monitor.snapshot ? numbersOf(monitor.snapshot) : new Map();
    /** @type {NodeListOf<HTMLElement>} */
    const outputs = this.querySelectorAll("output[data-name]");
    for (const output of outputs) {
      const value = numbers.get(output.dataset.name ?? "");
      output.textContent = value === undefined ? "" : String(+value.toPrecision(4));
    }
  }

  /** @returns {[string, string[]][]} */
  #groups() {
    /** @type {Map<string, string[]>} */
    const groups = new Map();
    for (const name of [...this.names].sort()) {
      const title = /^\d+[.:]/.test(name)
        ? (monitor.automaton(Number.parseInt(name, 10))?.name ?? t("Automaton"))
        : (GROUPS[name.split(".")[0]] ?? t("Other"));
      groups.set(title, [...(groups.get(title) ?? []), name]);
    }
    return [...groups];
  }

  /** @param {string} name */
  #titleOf(name) {
    const [, id, sign, rest] = /^(\d+)([.:])(.*)$/.exec(name) ?? [];
    if (!id) return name.replace(/^(joint|self)\./, "");
    const automaton = monitor.automaton(Number(id))?.name ?? id;
    return `${automaton} ${sign === ":" ? (MEASURED[rest] ?? rest) : rest}`;
  }
}

customElements.define("hfsm-plots", Plots);
