/**
 * Uncaught errors: they are shown, with advice.
 *
 * This module runs before the others and needs only the notices, so that it also reports a page that cannot be loaded.
 */

import {notify, notifyError} from "./notices.js";

const OWN_PLACE = /\/static\/\w+\/([\w./-]+:\d+)/;

addEventListener(
  "error",
  (event) => {
    if (event.target !== window) {
      // an error of an element, such as a picture of a camera
      if (event.target instanceof HTMLScriptElement) report(`${event.target.src} could not be loaded`);
    } else if (!event.message.startsWith("ResizeObserver loop")) {
      // harmless: sizes follow in the next frame
      report(event.message, event.error?.stack ?? `${event.filename}:${event.lineno}`);
    }
  },
  {capture: true},
);

addEventListener("unhandledrejection", ({reason}) => {
  if (reason?.kind)
    notifyError(reason); // a refusal of the server contains its own advice
  else report(String(reason), reason?.stack);
});

/** @param {string} what @param {string} stack */
function report(what, stack = "") {
  const place = OWN_PLACE.exec(stack)?.[1];
  const text =
    `Internal error of the editor, parts of this page may no longer respond: ${what}${place ? ` (${place})` : ""}. ` +
    "Your changes are kept by the server. Reload the page, and report this text if it happens again.";
  notify(text, "error", {label: "Reload the page", run: () => location.reload()});
}
