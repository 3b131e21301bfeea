/** Files that are dropped on the page. */

import {html, render} from "lit";
import {notifyError} from "../kit/notices.js";
import {t} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";

/** @param {DragEvent} event */
const holdsFiles = (event) => event.dataTransfer?.types.includes("Files") ?? false;

/** Accept files that are dropped anywhere, and show a sign while they are dragged. @param {HTMLElement} element */
export function takeDrops(element) {
  const sign = document.createElement("div");
  sign.className = "drop-sign";
  sign.hidden = true;
  sign.setAttribute("aria-hidden", "true");
  render(html`<p><strong>${t("Drop to open")}</strong><br />${t("a document (.xml) or SCXML (.scxml)")}</p>`, sign);
  document.body.append(sign);
  element.addEventListener("dragover", (event) => {
    if (!holdsFiles(event) || viewing.on) return; // text goes where it is dropped
    event.preventDefault();
    sign.hidden = false;
  });
  element.addEventListener("dragleave", (event) => (sign.hidden = sign.hidden || !event.relatedTarget));
  element.addEventListener("drop", async (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    if (viewing.on) return;
    sign.hidden = true;
    const files = [...(event.dataTransfer?.files ?? [])]; // the browser empties the list after this handler
    try {
      await (await import("../data/files.js")).openDropped(files);
    } catch (error) {
      notifyError(error);
    }
  });
}
