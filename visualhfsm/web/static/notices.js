/** Short messages at the edge of the page, which screen readers speak. */

const SHOWN = 6000; // ms
const SHOWN_ERROR = 12_000;

let list;

/** Tell something. @param {string} text @param {"info" | "error"} kind */
export function notify(text, kind = "info") {
  if (!list) {
    list = document.createElement("div");
    list.className = "notices";
    document.body.append(list);
  }
  for (const each of list.children) if (each.firstChild.data === text) each.remove(); // it is said anew, not twice
  const notice = document.createElement("div");
  notice.className = `notice ${kind}`;
  notice.setAttribute("role", kind === "error" ? "alert" : "status");
  notice.textContent = text;
  const close = document.createElement("button");
  close.type = "button";
  close.className = "close";
  close.setAttribute("aria-label", "Dismiss");
  close.textContent = "×";
  close.addEventListener("click", () => notice.remove());
  notice.append(close);
  list.append(notice);
  while (list.children.length > 4) list.firstElementChild.remove();
  setTimeout(() => notice.remove(), kind === "error" ? SHOWN_ERROR : SHOWN);
}

/** Tell why something could not be done. */
export function notifyError(error) {
  notify(error.message, "error");
}
