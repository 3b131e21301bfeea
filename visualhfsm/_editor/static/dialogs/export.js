/** Export an automaton as a picture, the component as pages for print or PDF, or the document itself. */

import {html} from "lit";

import {askTab} from "../data/commands.js";
import {download, pngOf, svgText} from "../canvas/export.js";
import {icon} from "../kit/icons.js";
import {importsShown} from "../data/imported-content.js";
import {messageOf, notifyError} from "../kit/notices.js";
import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {showDialog} from "../kit/dialog.js";

/** @type {[value: string, label: string, text: string, isPicture?: boolean][]} */
const CHOICES = [
  ["svg", t("Picture of this automaton (SVG)"), t("Sharp at any size, for papers and the web."), true],
  ["png", t("Picture of this automaton (PNG)"), t("Twice the size of the drawing, for slides and documents."), true],
  ["pages", t("The whole behavior"), t("All automata with their code and data, for print or PDF.")],
  ["page", t("The drawing as a page (HTML)"), t("One file to send: anybody can look at it, and change nothing.")],
  ["document", t("The document (XML)"), t("As it would be saved now, with all unsaved changes.")],
];

export async function showExport() {
  const choice = await showDialog({
    title: t("Export"),
    content: (/** @type {import("../kit/dialog.js").Close<string>} */ close) =>
      html`<div class="choices">
        ${CHOICES.filter(([, , , isPicture]) => page.automaton || !isPicture).map(
          ([value, label, text], index) =>
            html` <button type="button" class="choice" ?autofocus=${index === 0} @click=${() => close(value)}>
              ${icon(value === "document" ? "file" : "exportFile")}<span><strong>${label}</strong><br />${text}</span>
            </button>`,
        )}
      </div>`,
  });
  if (!choice) return;
  try {
    await run(choice);
  } catch (error) {
    notifyError(new Error(t("The export failed: {reason}", {reason: messageOf(error)})));
  }
}

/** @param {string} choice */
async function run(choice) {
  const {automaton} = page;
  const name = `${page.component}${automaton?.father ? `-${page.title(automaton)}` : ""}`.replace(
    /[^\p{L}\p{N}._-]+/gu,
    "_",
  );
  if (choice === "svg") download(`${name}.svg`, new Blob([svgText(page.shownAutomaton)], {type: "image/svg+xml"}));
  else if (choice === "png") download(`${name}.png`, await pngOf(page.shownAutomaton));
  else if (choice === "pages") {
    const {printComponent} = await import("../onefile/print.js");
    await importsShown(); // they are printed, too
    await printComponent();
  } else {
    const done = await askTab("export", {page: choice === "page"});
    if (done) download(done.name, new Blob([done.text], {type: choice === "page" ? "text/html" : "application/xml"}));
  }
}
