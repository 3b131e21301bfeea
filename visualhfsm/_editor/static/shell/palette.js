/** The palette: all actions that are possible now, and the ready states to draw, filtered by the typed text. */

import {html, nothing} from "lit";

import {icon} from "../kit/icons.js";
import {spoken} from "../kit/keys.js";
import {findActions, perform} from "../kit/registry.js";
import {canDraw, drawReady, findReady, readyStates} from "../shelf/ready-states.js";
import {folded, t} from "../kit/texts.js";
import {Finder} from "../kit/finder.js";
import {showDialog} from "../kit/dialog.js";

/**
 * Let the user choose an action, and perform it.
 *
 * @typedef {{id: string, label: string, name?: string, hint?: string, icon: string, keys?: string[]}} Shown
 * @param {import("../kit/registry.js").Context} context
 */
export async function showPalette(context) {
  const finder = new Finder("action");
  const id = await showDialog({
    title: t("All actions"),
    content: (/** @type {import("../kit/dialog.js").Close<string>} */ close, redraw) => {
      const {text} = finder;
      const found = [...findActions(text, context), ...readyFor(text, context)].sort(byName(text));
      /** @param {KeyboardEvent} event */
      const press = ({key}) => {
        if (key === "Enter") close(found[finder.chosen]?.id);
        return key === "Enter";
      };
      return html`${finder.field({label: t("What to do"), count: found.length, press, redraw})}
        <div class="files" id=${finder.listId} role="listbox" aria-label=${t("Actions")}>
          ${found.map(
            ({id: each, label, hint, icon: image, keys = []}, index) =>
              html`<div
                role="option"
                id=${finder.entryId(index)}
                aria-selected=${index === finder.chosen}
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

/** @param {import("../data/protocol.js").ReadyState} ready */
const idOf = ({id}) => `ready ${id}`;

/**
 * What can be drawn of the shelf, as actions.
 *
 * @param {string} text
 * @param {import("../kit/registry.js").Context} context
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
  const sought = folded(text);
  /** @param {Shown} shown */
  const rank = ({label, name = label}) => (folded(name).startsWith(sought) ? 0 : 1);
  return (/** @type {Shown} */ one, /** @type {Shown} */ other) => rank(one) - rank(other);
}
