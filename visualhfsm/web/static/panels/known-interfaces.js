/**
 * The interfaces that documents may declare, with what their operations do.
 *
 * @import {InterfaceDescription} from "../store.js"
 */

import {html, nothing} from "lit";
import {apply} from "../commands.js";
import {store} from "../store.js";

/** @type {InterfaceDescription[] | undefined} */
let interfaces;
/** @type {Promise<unknown> | undefined} */
let loading;

/** The known interfaces, undefined before they are loaded. */
export const known = () => interfaces;

/** Ask the server once; interfaces that are not known are typed by hand. */
export function loadInterfaces() {
  loading ??= store.request("interfaces").then(
    (found) => (interfaces = found ?? []),
    () => (loading = undefined),
  );
  return loading;
}

/** Identities in the realm with the types of their interfaces. @type {Record<string, string[]>} */
let identities = {};

/** Ask for the servants of the realm; there are none where nothing can be followed. */
export async function loadIdentities() {
  const asked = store.request("control", {component: "", action: "identities"});
  identities = /** @type {Record<string, string[]>} */ (await asked.catch(() => ({})));
}

/** Identities to offer for an interface: those that have it, and all as long as it has none. @param {string} type */
export function identitiesOf(type) {
  const wanted = type.trim().replace(/^::/, "");
  /** @param {string} each */
  const fits = (each) => each.replace(/^::/, "") === wanted || each.endsWith(`::${wanted}`);
  return Object.keys(identities).filter(
    (each) => !each.startsWith("Hfsm.") && (!wanted || identities[each].some(fits)),
  );
}

/** What the robot and others in the realm have, by name, each with the interface to declare. */
export const served = () =>
  Object.keys(identities)
    .filter((each) => !each.startsWith("Hfsm."))
    .sort()
    .map((name) => ({name, type: typeOf(name)}));

/** The interface that an identity has, as a document declares it; undefined when it is not there. @param {string} name */
export function typeOf(name) {
  const [scoped] = identities[name] ?? [];
  const short = scoped?.split("::").at(-1);
  return (interfaces ?? []).filter((each) => each.name === short).length > 1 ? scoped : short;
}

/** Declare what an identity has as an attribute of `self`. @param {string} name @param {string} type */
export const declare = (name, type) => apply("addEntry", {list: "interfaces", fields: {name, type}});

/**
 * A list of all that the robot has, to declare it.
 *
 * @param {{name: string, proxy: string}[]} declared
 */
export function servedList(declared) {
  const all = served();
  if (!all.length) return nothing;
  const taken = new Set(declared.map(({name, proxy}) => proxy.trim() || name));
  return html`<details class="operations served">
    <summary>What this robot has: ${all.length}</summary>
    <ul>
      ${all.map(
        ({name, type = ""}) =>
          html`<li>
            <span class="mono">${name}</span> <span class="faint">${type}</span>
            ${
              taken.has(name)
                ? html`<span class="faint">declared</span>`
                : html`<button
                    type="button"
                    class="link"
                    aria-label="Declare ${name}"
                    @click=${() => declare(name, type)}
                  >
                    Declare
                  </button>`
            }
          </li>`,
      )}
    </ul>
  </details>`;
}

/** Names to write into a document: plain where that is enough. @param {InterfaceDescription[]} all */
export function interfaceNames(all = []) {
  /** @param {string} name */
  const count = (name) => all.filter((each) => each.name === name).length;
  return all.map((each) => (count(each.name) > 1 ? each.scoped : each.name)).sort();
}

/**
 * The operations of an entry's interface.
 *
 * @param {{name: string, type: string}} entry
 * @param {InterfaceDescription[] | undefined} all
 */
export function interfaceDetails(entry, all) {
  const type = entry.type.trim();
  const found = all?.find((each) => each.name === type || each.scoped === type);
  if (!found) return nothing;
  const {operations} = found;
  return html`<details class="operations">
    <summary>${operations.length} operation${operations.length === 1 ? "" : "s"} of ${found.name}</summary>
    <dl>
      ${operations.map(
        (each) =>
          html`<dt class="mono">self.${entry.name}.${called(each)}</dt>
            <dd>
              ${each.documentation}${each.streamed ? html` <em>Also streamed: .latest(), .wait().</em>` : nothing}
            </dd>`,
      )}
    </dl>
  </details>`;
}

/** An operation as it is called. @param {InterfaceDescription["operations"][number]} operation */
function called({name, signature, result}) {
  const parameters = signature.replace(/^\(self(, )?/, "(");
  return `${name}${parameters}${result && result !== "None" ? ` → ${result}` : ""}`;
}
