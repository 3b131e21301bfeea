/** Errors of the component's code; each leads to where it was raised. */

import {html, nothing} from "lit";

import {SEVERITIES} from "../data/problems.js";
import {coded, n, t, spokenSeconds} from "../kit/texts.js";
import {MonitorElement} from "./element.js";
import {show} from "./failing-code.js";
import {monitor} from "./monitor.js";

const MOST = 20; // that a component sends

class LiveErrors extends MonitorElement {
  render() {
    const errors = monitor.snapshot?.component.errors ?? [];
    const {time: now = 0, events = []} = monitor.snapshot?.robot.health ?? {};
    if (!errors.length && !events.length)
      return html`<p class="empty">${t("No errors of the behavior or the robot.")}</p>`;
    return html`<div class="live-values">
      ${
        errors.length
          ? html`<h3>${t("Behavior")}</h3>
              <ul class="rows" aria-label=${t("Errors of the behavior")}>
                ${grouped(errors).map(
                  ([each, count]) =>
                    html`<li>
                      <button type="button" class="row" @click=${() => show(each)}>
                        <span class="severity-sign error" role="img" aria-label=${t("error")}></span
                        ><span class="message"
                          >${coded(each.message)}${
                            count > 1
                              ? html` <span class="faint">${n("{count} time", "{count} times", count)}</span>`
                              : nothing
                          }</span
                        >
                        <span class="where"
                          >${monitor.automaton(each.automaton)?.name ?? each.automaton},
                          ${monitor.stateName(each.automaton, each.state)},
                          ${spokenSeconds(each.time)}${each.location ? html`<br />${each.location}` : nothing}</span
                        >
                      </button>
                    </li>`,
                )}
              </ul>
              ${errors.length < MOST ? nothing : html`<p class="empty">${t("Older ones are not listed.")}</p>`}`
          : nothing
      }
      ${
        events.length
          ? html`<h3>${t("Robot")}</h3>
              <ul class="rows" aria-label=${t("Events of the robot")}>
                ${events
                  .toReversed()
                  .map(
                    (each) =>
                      html`<li class="row">
                        <span
                          class="severity-sign ${["note", "warning", "error"][each.level]}"
                          role="img"
                          aria-label=${SEVERITIES[["note", "warning", "error"][each.level]]}
                        ></span
                        ><span class="message">${coded(each.message)}</span
                        ><span class="where"
                          >${each.source}, ${t("{time} ago", {time: spokenSeconds(now - each.time)})}</span
                        >
                      </li>`,
                  )}
              </ul>`
          : nothing
      }
    </div>`;
  }
}

/**
 * The newest of each error with how often it came, the latest first.
 *
 * @param {import("../data/protocol.js").ErrorReport[]} errors
 * @returns {[import("../data/protocol.js").ErrorReport, number][]}
 */
function grouped(errors) {
  const found = new Map();
  for (const each of errors.toReversed()) {
    const key = `${each.automaton}.${each.state} ${each.location} ${each.message}`;
    const known = found.get(key);
    if (known) known[1] += 1;
    else found.set(key, [each, 1]);
  }
  return [...found.values()];
}

customElements.define("hfsm-live-errors", LiveErrors);
