/**
 * The interfaces that documents may declare, with the documentation of their operations.
 *
 * @import {InterfaceDescription, RosInterface} from "../data/protocol.js"
 */

import {html, nothing} from "lit";
import {apply} from "../data/commands.js";
import {store} from "../data/store.js";
import {wordButton} from "../kit/buttons.js";
import {n, t} from "../kit/texts.js";

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

/** Request the servants of the realm, and without a robot there those of a Nao; none where nothing can be followed. */
export async function loadIdentities() {
  const asked = store.request("identities");
  identities = /** @type {Record<string, string[]>} */ (await asked.catch(() => ({})));
}

/** Identities to offer for an interface: those that have it, or all without an interface. @param {string} type */
export function identitiesOf(type) {
  const wanted = type.trim().replace(/^::/, "");
  /** @param {string} each */
  const fits = (each) => each.replace(/^::/, "") === wanted || each.endsWith(`::${wanted}`);
  return Object.keys(identities).filter(
    (each) => !each.startsWith("Hfsm.") && (!wanted || identities[each].some(fits)),
  );
}

/** Servants of the robot and of others in the realm, by name, each with the interface to declare. */
export const served = () =>
  Object.keys(identities)
    .filter((each) => !each.startsWith("Hfsm."))
    .sort()
    .map((name) => ({name, type: typeOf(name)}));

/** The interface that an identity has, as a document declares it; undefined without one. @param {string} name */
export function typeOf(name) {
  const [scoped] = identities[name] ?? [];
  const short = scoped?.split("::").at(-1);
  return (interfaces ?? []).filter((each) => each.name === short).length > 1 ? scoped : short;
}

/** Declare the interface of an identity as an attribute of `self`. @param {string} name @param {string} type */
export const declare = (name, type) => apply("addEntry", {list: "interfaces", fields: {name, type}});

/**
 * What can be declared, as the items of a list: a name, a type, and a button unless it is declared.
 *
 * @param {{name: string, type: string, isDeclared: boolean, verb: string, label: string, act: () => unknown}[]} all
 */
const offered = (all) =>
  html`<ul>
    ${all.map(
      ({name, type, isDeclared, verb, label, act}) =>
        html`<li>
          <span class="mono">${name}</span> <span class="faint">${type}</span>
          ${isDeclared ? html`<span class="faint">${t("declared")}</span>` : wordButton(verb, act, {kind: "link", label})}
        </li>`,
    )}
  </ul>`;

/** A list of all servants of the robot, to declare them. @param {{name: string, proxy: string}[]} declared */
export function servedList(declared) {
  const taken = new Set(declared.map(({name, proxy}) => proxy.trim() || name));
  const all = served().map(({name, type = ""}) => ({
    name,
    type,
    isDeclared: taken.has(name),
    verb: t("Declare"),
    label: t("Declare {name}", {name}),
    act: () => declare(name, type),
  }));
  if (!all.length) return nothing;
  return html`<details class="operations served">
    <summary>
      ${store.robot.status === "present" ? t("What this robot has") : t("What a Nao has")}: ${all.length}
    </summary>
    ${offered(all)}
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
 * @param {{name: string, type: string}} entry @param {InterfaceDescription[] | undefined} all
 */
export function interfaceDetails(entry, all) {
  const type = entry.type.trim();
  const found = all?.find((each) => each.name === type || each.scoped === type);
  if (!found) return nothing;
  const {operations} = found;
  return html`<details class="operations">
    <summary>
      ${n("{count} operation of {name}", "{count} operations of {name}", operations.length, {name: found.name})}
    </summary>
    <dl>
      ${operations.map(
        (each) =>
          html`<dt class="mono">${`self.${entry.name}.${called(each)}`}</dt>
            <dd>
              ${each.documentation}${each.streamed ? html` <em>${t("Also streamed: .latest(), .wait().")}</em>` : nothing}
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

/**
 * The graph of ROS: names with types, and all known types; requested when the list is opened.
 *
 * @typedef {Record<string, string[]>} Named
 * @type {{topics: Named, services: Named, actions: Named, types: Named}}
 */
let ros = {topics: {}, services: {}, actions: {}, types: {}};
/** Why it could not be read, or that it is being read. */
let rosNote = "";

/** For each kind of interface, its names in the graph, and the kind of its types. @type {Record<string, ["topics" | "services" | "actions", string]>} */
const OF_KIND = {
  subscribe: ["topics", "msg"],
  publish: ["topics", "msg"],
  service: ["services", "srv"],
  action: ["actions", "action"],
};

/** @type {Record<string, string>} */
const KINDS = {subscribe: t("subscribe"), publish: t("publish"), service: t("service"), action: t("action")};

/** The suggestions for a field of an interface of ROS. @param {string} field @param {Record<string, string>} entry */
export function rosSuggestions(field, {kind, target}) {
  const [named, types] = OF_KIND[kind] ?? OF_KIND.subscribe;
  if (field === "target") return Object.keys(ros[named]);
  if (field === "qos") return ["sensor_data", "latched", "reliable", "best_effort", "transient_local", "keep_all"];
  if (field !== "type") return [];
  return [...new Set([...(ros[named][target.trim()] ?? []), ...(ros.types[types] ?? [])])];
}

/** Ask for the graph, which takes a second. @param {() => void} update */
async function lookIntoRos(update) {
  rosNote = t("Looking…");
  update();
  const asked = store.request("rosGraph");
  try {
    ros = /** @type {typeof ros} */ (await asked);
    rosNote = Object.values(OF_KIND).some(([named]) => Object.keys(ros[named]).length) ? "" : t("Nothing was found.");
  } catch (error) {
    rosNote = /** @type {Error} */ (error).message;
  }
  update();
}

/**
 * A list of the content of the graph of ROS, to declare it; read when it is opened.
 *
 * @param {RosInterface[]} declared @param {() => void} update
 */
export function rosList(declared, update) {
  const taken = new Set(declared.map(({kind, target}) => `${kind} ${target.trim()}`));
  /** @param {string} kind @param {string} target @param {string} type */
  const add = (kind, target, type) => {
    const name = target.split("/").at(-1)?.replace(/\W/g, "_") ?? "";
    return apply("addEntry", {list: "ros", fields: {name, kind, target, type}});
  };
  const all = Object.entries(OF_KIND).flatMap(([kind, [named]]) =>
    Object.entries(ros[named]).map(([name, [type = ""]]) => ({
      name,
      type,
      isDeclared: taken.has(`${kind} ${name}`),
      verb: KINDS[kind],
      label: `${KINDS[kind]} ${name}`,
      act: () => add(kind, name, type),
    })),
  );
  /** @param {Event} event */
  const look = ({target}) => /** @type {HTMLDetailsElement} */ (target).open && lookIntoRos(update);
  return html`<details class="operations served" @toggle=${look}>
    <summary>${t("What the graph of ROS has")}</summary>
    ${rosNote ? html`<p class="explain">${rosNote}</p>` : nothing} ${offered(all)}
  </details>`;
}
