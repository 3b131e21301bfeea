/** Files that are dropped on the page: documents and SCXML. */

import {html, render} from "lit";

import {notifyError} from "./notices.js";

const holdsFiles = (event) => event.dataTransfer?.types.includes("Files");

/** Let files be dropped anywhere, and say so while they are dragged. @param {HTMLElement} element */
export function takeDrops(element) {
  const sign = document.createElement("div");
  sign.className = "drop-sign";
  sign.hidden = true;
  sign.setAttribute("aria-hidden", "true");
  render(html`<p><strong>Drop to open</strong><br>a document (.xml) or SCXML (.scxml)</p>`, sign);
  document.body.append(sign);
  element.addEventListener("dragover", (event) => {
    if (!holdsFiles(event)) return; // text goes where it is dropped
    event.preventDefault();
    sign.hidden = false;
  });
  element.addEventListener("dragleave", (event) => (sign.hidden = sign.hidden || !event.relatedTarget));
  element.addEventListener("drop", async (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    sign.hidden = true;
    const files = [...event.dataTransfer.files]; // gone once others run
    try {
      await (await import("./files.js")).openDropped(files);
    } catch (error) {
      notifyError(error);
    }
  });
}
