/** Short messages at the edge of the page, which screen readers announce. */

const SHOWN = 6000; // ms
const MOST = 4; // notices at a time, without errors

/** @type {HTMLElement | undefined} */
let list;

/**
 * Show a notice, which disappears by itself; an error stays until it is dismissed.
 *
 * @param {string} text @param {"info" | "error"} kind
 * @param {{label: string, run: () => void}} [link] leads to what it is about
 * @returns {() => void} takes it away
 */
export function notify(text, kind = "info", link = undefined) {
  if (!list) {
    list = document.createElement("div");
    list.className = "notices";
    document.body.append(list);
  }
  const same = [...list.children].find(({firstChild}) => firstChild instanceof Text && firstChild.data === text);
  if (same && kind === "error") return () => same.remove(); // it may come in each frame; its button must stay
  same?.remove(); // it is shown once
  const notice = document.createElement("div");
  notice.className = `notice ${kind}`;
  notice.setAttribute("role", kind === "info" ? "status" : "alert");
  notice.textContent = text;
  if (link) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "link";
    button.textContent = link.label;
    button.addEventListener("click", () => {
      notice.remove();
      link.run();
    });
    notice.append(button);
  }
  const close = document.createElement("button");
  close.type = "button";
  close.className = "close";
  close.setAttribute("aria-label", "Dismiss");
  close.textContent = "×";
  close.addEventListener("click", () => notice.remove());
  notice.append(close);
  list.append(notice);
  if (kind === "info") setTimeout(() => notice.remove(), SHOWN);
  for (const old of [...list.querySelectorAll(".info")].slice(0, -MOST)) old.remove();
  list.scrollTop = list.scrollHeight;
  return () => notice.remove();
}

/** The message of an error. @param {unknown} error as it was caught */
export const messageOf = (error) => (error instanceof Error ? error.message : String(error));

/** Show why something could not be done. @param {unknown} error */
export function notifyError(error) {
  notify(messageOf(error), "error");
}
