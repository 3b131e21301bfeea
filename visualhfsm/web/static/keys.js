/** Keys and their actions. The table itself is in actions.js. */

import {actionOf, actions, perform} from "./actions.js";
import {isHeld} from "./holding.js";
import {MONITOR_KEYS} from "./monitor/actions.js";

/** By how a key is written, such as `Ctrl+Shift+Z`. @type {Map<string, import("./actions.js").Action>} */
const byKey = new Map();
for (const action of actions.values()) for (const key of action.keys ?? []) byKey.set(key, action);

/** How a pressed key is written. @param {KeyboardEvent} event */
export function written(event) {
  const {key} = event;
  const letter = key.length === 1 && key !== " " ? key.toUpperCase() : key;
  const shown = /^[A-Z]$/.test(letter) || key.length > 1;
  const parts = [
    (event.ctrlKey || event.metaKey) && "Ctrl",
    event.altKey && "Alt",
    event.shiftKey && shown && "Shift",
    letter,
  ];
  return parts.filter(Boolean).join("+");
}

/** A key as it is shown to people. @param {string} key */
export function spoken(key) {
  /** @type {Record<string, string>} */
  const names = {
    ArrowLeft: "←",
    ArrowRight: "→",
    ArrowUp: "↑",
    ArrowDown: "↓",
    Delete: "Del",
    Escape: "Esc",
    PageUp: "PgUp",
    PageDown: "PgDn",
  };
  return key
    .split(/\+(?!$)/)
    .map((part) => names[part] ?? part)
    .join("+");
}

/** Whether a field has the focus. @param {EventTarget} target */
function isTyping(target) {
  return (
    target instanceof HTMLElement &&
    (target.isContentEditable ||
      (target.matches("input, textarea, select") && !target.matches("[type=checkbox], [type=radio], [type=button]")))
  );
}

/**
 * Listen for keys.
 *
 * @param {import("./actions.js").Context} context
 */
export function listenForKeys(context) {
  document.addEventListener("keydown", (event) => {
    const [target] = event.composedPath(); // that in the shadow of the code editor, too
    if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
    const typing = isTyping(target);
    if (!typing && isHeld(event)) return;
    const action = byKey.get(written(event));
    if (!action) return;
    if (action.scope !== "typing" && typing) return;
    const element = event.target instanceof Element ? event.target : document.body;
    const onCanvas = context.canvas.contains(element) || element === document.body;
    if (action.scope === "canvas" && !onCanvas) return;
    if (element.closest("[role=menu]")) return;
    event.preventDefault();
    perform(action.id, context);
  });
}

/** All keys for the help: groups of [keys, what it does]. */
export function keyTable() {
  /** @param {string} id */
  const row = (id) => {
    const {label, hint, help, keys = []} = actionOf(id);
    return {keys: keys.map(spoken), text: help ?? (hint ? `${label}: ${hint}` : label)};
  };
  const groups = {
    Draw: [
      "newState",
      "newTransition",
      "rename",
      "edit",
      "editCode",
      "openChild",
      "markInitial",
      "toggleFinal",
      "delete",
    ],
    "Move around": [
      "up",
      "moveLeft",
      "moveRight",
      "moveUp",
      "moveDown",
      "goLeft",
      "goRight",
      "goUp",
      "goDown",
      "goNext",
      "goBack",
      "cancel",
    ],
    Edit: [
      "undo",
      "redo",
      "copy",
      "cut",
      "paste",
      "duplicate",
      "group",
      "selectAll",
      "tryEarlier",
      "tryLater",
      "resetHandle",
      "layout",
      "layoutAll",
    ],
    View: ["fit", "fitSelection", "zoomIn", "zoomOut", "search", "problems", "output", "undoSteps", "theme", "help"],
    Files: ["new", "open", "save", "saveAs", "closeTab", "export", "compare", "nextTab", "previousTab"],
    "Data and run": ["interfaces", "timing", "variables", "functions", "component", "generate", "run", "stopRun"],
    "Follow and steer": MONITOR_KEYS,
  };
  return Object.entries(groups).map(([title, ids]) => ({title, rows: ids.map(row)}));
}
