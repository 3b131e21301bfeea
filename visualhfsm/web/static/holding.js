/** Keys that are pressed while the panel or the field that is to take them is still on its way. */

const LIMIT = 10_000; // ms; a panel that takes longer does not come

/** What was typed meanwhile, undefined while nothing is waited for. @type {string[] | undefined} */
let held;

/**
 * Hold keys until something is done that moves the focus, and type them there.
 *
 * @template T
 * @param {() => Promise<T>} work
 */
export async function holdKeys(work) {
  const mine = (held = [...(held ?? [])]);
  const timer = setTimeout(() => held === mine && letGo(), LIMIT);
  try {
    return await work();
  } finally {
    clearTimeout(timer);
    if (held === mine) {
      letGo();
      if (mine.length) type(mine.join(""));
    }
  }
}

/**
 * Whether a key is held, so that it does nothing else; called for keys that nobody types into anything.
 *
 * @param {KeyboardEvent} event
 */
export function isHeld(event) {
  const {key} = event;
  if (!held || event.ctrlKey || event.altKey || event.metaKey || /^F\d/.test(key)) return false;
  if (key === "Escape") {
    letGo();
    return false;
  }
  if (key === "Backspace") held.pop();
  else if (key === "Enter") held.push("\n");
  else if (key.length === 1) held.push(key);
  event.preventDefault();
  return true;
}

function letGo() {
  held = undefined;
}

/** Who clicks elsewhere means that. */
addEventListener("pointerdown", letGo, true);

/** @param {string} text */
function type(text) {
  const target = document.activeElement;
  if (target && "insert" in target && typeof target.insert === "function") target.insert(text);
  else if (target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement) {
    const [line, ...rest] = text.split("\n");
    const {selectionStart, selectionEnd, value} = target;
    target.setRangeText(line, selectionStart ?? value.length, selectionEnd ?? value.length, "end");
    target.dispatchEvent(new Event("input", {bubbles: true}));
    if (rest.length)
      target.dispatchEvent(new KeyboardEvent("keydown", {key: "Enter", bubbles: true, cancelable: true}));
  }
}
