/**
 * Fields of the panel beside the canvas, each with one text of the document.
 *
 * @import {Place} from "../data/protocol.js"
 * @typedef {{tab: number, readonly: boolean}} About
 * @typedef {{label: string, hint?: string, look?: string}} Field `look` is its class
 */

import {html, nothing} from "lit";
import "../code/code-field.js";
import "../code/text-field.js";

/**
 * @param {About} about @param {Place} place @param {string} text
 * @param {Field & {kind?: string, suggestions?: string[]}} field
 */
export const textField = (about, place, text, {label, hint = "", look = "section", kind = "text", suggestions = []}) =>
  html`<hfsm-text-field
    class=${look}
    data-part=${place.part}
    kind=${kind}
    label=${label}
    hint=${hint}
    .tab=${about.tab}
    .place=${place}
    .text=${text}
    .suggestions=${suggestions}
    ?readonly=${about.readonly}
  ></hfsm-text-field>`;

/** A field for a name, above all others. @param {About} about @param {Place} place @param {string} text @param {string} label */
export const nameField = (about, place, text, label) =>
  textField(about, {...place, part: "name"}, text, {label, look: "title"});

/** @param {About} about @param {Place} place @param {string} text @param {Field} field one that can `grow` wraps its lines */
export const codeField = (about, place, text, {label, hint = "", look = "grow"}) =>
  html`<hfsm-code-field
    class=${look}
    data-part=${place.part}
    data-name=${place.name ?? nothing}
    label=${label}
    hint=${hint}
    .tab=${about.tab}
    .place=${place}
    .text=${text}
    ?wraps=${look === "grow"}
    ?readonly=${about.readonly}
  ></hfsm-code-field>`;
