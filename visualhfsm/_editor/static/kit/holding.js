/** Keys that are pressed before the panel or field for them has loaded. */

const LIMIT = 10_000; // ms; a panel that takes longer has failed to load

/** @typedef {{key: string, shiftKey: boolean}} Key */

/** The keys pressed meanwhile, undefined while nothing is loading. @type {Key[] | undefined} */
let held;

/**
 * Hold keys until some work has moved the focus, and press them there.
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
      press(mine);
    }
  }
}

/**
 * Whether a key is held, so that it does nothing else; called for keys that are not typed into a field.
 *
 * @param {KeyboardEvent} event
 */
export function isHeld(event) {
  const {key, shiftKey} = event;
  if (!held || event.ctrlKey || event.altKey || event.metaKey || /^F\d/.test(key)) return false;
  if (key === "Escape") {
    letGo();
    return false;
  }
  if (key === "Backspace" && held.at(-1)?.key.length === 1) held.pop();
  else if (key === "Enter" || key.length === 1) held.push({key, shiftKey});
  event.preventDefault();
  return true;
}

function letGo() {
  held = undefined;
}

/** After a click, the user continues elsewhere: held keys are dropped. */
addEventListener("pointerdown", letGo, true);

/**
 * Press keys at the focus. One of them may move the focus, and cause the others to be held again.
 *
 * @param {Key[]} keys
 */
function press(keys) {
  for (const [index, {key, shiftKey}] of keys.entries()) {
    if (held) {
      held.push(...keys.slice(index));
      return;
    }
    const target = document.activeElement ?? document.body;
    if ("insert" in target && typeof target.insert === "function") {
      target.insert(key === "Enter" ? "\n" : key);
    } else if (key.length === 1 && takesText(target)) {
      write(target, key);
    } else {
      const goesOn = target.dispatchEvent(
        new KeyboardEvent("keydown", {key, shiftKey, bubbles: true, cancelable: true}),
      );
      if (goesOn && key === "Enter" && target instanceof HTMLTextAreaElement) write(target, "\n");
    }
  }
}

/** @param {HTMLInputElement | HTMLTextAreaElement} field @param {string} text */
function write(field, text) {
  const {selectionStart, selectionEnd, value} = field;
  field.setRangeText(text, selectionStart ?? value.length, selectionEnd ?? value.length, "end");
  field.dispatchEvent(new Event("input", {bubbles: true}));
}

/** @param {Element} element @returns {element is HTMLInputElement | HTMLTextAreaElement} */
const takesText = (element) =>
  element instanceof HTMLTextAreaElement || (element instanceof HTMLInputElement && element.selectionStart !== null);
