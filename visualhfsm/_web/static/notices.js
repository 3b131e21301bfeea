/** Short messages in a corner of the page, which screen readers announce. */

const SHOWN = 6000; // ms
const MOST = 4; // notices at a time, without errors
const MOST_ERRORS = 3; // shown at a time; older ones are counted

/** @type {HTMLElement | undefined} */
let list;
/** The line for errors that are not shown. @type {HTMLElement | undefined} */
let older;

/**
 * Show a notice, which disappears by itself; an error stays until it is dismissed.
 *
 * @param {string} text @param {"info" | "error"} kind
 * @param {{label: string, run: () => void}} [link] leads to its subject
 * @returns {() => void} removes it
 */
export function notify(text, kind = "info", link = undefined) {
  list ??= makeList();
  const same = [...list.children].find(({firstChild}) => firstChild instanceof Text && firstChild.data === text);
  if (same && kind === "error") return () => dismiss(same); // it may be repeated in each frame; its button must stay
  same?.remove(); // the same text is shown once
  const notice = document.createElement("div");
  notice.className = `notice ${kind}`;
  notice.setAttribute("role", kind === "info" ? "status" : "alert");
  notice.textContent = text;
  const end = () => dismiss(notice);
  if (link)
    notice.append(
      button(link.label, "link", () => {
        end();
        link.run();
      }),
    );
  const close = button("×", "close", end);
  close.setAttribute("aria-label", "Dismiss");
  notice.append(close);
  list.append(notice);
  if (kind === "info") setTimeout(end, SHOWN);
  for (const old of [...list.querySelectorAll(".info")].slice(0, -MOST)) old.remove();
  showNewest(list);
  list.scrollTop = list.scrollHeight;
  return end;
}

function makeList() {
  const made = document.createElement("div");
  made.className = "notices";
  document.body.append(made);
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
    button("Dismiss all", "link", () => {
      for (const each of errorsOf(all)) each.remove();
      showNewest(all);
    }),
  );
  all.prepend(made);
  return made;
}

/** @param {HTMLElement} all @returns {NodeListOf<HTMLElement>} */
const errorsOf = (all) => all.querySelectorAll(".error");

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
  count.textContent = isOpen ? "Fewer" : `${more} older error${more === 1 ? "" : "s"}`;
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

/** Show why something could not be done. @param {unknown} error */
export function notifyError(error) {
  notify(messageOf(error), "error");
}
