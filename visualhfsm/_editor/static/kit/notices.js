import {coded, n, t} from "./texts.js";
/** Short messages at the top of the canvas, which screen readers announce. */

/**
 * @typedef {{tab?: number, about?: string}} Subject what an error is about: the tab beside which alone it is shown, and
 *   what was tried, so that it goes when that succeeds
 */

const SHOWN = 6000; // ms
const MOST = 4; // notices at a time, without errors
const MOST_ERRORS = 3; // shown at a time; older ones are counted

/** @type {HTMLElement | undefined} */
let list;
/** The line for errors that are not shown. @type {HTMLElement | undefined} */
let older;

/**
 * Show a notice, which disappears by itself; an error stays until its cause is gone, or it is dismissed.
 *
 * @param {string} text @param {"info" | "error"} kind
 * @param {{label: string, run: () => void}} [link] leads to its subject
 * @param {Subject} subject
 * @returns {() => void} removes it
 */
export function notify(text, kind = "info", link = undefined, {tab = 0, about = ""} = {}) {
  list ??= makeList();
  const same = [...list.children].find((each) => each.getAttribute("data-text") === text);
  if (same && kind === "error") return () => dismiss(same); // it may be repeated in each frame; its button must stay
  same?.remove(); // the same text is shown once
  const notice = document.createElement("div");
  notice.className = `notice ${kind}`;
  notice.setAttribute("role", kind === "info" ? "status" : "alert");
  const words = document.createElement("span");
  words.className = "words";
  words.append(...coded(text));
  notice.append(words);
  const end = () => dismiss(notice);
  notice.setAttribute("data-text", text);
  notice.setAttribute("data-tab", String(tab));
  notice.setAttribute("data-about", about);
  if (link)
    notice.append(
      button(link.label, "link", () => {
        if (kind === "info") end();
        link.run();
      }),
    );
  const close = button("×", "close", end);
  close.setAttribute("aria-label", t("Dismiss"));
  notice.append(close);
  list.append(notice);
  if (kind === "info") setTimeout(end, SHOWN);
  for (const old of [...list.querySelectorAll(".info")].slice(0, -MOST)) old.remove();
  showNewest(list);
  list.scrollTop = list.scrollHeight;
  return end;
}

/** Remove the errors of what was tried and is possible now. @param {string[]} abouts */
export function clearErrors(...abouts) {
  for (const each of list?.querySelectorAll(".error") ?? [])
    if (abouts.includes(each.getAttribute("data-about") ?? "")) dismiss(each);
}

/** Show the errors that are about a document only beside it. @param {number} tab that is shown */
export function showNoticesOf(tab) {
  list ??= makeList(); // before it has notices: readers read only what is added to a region that they know
  for (const each of list.children) {
    const about = Number(each.getAttribute("data-tab"));
    each.classList.toggle("elsewhere", Boolean(about) && about !== tab);
  }
  showNewest(list);
}

function makeList() {
  const made = document.createElement("div");
  made.className = "notices";
  made.setAttribute("aria-live", "polite");
  (document.querySelector("main") ?? document.body).append(made);
  return made;
}

/** Make the line for older errors. @param {HTMLElement} all */
function makeOlder(all) {
  const made = document.createElement("div");
  made.className = "older";
  made.append(
    button("", "link", () => {
      all.classList.toggle("open");
      showNewest(all);
    }),
    button(t("Dismiss all"), "link", () => {
      for (const each of errorsOf(all)) each.remove();
      showNewest(all);
    }),
  );
  all.prepend(made);
  return made;
}

/** @param {HTMLElement} all @returns {NodeListOf<HTMLElement>} */
const errorsOf = (all) => all.querySelectorAll(".error:not(.elsewhere)");

/** Show the newest errors, and how many older ones there are. @param {HTMLElement} all */
function showNewest(all) {
  const errors = [...errorsOf(all)];
  const more = Math.max(0, errors.length - MOST_ERRORS);
  if (more) older ??= makeOlder(all);
  if (!older) return;
  const count = /** @type {HTMLElement} */ (older.firstElementChild);
  older.hidden = !more;
  if (!more) all.classList.remove("open");
  const isOpen = all.classList.contains("open");
  for (const [index, each] of errors.entries()) each.hidden = index < more && !isOpen;
  count.textContent = isOpen ? t("Fewer") : n("{count} older error", "{count} older errors", more);
  count.setAttribute("aria-expanded", String(isOpen));
}

/** @param {Element} notice */
function dismiss(notice) {
  notice.remove();
  if (list) showNewest(list);
}

/** @param {string} text @param {string} kind @param {() => void} act */
function button(text, kind, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.className = kind;
  made.textContent = text;
  made.addEventListener("click", act);
  return made;
}

/** The message of an error. @param {unknown} error as it was caught */
export const messageOf = (error) => (error instanceof Error ? error.message : String(error));

/** What errors are about that end when the page is connected again. */
export const OFFLINE = "offline";

/** Show why something could not be done. @param {unknown} error @param {Subject} [subject] */
export function notifyError(error, subject) {
  const isUnsent = error instanceof Error && "wasSent" in error && !error.wasSent;
  notify(messageOf(error), "error", undefined, isUnsent ? {about: OFFLINE} : subject);
}
