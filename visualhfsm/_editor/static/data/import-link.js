import {html} from "lit";

import {page} from "./page.js";
import {t} from "../kit/texts.js";

/** A link that opens the file from which an automaton comes. @param {string} file relative to the document */
export function importLink(file) {
  if (!page.tabState?.path) return file;
  const open = async () => (await import("./files.js")).openImport(file);
  return html`<button type="button" class="link" title=${t("Open {file}", {file})} @click=${open}>${file}</button>`;
}
