/** Menus: the context menu (right mouse button, Shift+F10), and menus below buttons. */

import {html, nothing, render} from "lit";

import {selectionActions, selectionTitle} from "./actions.js";
import {icon} from "../kit/icons.js";
import {spoken} from "../kit/keys.js";
import {actionOf, isPossible} from "../kit/registry.js";
import {isForbidden} from "../kit/viewers.js";
import {required} from "../kit/existence.js";
import {laterStyles} from "../kit/theme.js";
import {t} from "../kit/texts.js";

const GAP = 4; // pixels between a button and the menu below it
const GROUND = [
  ["newState", "newTransition", "newNote", "frame", "paste"],
  ["selectAll", "layout", "layoutAll", "fit"],
  ["repairNumbers", "extract", "inline", "export", "compare", "up"],
];
/** Actions that are left out when they are not possible. */
const RARE = new Set(["repairNumbers", "extract", "inline"]);

/**
 * The content of a menu, by default the actions on the selection: ids of actions, or actions. `label` is its name if it
 * has no `title`.
 *
 * @typedef {{groups?: (string | Action)[][], title?: string, label?: string}} Content
 * @import {Action, Context} from "../kit/registry.js"
 */

/** @type {HTMLElement | undefined} */
let element;
/** The button below which the menu is shown. @type {HTMLElement | undefined} */
let opener;

/**
 * Show a menu below a button; hide it if it is shown already.
 *
 * @param {HTMLElement} button
 * @param {Content & {beside?: (step: number) => void, stay?: boolean}} content `beside` shows the menu beside this one;
 *   with `stay` one that is shown already stays
 * @param {Context} context
 */
export async function dropMenu(button, {beside, stay, ...content}, context) {
  await laterStyles();
  const isShown = opener === button && element?.getAttribute("aria-label") === nameOf(content);
  if (isShown && stay) return;
  hideMenu();
  if (isShown) return;
  const {left, bottom} = button.getBoundingClientRect();
  await showMenu({x: left, y: bottom + GAP, ...content}, context);
  opener = button;
  button.setAttribute("aria-expanded", "true");
  element?.addEventListener("keydown", ({key: pressed}) => {
    const step = /** @type {Record<string, number>} */ ({ArrowLeft: -1, ArrowRight: 1})[pressed];
    if (step) beside?.(step);
  });
}

/** @param {Content} content */
const nameOf = ({title, label}) => title || label || selectionTitle() || t("Automaton");

/**
 * Show a menu with the actions on the selection, or with others.
 *
 * @param {Content & {x: number, y: number, point?: {x: number, y: number}}} where in the window, and in the drawing
 * @param {Context} context
 */
export async function showMenu({x, y, point, groups: given, label, title = label ? "" : selectionTitle()}, context) {
  await laterStyles();
  hideMenu();
  const here = {...context, point};
  const groups = (given ?? (title ? selectionActions() : GROUND))
    .map((all) =>
      all
        .map((each) => (typeof each === "string" ? actionOf(each) : each))
        .filter((action) => !isForbidden(action) && (!RARE.has(action.id) || isPossible(action, here))),
    )
    .filter((all) => all.length);
  const menu = (element = document.createElement("div"));
  element.className = "menu";
  element.setAttribute("role", "menu");
  element.setAttribute("aria-label", nameOf({title, label}));
  /** @param {Action} action */
  const item = (action) => {
    const {label: words, hint, icon: image, keys = [], checked} = action;
    const enabled = isPossible(action, here);
    const isChecked = checked && enabled ? checked(here) : undefined;
    return html`<button
      type="button"
      role=${checked ? "menuitemcheckbox" : "menuitem"}
      tabindex="-1"
      aria-disabled=${!enabled}
      aria-checked=${checked ? String(Boolean(isChecked)) : nothing}
      title=${hint ?? nothing}
      @click=${() => enabled && choose(action, here)}
    >
      ${icon(isChecked ? "properties" : image)}<span>${words}</span>${
        keys[0] ? html`<kbd>${spoken(keys[0])}</kbd>` : nothing
      }
    </button>`;
  };
  render(
    html`${title ? html`<div class="title" role="presentation">${title}</div>` : nothing}
    ${groups.map((all, index) => html`${index ? html`<div role="separator"></div>` : nothing}${all.map(item)}`)}`,
    element,
  );
  required(context.app.querySelector("main"), "place for the menu").append(element);
  const {width, height} = element.getBoundingClientRect();
  const top = Math.max(4, Math.min(y, innerHeight - height - 4));
  const stop = document.querySelector(".stop-button")?.getBoundingClientRect(); // it is above every menu
  const right = stop && top < stop.bottom && top + height > stop.top ? stop.left : innerWidth;
  element.style.left = `${Math.max(4, Math.min(x, right - width - 4))}px`;
  element.style.top = `${top}px`;
  element.addEventListener("keydown", (event) => key(event, context));
  element.addEventListener("focusout", ({relatedTarget: next}) => next && leave(next));
  element.addEventListener("contextmenu", (event) => event.preventDefault()); // Windows makes one at the key's release
  itemsOf(menu)[0]?.focus();
}

/** Hide the menu after a press or a focus elsewhere; a press on its button does so itself. @param {EventTarget} next */
function leave(next) {
  const isHere = [element, opener].some((each) => each?.contains(/** @type {Node} */ (next)));
  if (!isHere) hideMenu();
}

// Not the browser's `popover`: the release of the right button, or of a resting finger, would close it at once.
addEventListener("pointerdown", ({target}) => target && leave(target), true);

/** @param {Action} action @param {Context} context */
function choose(action, context) {
  hideMenu();
  context.canvas.focusSelected();
  action.run(context);
}

/** @param {HTMLElement} menu @returns {NodeListOf<HTMLElement>} */
const itemsOf = (menu) => menu.querySelectorAll("[role^=menuitem]");

function hideMenu() {
  const former = element;
  element = undefined;
  opener?.setAttribute("aria-expanded", "false");
  opener = undefined;
  former?.remove();
}

/** @param {KeyboardEvent} event @param {Context} context */
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
    const button = opener;
    hideMenu();
    if (button) button.focus();
    else context.canvas.focusSelected();
  } else if (event.key.length === 1 && !event.ctrlKey) {
    const letter = event.key.toLowerCase();
    const rest = [...items.slice(index + 1), ...items.slice(0, index + 1)];
    rest.find((each) => each.innerText.trim().toLowerCase().startsWith(letter))?.focus();
  } else return;
  event.preventDefault();
  event.stopPropagation();
}
