/**
 * The selected note or frame in the panel: its whole text, its color, and the links in it.
 *
 * @import {Annotation, Automaton, Commands} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {colorOf, COLORS, isFrame} from "../measures/areas.js";
import {apply} from "../data/commands.js";
import {actionOf} from "../kit/registry.js";
import {t} from "../kit/texts.js";
import {textField} from "./fields.js";

const LINK = /https?:\/\/[^\s<>"'`]+[^\s<>"'`.,;:!?)\]]/g;
const MOST_LINKS = 20;

/** @param {{tab: number, automaton: Automaton, annotation: Annotation, readonly: boolean}} shown */
export function annotationEditor(shown) {
  const {automaton, annotation, readonly} = shown;
  const place = {kind: /** @type {const} */ ("annotation"), automaton: automaton.id, id: annotation.id, part: "text"};
  const links = [...new Set(annotation.text.match(LINK))].slice(0, MOST_LINKS);
  const field = isFrame(annotation)
    ? {label: t("Title of the frame"), hint: t("what its states do together")}
    : {label: t("Text of the note"), hint: t("why it is so"), kind: "area"};
  return html`<div class="annotation-editor">
    ${textField(shown, place, annotation.text, {look: "", ...field})}
    <div class="color-choice" role="radiogroup" aria-label=${t("Color")}>
      ${COLORS.map((color) => colorButton(automaton, annotation, color, readonly))}
    </div>
    ${
      links.length
        ? html`<ul class="note-links" aria-label=${t("Links")}>
            ${links.map((link) => html`<li><a href=${link} target="_blank" rel="noopener noreferrer">${link}</a></li>`)}
          </ul>`
        : nothing
    }
  </div>`;
}

/** @param {Automaton} automaton @param {Annotation} annotation @param {string} color @param {boolean} readonly */
function colorButton(automaton, annotation, color, readonly) {
  const name = actionOf(`color${color[0].toUpperCase()}${color.slice(1)}`).label;
  return html`<label class="annotation ${color}" title=${name}
    ><input
      type="radio"
      name="annotation-color"
      aria-label=${name}
      .checked=${colorOf(annotation) === color}
      ?disabled=${readonly}
      @change=${() =>
        apply("setAnnotationColor", {
          automaton: automaton.id,
          annotations: [annotation.id],
          color: /** @type {Commands["setAnnotationColor"]["color"]} */ (color),
        })}
  /></label>`;
}
