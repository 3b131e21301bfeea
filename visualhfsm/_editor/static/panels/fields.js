/**
 * Fields of the panels beside the canvas, each with one text of the document.
 *
 * @import {Place} from "../data/protocol.js"
 * @import {TextField} from "../code/text-field.js"
 * @typedef {{tab: number, readonly: boolean}} About
 * @typedef {{label: string, hint?: string, look?: string}} Field `hint` is in words, `look` its class
 * @typedef {Field & Partial<Pick<TextField, "kind" | "suggestions" | "options" | "send" | "mono">>} OfText
 */

import {html, nothing} from "lit";
import "../code/code-field.js";
import "../code/text-field.js";
import {page} from "../data/page.js";

/** @param {About} about @param {Place} place @param {string} text @param {OfText} field */
export const textField = (about, place, text, {label, hint = "", look = "section", kind = "text", ...more}) =>
  html`<hfsm-text-field
    class=${look}
    data-part=${place.part}
    kind=${kind}
    label=${label}
    hint=${hint}
    .tab=${about.tab}
    .place=${place}
    .text=${text}
    .suggestions=${more.suggestions ?? []}
    .options=${more.options ?? []}
    .send=${more.send}
    ?mono=${more.mono}
    ?readonly=${about.readonly}
  ></hfsm-text-field>`;

/** A field for a name, above all others. @param {About} about @param {Place} place @param {string} text @param {string} label */
export const nameField = (about, place, text, label) =>
  textField(about, {...place, part: "name"}, text, {label, look: "title"});

/** @param {About} about @param {Place} place @param {string} text @param {Field & {example?: string}} field */
export const codeField = (about, place, text, {label, example = "", hint = example, look = "grow"}) =>
  html`<hfsm-code-field
    class=${look}
    data-part=${place.part}
    data-name=${place.name ?? nothing}
    label=${label}
    hint=${hint}
    .tab=${about.tab}
    .place=${place}
    .text=${text}
    ?short=${look === "grow"}
    ?readonly=${about.readonly}
  ></hfsm-code-field>`;

/** Escape leads from the fields back to the canvas. @param {KeyboardEvent} event */
export function leave(event) {
  if (event.key !== "Escape" || event.defaultPrevented) return;
  event.preventDefault();
  page.dispatchEvent(new Event("focus-canvas"));
}
