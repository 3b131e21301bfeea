/**
 * Dialogs for steering a component.
 *
 * @import {From} from "../data/element.js"
 * @import {Parameter} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {showDialog} from "../kit/dialog.js";
import {notify} from "../kit/notices.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {rich, t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";
import {breakpointAt} from "./breakpoints.js";
import {clockTime} from "./element.js";
import {monitor} from "./monitor.js";
import {lastValues, parameterOptions} from "./parameters.js";
import {valueIn} from "./values.js";

/** @param {() => void} act */
const onEnter = (act) => (/** @type {KeyboardEvent} */ event) => {
  if (event.key !== "Enter") return;
  event.preventDefault();
  act();
};

/** Say why what is followed cannot be controlled now, unless it has ended. */
export function sayWhyNot() {
  const {component, ended, recording, since, steers} = monitor;
  if (!component || steers || ended || viewing.on) return;
  const time = clockTime(since);
  if (!store.online) notify(t("The editor is offline"));
  else if (since)
    notify(monitor.present.includes(component) ? t("Silent since {time}", {time}) : t("Gone since {time}", {time}));
  else if (recording) notify(t("Recording"));
  else if (monitor.looking) notify(t("Looking back"));
  else if (monitor.newest)
    notify(t("Only watching"), "info", {label: t("Take control"), run: () => monitor.allowSteering(true)});
}

/** Ask for an event, and send it. */
export async function askEvent() {
  const {events = []} = monitor.structure ?? {};
  const state = {name: events[0] ?? "", data: ""};
  const sent = await showDialog({
    title: t("Send an event"),
    content: (/** @type {import("../kit/dialog.js").Close<boolean>} */ close) =>
      html`<div @keydown=${onEnter(() => close(true))}>
        <div class="field">
          <label for="event-name">${t("Event")}</label
          ><input
            id="event-name"
            list="event-names"
            autofocus
            .value=${state.name}
            @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (state.name = target.value)}
          />
          <datalist id="event-names">${events.map((name) => html`<option value=${name}></option>`)}</datalist>
          ${
            events.length
              ? nothing
              : html`<p class="faint">
                  ${rich("The document declares none ({data}, {component}).", {
                    data: html`<em>${t("Data")}</em>`,
                    component: html`<em>${t("Behavior")}</em>`,
                  })}
                </p>`
          }
        </div>
        <div class="field">
          <label for="event-data">${t('Data, such as 3, "red" or [1, 2]; may be empty')}</label
          ><input
            id="event-data"
            class="mono"
            .value=${state.data}
            @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (state.data = target.value)}
          />
        </div>
      </div>`,
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close()}>${t("Cancel")}</button
        ><button type="button" class="button primary" @click=${() => close(true)}>${t("Send")}</button>`,
  });
  if (!sent || !state.name.trim()) return;
  const data = state.data.trim() ? valueIn(state.data) : null;
  if (data === undefined) {
    notify(
      t('{data} is not a value: write a number, "a text", True, or a list of these.', {data: state.data}),
      "error",
    );
    return;
  }
  const event = {name: state.name.trim(), data: data === null ? "" : JSON.stringify(data)};
  if ((await monitor.steer("sendEvent", event)) !== undefined) notify(t("Sent {name}.", {name: event.name}));
}

/**
 * Ask for the condition of a breakpoint.
 *
 * @param {number} automaton
 * @param {"state" | "transition"} kind
 * @param {{id: number, name: string}} item
 */
export async function askCondition(automaton, kind, {id, name}) {
  const {tab} = page;
  const known = breakpointAt(monitor.breakpoints.of(tab), automaton, kind, id);
  const variables = Object.keys(monitor.now(automaton)?.variables ?? {});
  const state = {condition: known?.condition ?? ""};
  const chosen = await showDialog({
    title: t("Breakpoint at {name}", {
      name: name || (kind === "state" ? t("state {id}", {id}) : t("transition {id}", {id})),
    }),
    content: (/** @type {import("../kit/dialog.js").Close<"set" | "remove">} */ close) =>
      html`<p>
          ${
            kind === "state"
              ? t(
                  "The behavior pauses when the state has been entered, before its code runs, if this is true in {automaton}; always when it is empty.",
                  {automaton: page.title()},
                )
              : t(
                  "The behavior pauses when the transition has fired, if this is true in {automaton}; always when it is empty.",
                  {automaton: page.title()},
                )
          }
        </p>
        <div class="field">
          <label for="break-condition"
            >${
              variables.length
                ? t("Condition, in Python; variables are {names}", {names: variables.slice(0, 8).join(", ")})
                : t("Condition, in Python")
            }</label
          >
          <input
            id="break-condition"
            class="mono"
            autofocus
            spellcheck="false"
            .value=${state.condition}
            @keydown=${onEnter(() => close("set"))}
            @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (state.condition = target.value)}
          />
        </div>`,
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close()}>${t("Cancel")}</button>
        ${
          known
            ? html`<button type="button" class="button danger" @click=${() => close("remove")}>${t("Remove")}</button>`
            : nothing
        }
        <button type="button" class="button primary" @click=${() => close("set")}>${t("Set")}</button>`,
  });
  if (chosen)
    await monitor.breakpoints.set(tab, automaton, kind, id, chosen === "set" ? state.condition.trim() : undefined);
}

const LONGEST_VALUE = 900; // characters that fit in an argument of the command line

/**
 * Ask for the values of parameters, initially those of the document's last run with parameters.
 *
 * @param {number} tab
 * @param {Parameter[]} parameters
 * @returns {Promise<string[] | undefined>} the options of the command line; undefined when it is not to be run
 */
export async function askParameters(tab, parameters) {
  const values = {...lastValues.get(tab)};
  const agreed = await showDialog({
    title: t("Run with parameters"),
    content: (/** @type {import("../kit/dialog.js").Close<boolean>} */ close) =>
      html`<form
        id="parameters"
        @submit=${(/** @type {Event} */ event) => {
          event.preventDefault();
          close(true);
        }}
      >
        <p>${t("Empty fields take their defaults.")}</p>
        ${parameters.map((each, index) => parameterField(each, values, index === 0))}
      </form>`,
    footer: (close) =>
      html`<button type="button" class="button" @click=${() => close()}>${t("Cancel")}</button
        ><button type="submit" form="parameters" class="button primary">${t("Run")}</button>`,
  });
  if (!agreed) return undefined;
  lastValues.set(tab, values);
  return parameterOptions(parameters, values);
}

/** @param {Parameter} parameter @param {Record<string, string>} values @param {boolean} first */
function parameterField({name, type, default: usual, description}, values, first) {
  const id = `parameter-${name}`;
  /** @param {From<HTMLInputElement | HTMLSelectElement>} event */
  const take = ({target}) => (values[name] = target.value);
  return html`<div class="field">
    <label for=${id}>${name}${description ? `: ${description}` : nothing}</label>
    ${
      type === "bool"
        ? html`<select id=${id} ?autofocus=${first} @change=${take}>
            ${["", "True", "False"].map(
              (each) =>
                html`<option value=${each} ?selected=${each === (values[name] ?? "")}>
                  ${each || t("default: {usual}", {usual})}
                </option>`,
            )}
          </select>`
        : html`<input
            id=${id}
            class="mono"
            type=${type === "str" ? "text" : "number"}
            step=${type === "float" ? "any" : 1}
            maxlength=${LONGEST_VALUE}
            spellcheck="false"
            placeholder=${type === "str" ? (valueIn(usual) ?? usual) : usual}
            ?autofocus=${first}
            .value=${values[name] ?? ""}
            @input=${take}
          />`
    }
  </div>`;
}
