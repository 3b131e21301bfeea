/** The data of the component: what it is for, what it uses, and what is to be proved of it. */

import {html, nothing} from "lit";
import {LISTS} from "./lists.js";
import {identitiesOf, interfaceDetails, interfaceNames} from "./known-interfaces.js";
import {verdictOf} from "./verdicts.js";

/** What stands in the document; an empty one is "stop". */
const afterError = (text) => [[text.trim() === "stop" ? "stop" : "", "Stop the robot and halt"], ["continue", "Go on without that piece of code"]];
/** The same; an empty one is "pause". */
const afterRefusal = (text) => [[text.trim() === "pause" ? "pause" : "", "Pause until the robot takes commands again"], ["error", "Treat it as an error in the code"]];
const LANGUAGES = [["", "Python"], ["C++", "C++: kept, and not run"]];

/**
 * @param {{tab: number, document: import("../store.js").OpenDocument,
 *   known: import("./known-interfaces.js").KnownInterface[] | undefined, showProblems: () => void}} about
 */
export function componentData({tab, document, known, showProblems}) {
  const {fields, problems} = document;
  const text = (part, label, rest) => html`<hfsm-text-field data-section=${part} class="section" label=${label} .tab=${tab} .place=${{kind: "document", part}} .text=${fields[part] ?? ""}
    kind=${rest.kind} .options=${rest.options ?? []} hint=${rest.hint ?? ""}></hfsm-text-field>`;
  const list = (name, more = {}) => html`<hfsm-entries data-section=${name} .tab=${tab} .of=${LISTS[name]} .entries=${fields[name] ?? []} .problems=${problems}
    .details=${more.details ?? nothingMore} .suggest=${more.suggest ?? noSuggestions}></hfsm-entries>`;
  return html`
    ${text("description", "Description", {kind: "area", hint: "what the component is for"})}
    ${text("onError", "After an error in its code", {kind: "select", options: afterError(fields.onError ?? "")})}
    ${text("onRefused", "After a refused command", {kind: "select", options: afterRefusal(fields.onRefused ?? "")})}
    ${text("language", "Language of the code", {kind: "select", options: LANGUAGES})}
    ${list("interfaces", {details: (entry) => interfaceDetails(entry, known), suggest: (field, {type}) => ({type: () => interfaceNames(known), proxy: () => identitiesOf(type)})[field]?.() ?? []})}
    ${list("libraries", {suggest: (field) => (field === "name" ? ["math", "numpy as np", "cv2", "random", "json"] : [])})}
    ${list("parameters")}
    ${list("events")}
    ${list("properties", {details: (entry, index) => verdict(document, index, showProblems)})}`;
}

const nothingMore = () => nothing;
const noSuggestions = () => [];

function verdict(document, index, showProblems) {
  const found = verdictOf(document, index);
  if (!found) return nothing;
  return html`<p class="verdict ${found.kind}"><span class="dot" aria-hidden="true"></span>${found.words}
    ${found.kind === "violated" ? html`<button type="button" class="link" @click=${showProblems}>Show how</button>` : nothing}</p>`;
}
