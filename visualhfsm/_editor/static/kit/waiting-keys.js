/**
 * Keys that are pressed before the field for them is there: they wait, and are pressed in it one after the other.
 *
 * From the key that opens a field until the field has the focus, no key is a command of the drawing, where it would mean
 * something else: Ctrl+A and Delete would delete all of it. If the field does not open, the keys go nowhere.
 */

import {notify} from "./notices.js";
import {t} from "./texts.js";

const LATE = 3000; // ms; then the user is told why nothing happens
const PAUSE = 1000; // ms without a key: by then who types blindly has seen that the field did not open
const MOST = 2000; // keys that wait

/** @typedef {KeyboardEventInit & {key: string}} Key @typedef {Element & {press?: (key: Key) => void, insert?: (text: string) => void}} Target */

/** What is loading. @type {Set<object>} */
const loading = new Set();
/** The keys that wait for it, and what was pasted. @type {(Key | DataTransfer)[]} */
let held = [];
let hasFailed = false;
let isLate = false;
/** Removes what the user was told meanwhile. */
let clearLate = () => {};
/** The timer of a pause after a failure, in which keys go nowhere; 0 outside of one. */
let pause = 0;

/**
 * Hold keys until some work has moved the focus, and press them there.
 *
 * @template T
 * @param {() => Promise<T>} work resolves to undefined if there is no place for the keys
 */
export async function holdKeys(work) {
  const mine = {};
  loading.add(mine);
  const late = setTimeout(() => loading.has(mine) && tellLate(), LATE);
  /** @type {T | undefined} */
  let place;
  try {
    place = await work();
    return place;
  } finally {
    clearTimeout(late);
    if (loading.delete(mine)) {
      hasFailed ||= place === undefined;
      if (!loading.size) end();
    }
  }
}

/** Press the keys that wait at the focus, such as in a dialog that has just opened. */
export function pressHeld() {
  loading.clear();
  end();
}

/**
 * Hold a key while something is loading, so that it does nothing else.
 *
 * @param {KeyboardEvent} event
 * @param {boolean} pastes whether the browser turns it into a `paste` event, which `holdPasted` takes
 */
export function holdKey(event, pastes) {
  if (!waits()) return;
  event.stopImmediatePropagation();
  if (pastes) return;
  event.preventDefault();
  const {key, code, keyCode, ctrlKey, shiftKey, altKey, metaKey} = event;
  if (isLate && key === "Escape") letGo();
  else hold(isText(event) ? {key} : {key, code, keyCode, ctrlKey, shiftKey, altKey, metaKey});
}

/** The same for what is pasted. @param {ClipboardEvent} event */
export function holdPasted(event) {
  if (!waits()) return;
  event.stopImmediatePropagation();
  event.preventDefault();
  const pasted = new DataTransfer(); // the event's own is empty later
  for (const type of event.clipboardData?.types ?? []) pasted.setData(type, event.clipboardData?.getData(type) ?? "");
  hold(pasted);
}

/** Whether a key writes a character. @param {KeyboardEvent} event */
export const isText = (event) =>
  event.key.length === 1 && (event.getModifierState("AltGraph") || !(event.ctrlKey || event.altKey || event.metaKey));

/** Whether keys are held; a dialog has keys of its own. */
const waits = () => Boolean(loading.size || pause) && !document.querySelector("dialog[open]");

/** @param {Key | DataTransfer} key */
function hold(key) {
  if (!loading.size) drop(1);
  else if (held.length < MOST) held.push(key);
}

function end() {
  const [keys, fails] = [held, hasFailed];
  letGo();
  if (fails) drop(keys.length);
  else press(keys);
}

function letGo() {
  loading.clear();
  clearTimeout(pause);
  pause = 0;
  held = [];
  hasFailed = isLate = false;
  clearLate();
}

/** After a click, the user continues elsewhere. */
addEventListener("pointerdown", letGo, true);

function tellLate() {
  isLate = true;
  clearLate = notify(t("This takes long to load. What you type waits for it; Esc goes on without it."));
}

/** Let keys go nowhere, and those that follow until the user pauses. @param {number} count */
function drop(count) {
  if (count) notify(t("What you typed went nowhere: the field for it did not open."));
  clearTimeout(pause);
  pause = setTimeout(() => (pause = 0), PAUSE);
}

/** Press keys at the focus; one may open another field, for which others wait. @param {(Key | DataTransfer)[]} keys */
function press(keys) {
  for (const [index, key] of keys.entries()) {
    if (loading.size) {
      held.push(...keys.slice(index));
      return;
    }
    const target = /** @type {Target} */ (document.activeElement ?? document.body);
    if (key instanceof DataTransfer) paste(target, key);
    else if (target.press) target.press(key);
    else pressIn(target, key);
  }
}

/** @param {Target} target @param {DataTransfer} pasted */
function paste(target, pasted) {
  const text = pasted.getData("text/plain");
  if (target.insert) target.insert(text);
  else if (takesText(target)) write(target, text);
  else target.dispatchEvent(new ClipboardEvent("paste", {clipboardData: pasted, bubbles: true, cancelable: true}));
}

/** @param {Element} target @param {Key} pressed */
function pressIn(target, pressed) {
  const {key, ctrlKey, metaKey, altKey} = pressed;
  const isPlain = !(ctrlKey || metaKey || altKey);
  if (key.length === 1 && isPlain && takesText(target)) {
    write(target, key);
    return;
  }
  const goesOn = target.dispatchEvent(new KeyboardEvent("keydown", {...pressed, bubbles: true, cancelable: true}));
  if (!goesOn) return;
  if (target instanceof HTMLButtonElement && isPlain && (key === "Enter" || key === " ")) target.click();
  if (!takesText(target)) return;
  if (key === "Enter" && target instanceof HTMLTextAreaElement) write(target, "\n");
  else if (key === "Backspace" && isPlain) write(target, "", -1);
  else if (key === "Delete" && isPlain) write(target, "", 1);
  else if (/^a$/i.test(key) && (ctrlKey || metaKey)) target.select();
}

/**
 * Write over the selection; without one, also over the character before the cursor or after it.
 *
 * @param {HTMLInputElement | HTMLTextAreaElement} field @param {string} text @param {-1 | 0 | 1} over
 */
function write(field, text, over = 0) {
  const {selectionStart, selectionEnd, value} = field;
  let [from, to] = [selectionStart ?? value.length, selectionEnd ?? value.length];
  if (from === to) [from, to] = [Math.max(0, from + Math.min(over, 0)), to + Math.max(over, 0)];
  field.setRangeText(text, from, Math.min(to, value.length), "end");
  field.dispatchEvent(new Event("input", {bubbles: true}));
}

/** @param {Element} element @returns {element is HTMLInputElement | HTMLTextAreaElement} */
const takesText = (element) =>
  element instanceof HTMLTextAreaElement || (element instanceof HTMLInputElement && element.selectionStart !== null);
