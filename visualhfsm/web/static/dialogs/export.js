/** Export an automaton as a picture, the component as pages for print or PDF, or the document itself. */

import {html} from "lit";

import {askTab} from "../commands.js";
import {download, pngOf, svgText} from "../canvas/export.js";
import {icon} from "../icons.js";
import {notifyError} from "../notices.js";
import {page} from "../page.js";
import {showDialog} from "./dialog.js";

const CHOICES = [
  ["svg", "Picture of this automaton (SVG)", "Lines that stay sharp at any size, for papers and the web."],
  ["png", "Picture of this automaton (PNG)", "At twice the size of the drawing, for slides and pages."],
  ["pages", "The whole component", "All automata with their code and data, for print or PDF."],
  ["document", "The document (XML)", "As it would be saved now, with all that is not saved yet."],
];

export async function showExport() {
  const choice = await showDialog({
    title: "Export",
    content: (close) =>
      html`<div class="choices">
        ${CHOICES.map(
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
    notifyError(new Error(`The export failed: ${error.message}`));
  }
}

async function run(choice) {
  const automaton = page.automaton;
  const name = `${page.component}${automaton.father ? `-${page.title(automaton)}` : ""}`.replace(
    /[^\p{L}\p{N}._-]+/gu,
    "_",
  );
  if (choice === "svg") download(`${name}.svg`, new Blob([svgText(automaton)], {type: "image/svg+xml"}));
  else if (choice === "png") download(`${name}.png`, await pngOf(automaton));
  else if (choice === "pages") await (await import("../print.js")).printComponent();
  else {
    const done = await askTab("export");
    if (done) download(done.name, new Blob([done.text], {type: "application/xml"}));
  }
}
