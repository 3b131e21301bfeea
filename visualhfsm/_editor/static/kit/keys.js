/** Keys and their actions. The actions are defined in actions.js. */

import {holdKey, holdPasted, isText} from "./waiting-keys.js";
import {actionOf, actions, perform} from "./registry.js";
import {required} from "./existence.js";
import {t} from "./texts.js";

const MIDDLE = 1; // the button of the mouse
const PASTED = 100; // ms in which the release of the middle button pastes

export const isMac = /^(Mac|iP)/.test(navigator.platform);

/** The name of a pressed key. @param {KeyboardEvent} event */
export function written(event) {
  const key = latin(event);
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

/**
 * The Latin letter of a key. Where the keyboard types another character, as with the Option key of a Mac or on Cyrillic
 * and Greek keyboards, the position of the key counts.
 *
 * @param {KeyboardEvent} event
 */
function latin(event) {
  const {key, code, altKey} = event;
  const [, letter] = /^Key([A-Z])$/.exec(code) ?? [];
  if (!letter || /^[a-z]$/i.test(key)) return key;
  if (altKey) return letter;
  // The right Alt key of other keyboards types special characters, not shortcuts.
  return /^[^\p{ASCII}]$/u.test(key) && !event.getModifierState("AltGraph") ? letter : key;
}

/** @type {Record<string, string>} */
const NAMES = {
  ArrowLeft: "←",
  ArrowRight: "→",
  ArrowUp: "↑",
  ArrowDown: "↓",
  Backspace: t("Backspace"),
  ContextMenu: t("Menu key"),
  Delete: t("Del"),
  End: t("End"),
  Enter: t("Enter"),
  Escape: t("Esc"),
  PageUp: t("PgUp"),
  PageDown: t("PgDn"),
  Shift: t("Shift"),
  Space: t("Space"),
};
/** @type {Record<string, string>} */
const MAC_NAMES = {...NAMES, Ctrl: "⌘", Alt: "⌥", Shift: "⇧", Delete: "⌦", Backspace: "⌫"};
/** Keys that macOS reserves with ⌘: there they are pressed with Control. */
const MAC_CONTROL = new Set(["Ctrl+M", "Ctrl+Shift+Space"]);

/** A key as it is shown to the user, with the symbols of a Mac on one. @param {string} key */
export function spoken(key, mac = isMac) {
  const parts = key.split(/\+(?!$)/);
  if (!mac) return parts.map((part) => NAMES[part] ?? part).join("+");
  /** @type {Record<string, string>} */
  const names = {...MAC_NAMES, ...(MAC_CONTROL.has(key) && {Ctrl: "⌃"})};
  const signs = parts.map((part) => names[part] ?? part);
  return signs.sort((one, other) => modifierRank(one) - modifierRank(other)).join("");
}

/** The rank of a modifier's symbol on a Mac among those before the key. @param {string} sign */
function modifierRank(sign) {
  const rank = "⌃⌥⇧⌘".indexOf(sign);
  return rank < 0 ? 4 : rank;
}

/** The key of an action as it is shown to the user. @param {string} id */
export const keyOf = (id) => spoken(required(actionOf(id).keys?.[0], `key of ${id}`));

/** A key in the words of the attribute `aria-keyshortcuts`. @param {string} key */
export const ariaKey = (key) => key.replace("Ctrl", isMac && !MAC_CONTROL.has(key) ? "Meta" : "Control");

/** Keys that edit a text, or move in it. */
const EDITS = /(^|\+)(Arrow\w+|Home|End|Page\w+|Backspace|Delete|Enter|Tab|Escape)$/;

/** Whether the Option key of a Mac types a character for programs or names, such as `@` or an accent. */
const composes = (/** @type {KeyboardEvent} */ {altKey, key}) => altKey && /^(Dead|[!-@[-`{-~])$/.test(key);

/** Whether browsers leave the page with a key that moves no cursor. @param {string} key @param {boolean} typing */
const leaves = (key, typing) =>
  /^(Alt|Ctrl)\+Arrow(Left|Right)$/.test(key) && !(typing && (isMac || key.startsWith("Ctrl")));

/** Whether a field has the focus. @param {EventTarget | null} target */
export function isTyping(target) {
  return (
    target instanceof HTMLElement &&
    (target.isContentEditable ||
      (target.matches("input, textarea, select") && !target.matches("[type=checkbox], [type=radio], [type=button]")))
  );
}

/** Where the keys of an action hold: a key without Ctrl or Alt on the drawing, unless the action says otherwise. */
export function scopeOf(/** @type {import("./registry.js").Action} */ action, /** @type {string} */ key) {
  return action.scope ?? (/^(Ctrl|Alt|F\d)/.test(key) ? "page" : "drawing");
}

/**
 * Whether keys of a scope hold where the focus is. Without a focus they are for the drawing.
 *
 * @param {string} scope @param {Element} focused @param {HTMLElement} canvas
 */
function holds(scope, focused, canvas) {
  if (scope === "canvas") return focused === document.body || canvas.contains(focused);
  if (scope === "drawing")
    return focused === document.body || Boolean(focused.closest("hfsm-canvas, hfsm-tools, hfsm-tree"));
  return true;
}

/** Listen for keys. @param {import("./registry.js").Context} context */
export function listenForKeys(context) {
  /** The action of a key, such as `Ctrl+Shift+Z`. @param {string} key */
  const byKey = (key) => [...actions.values()].find(({scope, keys}) => scope !== "code" && keys?.includes(key));
  const hold = (/** @type {KeyboardEvent} */ event) => {
    const key = written(event);
    const action = byKey(key);
    const isUrgent = action?.scope === "typing" && /F\d+$/.test(key); // what controls a run does not wait
    const isOurs = action || isText(event) || EDITS.test(key); // the browser's own keys are left to it
    if (isOurs && !isUrgent && !event.isComposing) holdKey(event, action?.id === "paste");
  };
  addEventListener("keydown", hold, {capture: true}); // before all others, such as tabs
  addEventListener("paste", holdPasted, {capture: true});
  document.addEventListener("keydown", (event) => {
    const [target] = event.composedPath(); // includes elements in the shadow root of the code editor
    if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
    const typing = isTyping(target);
    if (typing && composes(event)) return;
    const key = written(event);
    const action = byKey(key);
    const element = event.target instanceof Element ? event.target : document.body;
    const searches = /^[^ ]$/.test(key) && !typing && holds("drawing", element, context.canvas); // in Firefox
    if (leaves(key, typing) || searches) event.preventDefault();
    if (!action || action.id === "paste") return; // the browser's `paste` event, below, contains the text
    const scope = scopeOf(action, key);
    if (scope !== "typing" && typing) return;
    if (!holds(scope, element, context.canvas) || element.closest("[role=menu]")) return;
    event.preventDefault();
    perform(action.id, context);
  });
  // On X11, the release of the middle button, which pans the drawing, also pastes what is selected elsewhere.
  let released = -Infinity;
  document.addEventListener(
    "pointerup",
    ({button, timeStamp}) => (released = button === MIDDLE ? timeStamp : -Infinity),
    {capture: true},
  );
  document.addEventListener("paste", (event) => {
    const [target] = event.composedPath();
    if (event.defaultPrevented || document.querySelector("dialog[open]") || isTyping(target)) return;
    event.preventDefault();
    if (event.timeStamp - released < PASTED) return;
    const {clipboardData} = event;
    const pasted = {text: clipboardData?.getData("text/plain"), html: clipboardData?.getData("text/html")};
    perform("paste", {...context, pasted});
  });
}
