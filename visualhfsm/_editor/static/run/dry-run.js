/**
 * Stand-ins for the robot in a dry run: the time, the events, and the transitions that conditions would fire.
 *
 * @import {TransitionStructure} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {decimal, rich, t} from "../kit/texts.js";
import {MonitorElement} from "./element.js";
import {monitor, ON_EVENT} from "./monitor.js";

const SPEEDS = [0.2, 1, 5, 20]; // s of component time in a second

class DryRun extends MonitorElement {
  render() {
    const {speed, automata = []} = monitor.snapshot?.component ?? {};
    const {events = []} = monitor.structure ?? {};
    /** Events of transitions that only the behavior's own code may send. @type {Set<string>} */
    const undeclared = new Set();
    /** Events that a current state waits for. @type {Set<string>} */
    const awaited = new Set();
    /** Transitions that may fire next, with their automaton. @type {[number, TransitionStructure][]} */
    const next = [];
    for (const {id, transitions} of monitor.structure?.automata ?? []) {
      const now = automata.find((each) => each.id === id);
      for (const transition of transitions) {
        const {event, kind, origin} = transition;
        const leaves = now && !now.ghost && !now.finished && origin === now.state;
        if (event && leaves) awaited.add(event);
        if (event && !events.includes(event)) undeclared.add(event);
        if (leaves && kind !== ON_EVENT) next.push([id, transition]);
      }
    }
    return html`<div class="live-values dry-run">
      <section role="group" aria-label=${t("Time")}>
        <h3>${t("Time")}</h3>
        ${SPEEDS.map((each) =>
          this.#button(`${decimal(each, each < 1 ? 1 : 0)} x`, () => monitor.steer("setSpeed", {speed: each}), {
            pressed: each === speed,
          }),
        )}
      </section>
      <section role="group" aria-label=${t("Events")}>
        <h3>${t("Send an event")}</h3>
        ${events.map((name) =>
          this.#button(name, () => monitor.steer("sendEvent", {name, data: ""}), {awaited: awaited.has(name)}),
        )}
        ${events.length || undeclared.size ? nothing : html`<p class="faint">${t("No transition waits for an event.")}</p>`}
        ${undeclared.size ? this.#undeclared([...undeclared]) : nothing}
      </section>
      <section role="group" aria-label=${t("Transitions")}>
        <h3>${t("Let a transition fire")}</h3>
        ${next.map(([automaton, {id, name, destination, condition}]) =>
          this.#button(
            name || t("to {name}", {name: monitor.stateName(automaton, destination)}),
            () => monitor.steer("forceTransition", {automaton, transition: id}),
            {title: condition},
          ),
        )}
        ${next.length ? nothing : html`<p class="faint">${t("None leaves the current states.")}</p>`}
      </section>
    </div>`;
  }

  /** Say how events that nobody may send from here become ones that may. @param {string[]} names */
  #undeclared(names) {
    const where = {
      names: names.join(", "),
      data: html`<em>${t("Data")}</em>`,
      component: html`<em>${t("Behavior")}</em>`,
      events: html`<em>${t("Events")}</em>`,
    };
    return html`<p class="faint">
      ${
        names.length > 1
          ? rich(
              "Only the behavior's own code may send {names}: declare them in {data}, {component}, {events} and reload, to send them from here.",
              where,
            )
          : rich(
              "Only the behavior's own code may send {names}: declare it in {data}, {component}, {events} and reload, to send it from here.",
              where,
            )
      }
    </p>`;
  }

  /**
   * @param {string} text
   * @param {() => unknown} act
   * @param {{pressed?: boolean, awaited?: boolean, title?: string}} options
   */
  #button(text, act, {pressed, awaited, title = awaited ? t("A current state waits for it") : ""}) {
    return html`<button
      type="button"
      class="button ${awaited ? "primary" : ""}"
      title=${title}
      aria-pressed=${pressed ?? nothing}
      ?disabled=${!monitor.steers}
      @click=${act}
    >
      ${text}
    </button>`;
  }
}

customElements.define("hfsm-dry-run", DryRun);
