/** The menu of the right mouse button, and of Shift+F10. */

import {html, nothing, render} from "lit";

import {actionOf, isEnabled, perform, selectionActions, selectionTitle} from "./actions.js";
import {icon} from "./icons.js";
import {spoken} from "./keys.js";
import {required} from "./required.js";

const GROUND = [
  ["newState", "newTransition", "paste"],
  ["selectAll", "layout", "layoutAll", "fit"],
  ["repairNumbers", "extract", "inline", "export", "compare", "up"],
];
/** Actions that are left out where they are not possible. */
const RARE = new Set(["repairNumbers", "extract", "inline"]);

/** @type {HTMLElement | undefined} */
let element;

/**
 * Show a menu with the actions on what is selected, or with other ones.
 *
 * @param {{x: number, y: number, point?: {x: number, y: number}, groups?: string[][], title?: string}} where in the
 *   window, and in the drawing
 * @param {import("./actions.js").Context} context
 */
export function showMenu({x, y, point, groups: given, title = selectionTitle()}, context) {
  hideMenu();
  const here = {...context, point};
  const groups = (given ?? (title ? selectionActions() : GROUND)).map((ids) =>
    ids.filter((id) => !RARE.has(id) || isEnabled(id, here)),
  );
  const menu = (element = document.createElement("div"));
  element.className = "menu";
  element.setAttribute("role", "menu");
  element.setAttribute("aria-label", title || "Automaton");
  /** @param {string} id */
  const item = (id) => {
    const {label, icon: image, keys = [], checked} = actionOf(id);
    const enabled = isEnabled(id, here);
    const isChecked = checked && enabled ? checked() : undefined;
    return html`<button
      type="button"
      role=${checked ? "menuitemcheckbox" : "menuitem"}
      tabindex="-1"
      aria-disabled=${!enabled}
      aria-checked=${checked ? String(Boolean(isChecked)) : nothing}
      @click=${() => enabled && choose(id, here)}
    >
      ${icon(isChecked ? "properties" : image)}<span>${label}</span>${
        keys[0] ? html`<kbd>${spoken(keys[0])}</kbd>` : nothing
      }
    </button>`;
  };
  render(
    html`${title ? html`<div class="title" role="presentation">${title}</div>` : nothing}
    ${groups.map((ids, index) => html`${index ? html`<div role="separator"></div>` : nothing}${ids.map(item)}`)}`,
    element,
  );
  required(context.app.querySelector("main"), "place for the menu").append(element);
  const {width, height} = element.getBoundingClientRect();
  element.style.left = `${Math.max(4, Math.min(x, innerWidth - width - 4))}px`;
  element.style.top = `${Math.max(4, Math.min(y, innerHeight - height - 4))}px`;
  element.addEventListener("keydown", (event) => key(event, context));
  element.addEventListener(
    "focusout",
    (event) => !menu.contains(/** @type {Node | null} */ (event.relatedTarget)) && hideMenu(),
  );
  itemsOf(menu)[0]?.focus();
}

/** @param {string} id @param {import("./actions.js").Context} context */
function choose(id, context) {
  hideMenu();
  context.canvas.focusSelected();
  perform(id, context);
}

/** @param {HTMLElement} menu @returns {NodeListOf<HTMLElement>} */
const itemsOf = (menu) => menu.querySelectorAll("[role^=menuitem]");

function hideMenu() {
  const former = element;
  element = undefined;
  former?.remove();
}

/** @param {KeyboardEvent} event @param {import("./actions.js").Context} context */
function key(event, context) {
  const items = element ? [...itemsOf(element)] : [];
  const index = items.findIndex((each) => each === document.activeElement);
  const next = /** @type {Record<string, number>} */ ({
    ArrowDown: index + 1,
    ArrowUp: index - 1,
    Home: 0,
    End: items.length - 1,
  })[event.key];
  if (next !== undefined) items.at(next % items.length)?.focus();
  else if (event.key === "Escape" || event.key === "Tab") {
    hideMenu();
    context.canvas.focusSelected();
  } else if (event.key.length === 1 && !event.ctrlKey) {
    const letter = event.key.toLowerCase();
    const rest = [...items.slice(index + 1), ...items.slice(0, index + 1)];
    rest.find((each) => each.innerText.trim().toLowerCase().startsWith(letter))?.focus();
  } else return;
  event.preventDefault();
  event.stopPropagation();
}
