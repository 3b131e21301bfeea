/**
 * Uncaught errors: they are shown, with advice.
 *
 * This module runs before the others and needs none at once, so that it also reports a page that cannot be loaded.
 */

const notices = () => import("./notices.js");
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

addEventListener("unhandledrejection", async ({reason}) => {
  if (reason?.kind)
    (await notices()).notifyError(reason); // a refusal of the server contains its own advice
  else report(String(reason), reason?.stack);
});

/** @param {string} what @param {string} stack */
async function report(what, stack = "") {
  const place = OWN_PLACE.exec(stack)?.[1];
  const loaded = await Promise.all([notices(), import("./texts.js")]).catch(() => undefined);
  if (!loaded) return document.body.append(what); // not even this can be loaded
  const [{notify}, {t}] = loaded;
  const text = t(
    "Internal error of the editor, parts of this page may no longer respond: {what}. Your changes are kept by the " +
      "server. Reload the page, and report this text if it happens again.",
    {what: place ? `${what} (${place})` : what},
  );
  return notify(text, "error", {label: t("Reload the page"), run: () => location.reload()});
}
