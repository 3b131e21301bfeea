/**
 * The interfaces that documents may declare, with what their operations do.
 *
 * @typedef {{name: string, scopedName: string, documentation: string, identities?: string[], operations: {name: string, signature: string, documentation: string}[]}} KnownInterface
 */

import {html, nothing} from "lit";
import {store} from "../store.js";

/** @type {KnownInterface[] | undefined} */
let interfaces;
let loading;

/** What is known, undefined before it is loaded. */
export const known = () => interfaces;

/** Ask the server once; interfaces that are not known are typed by hand. */
export function loadInterfaces() {
  loading ??= store.request("interfaces").then((found) => (interfaces = found ?? []), () => (loading = undefined));
  return loading;
}

/** Names to write into a document: plain where that is enough. */
export function interfaceNames(all = []) {
  const count = (name) => all.filter((each) => each.name === name).length;
  return all.map((each) => (count(each.name) > 1 ? each.scopedName : each.name)).sort();
}

/** Identities of servants that are known. */
export const identitiesOf = (all = []) => [...new Set(all.flatMap((each) => each.identities ?? []))].sort();

/** What an entry's interface offers. @param {{name: string, type: string}} entry @param {KnownInterface[] | undefined} all */
export function interfaceDetails(entry, all) {
  const type = entry.type.trim();
  const found = all?.find((each) => each.name === type || each.scopedName === type);
  if (!found) return nothing;
  const {operations, documentation} = found;
  return html`<details class="operations"><summary>${operations.length} operation${operations.length === 1 ? "" : "s"} of ${found.name}</summary>
    ${documentation ? html`<p class="explain">${documentation}</p>` : nothing}
    <dl>${operations.map((each) => html`<dt class="mono">self.${entry.name}.${each.signature || each.name}</dt><dd>${each.documentation}</dd>`)}</dl></details>`;
}
