/**
 * Buttons for actions, and for menus.
 *
 * @import {From} from "../data/element.js"
 */

import {html, nothing} from "lit";

import {icon} from "./icons.js";
import {ariaKey, spoken} from "./keys.js";
import {actionOf, isEnabled, isOffered, perform} from "./registry.js";

/**
 * A button for an action.
 *
 * @param {string} id @param {import("./registry.js").Context} context
 * @param {{label?: boolean | "short", kind?: string, words?: string, image?: string}} options a `short` label leaves
 *   out the key; `words` and `image` replace those of the action
 */
export function actionButton(id, context, {label = true, kind = "", words, image} = {}) {
  if (!isOffered(id)) return nothing;
  const action = actionOf(id);
  const name = words ?? action.label;
  const key = action.keys?.[0];
  const title = `${name}${action.hint ? `: ${action.hint}` : ""}${key ? ` (${spoken(key)})` : ""}`;
  return html`<button
    type="button"
    class="action ${kind} ${label ? "" : "bare"}"
    data-action=${id}
    title=${title}
    ?disabled=${!isEnabled(id, context)}
    aria-label=${label ? nothing : name}
    aria-keyshortcuts=${key ? ariaKey(key) : nothing}
    aria-pressed=${action.checked && isEnabled(id, context) ? String(action.checked(context)) : nothing}
    @click=${() => perform(id, context)}
  >
    ${icon(image ?? action.icon)}${
      label
        ? html`<span class="text">${name}</span
            >${key && label === true ? html`<kbd aria-hidden="true">${spoken(key)}</kbd>` : nothing}`
        : nothing
    }
  </button>`;
}

/**
 * Buttons for what one may do first where nothing is yet: words by the ids of actions.
 *
 * @param {Record<string, string>} acts @param {import("./registry.js").Context} context
 */
export const offers = (acts, context) =>
  html`<div class="offers">
    ${Object.entries(acts).map(([id, words]) => isOffered(id) && actionButton(id, context, {words, label: "short"}))}
  </div>`;

/**
 * A button with words.
 *
 * @param {unknown} words @param {() => unknown} act
 * @param {{kind?: string, label?: string, title?: string, disabled?: boolean}} [more] `label` for screen readers
 */
export const wordButton = (words, act, {kind = "tool", label, title, disabled = false} = {}) =>
  html`<button
    type="button"
    class=${kind}
    aria-label=${label ?? nothing}
    title=${title ?? nothing}
    ?disabled=${disabled}
    @click=${act}
  >
    ${words}
  </button>`;

/**
 * A button that opens a menu.
 *
 * @param {string} name @param {string} image @param {(event: MouseEvent & From<HTMLElement>) => unknown} open
 * @param {{kind?: string, title?: string, label?: boolean}} [options] whether the name is shown beside the icon
 */
export function menuButton(name, image, open, {kind = "bare", title = name, label = false} = {}) {
  return html`<button
    type="button"
    class="action ${kind}"
    aria-label=${name}
    title=${title}
    aria-haspopup="menu"
    aria-expanded="false"
    @click=${open}
  >
    ${icon(image)}${label ? html`<span class="text">${name}</span>` : nothing}
  </button>`;
}
