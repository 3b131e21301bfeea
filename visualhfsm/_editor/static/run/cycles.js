/** The current state of each automaton, and how long its cycles take. */

import {html} from "lit";

import {page} from "../data/page.js";
import {wordButton} from "../kit/buttons.js";
import {decimal, n, t, spokenSeconds} from "../kit/texts.js";
import {MonitorElement} from "./element.js";
import {monitor} from "./monitor.js";

/** @param {number} seconds */
const ms = (seconds) => decimal(seconds * 1000, seconds < 0.0995 ? 1 : 0);

class Cycles extends MonitorElement {
  render() {
    const {snapshot} = monitor;
    if (!snapshot) return html`<p class="empty">${t("Waiting for the first values.")}</p>`;
    const {automata, time} = snapshot.component;
    return html`<div class="live-values">
      <table class="cycles" aria-label=${t("Cycles")}>
        <thead>
          <tr>
            <th scope="col">${t("Automaton")}<br />${t("State")}</th>
            <th scope="col">${t("for")}</th>
            <th scope="col" class="bar-head">${t("Last / period")}</th>
            <th scope="col">${t("Longest")}</th>
            <th scope="col">${t("Overruns")}</th>
          </tr>
        </thead>
        <tbody>
          ${automata.map((each) => this.#row(each, time))}
        </tbody>
      </table>
      <p class="faint explain">
        ${t("Cycle times in ms of wall time. A cycle that takes longer than the period is an overrun; the next one then starts late.")}
      </p>
    </div>`;
  }

  /** @param {import("../data/protocol.js").AutomatonSnapshot} now @param {number} time */
  #row({id, state, ghost, finished, enteredAt, overruns, cycles, lastCycle, longestCycle}, time) {
    const {name = t("automaton {id}", {id}), period = 0} = monitor.automaton(id) ?? {};
    const part = period > 0 ? lastCycle / period : 0;
    const drawn = page.tab === monitor.tab && page.document?.automata.has(id);
    return html`<tr class=${ghost ? "ghost-row" : ""}>
      <th scope="row">
        ${wordButton(name, () => page.open(id, {states: [state]}), {kind: "link", title: name, disabled: !drawn})}
        <div>
          ${monitor.stateName(id, state)}${
            ghost
              ? html` <span class="faint">${t("ghost")}</span>`
              : finished
                ? html` <span class="faint">${t("finished")}</span>`
                : ""
          }
        </div>
      </th>
      <td class="number">${ghost ? "" : spokenSeconds(Math.max(0, time - enteredAt))}</td>
      <td>
        <div class="cycle-bar" title=${n("{count} cycle", "{count} cycles", cycles)}>
          <svg viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true">
            <rect class="track" width="100" height="8"></rect>
            <rect
              class=${part > 1 ? "over" : part > 0.7 ? "near" : "fine"}
              width=${Math.min(100, part * 100)}
              height="8"
            ></rect>
          </svg>
          <span class="number">${ms(lastCycle)} / ${ms(period)}</span>
        </div>
      </td>
      <td class="number">${ms(longestCycle)}</td>
      <td class="number ${overruns ? "some-overruns" : ""}">${overruns}</td>
    </tr>`;
  }
}

customElements.define("hfsm-cycles", Cycles);
