/** The palette: all actions that are possible now, and the ready states to draw, filtered by the typed text. */

import {html, nothing} from "lit";

import {icon} from "../icons.js";
import {spoken} from "../keys.js";
import {findActions, perform} from "../registry.js";
import {canDraw, drawReady, findReady, readyStates} from "../shelf/ready-states.js";
import {t} from "../texts.js";
import {showDialog} from "./dialog.js";

/**
 * Let the user choose an action, and perform it.
 *
 * @import {From} from "../element.js"
 * @typedef {{id: string, label: string, name?: string, hint?: string, icon: string, keys?: string[]}} Shown
 * @param {import("../registry.js").Context} context
 */
export async function showPalette(context) {
  let text = "";
  let chosen = 0;
  const id = await showDialog({
    title: t("All actions"),
    content: (/** @type {import("./dialog.js").Close<string>} */ close, redraw) => {
      const found = [...findActions(text, context), ...readyFor(text, context)].sort(byName(text));
      /** @param {KeyboardEvent} event */
      const key = (event) => {
        const step = /** @type {Record<string, number>} */ ({ArrowDown: 1, ArrowUp: -1})[event.key];
        if (step && found.length) chosen = (chosen + step + found.length) % found.length;
        else if (event.key === "Enter") close(found[chosen]?.id);
        else return;
        event.preventDefault();
        redraw();
        document.getElementById(`action-${chosen}`)?.scrollIntoView({block: "nearest"});
      };
      return html`<div class="field">
          <label for="palette-text">${t("What to do")}</label>
          <input
            id="palette-text"
            role="combobox"
            aria-expanded="true"
            aria-controls="palette-list"
            aria-activedescendant=${found.length ? `action-${chosen}` : nothing}
            autocomplete="off"
            spellcheck="false"
            autofocus
            @input=${(/** @type {From<HTMLInputElement>} */ {target}) => {
              text = target.value;
              chosen = 0;
              redraw();
            }}
            @keydown=${key}
          />
        </div>
        <div class="files" id="palette-list" role="listbox" aria-label=${t("Actions")}>
          ${found.map(
            ({id: each, label, hint, icon: image, keys = []}, index) =>
              html`<div
                role="option"
                id="action-${index}"
                aria-selected=${index === chosen}
                @click=${() => close(each)}
              >
                ${icon(image)}<span>${label}${hint ? html`<span class="faint"> ${hint}</span>` : nothing}</span
                ><span class="when">${keys.map((written) => html`<kbd>${spoken(written)}</kbd> `)}</span>
              </div>`,
          )}
          ${found.length ? nothing : html`<p class="faint">${t("No action with these words is possible now.")}</p>`}
        </div>`;
    },
  });
  const ready = readyStates().find((each) => idOf(each) === id);
  if (ready) await drawReady(context.canvas, ready);
  else if (id) await perform(id, context);
}

/** @param {import("../protocol.js").ReadyState} ready */
const idOf = ({id}) => `ready ${id}`;

/**
 * What can be drawn of the shelf, as actions.
 *
 * @param {string} text
 * @param {import("../registry.js").Context} context
 * @returns {Shown[]}
 */
function readyFor(text, {canvas}) {
  if (!text.trim() || !canDraw(canvas)) return [];
  return findReady(text)
    .filter(({trouble}) => !trouble)
    .map((ready) => ({
      id: idOf(ready),
      label: t("Draw {title}", {title: ready.title}),
      name: ready.title,
      hint: ready.summary,
      icon: "shelf",
    }));
}

/** What is called by a text comes first; otherwise the order stays. @param {string} text */
function byName(text) {
  const sought = text.trim().toLowerCase();
  /** @param {Shown} shown */
  const rank = ({label, name = label}) => (name.toLowerCase().startsWith(sought) ? 0 : 1);
  return (/** @type {Shown} */ one, /** @type {Shown} */ other) => rank(one) - rank(other);
}
