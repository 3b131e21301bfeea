/**
 * The data of the shown automaton and of the component, beside the canvas.
 *
 * @import {At} from "../data/page.js"
 * @import {Automaton, Commands, InterfaceDescription, Place} from "../data/protocol.js"
 * @import {OpenDocument} from "../data/store.js"
 * @import {CodeField} from "../code/code-field.js"
 * @import {Entries} from "./entries.js"
 * @import {TextField} from "../code/text-field.js"
 * @import {OfText} from "./fields.js"
 * @typedef {{tab: number, document: OpenDocument, automaton: Automaton, readonly: boolean}} About
 */

import {html, nothing} from "lit";
import {PageElement} from "../data/element.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import "./entries.js";
import {codeField, leave, textField} from "./fields.js";
import {
  identitiesOf,
  interfaceDetails,
  interfaceNames,
  known as knownInterfaces,
  loadIdentities,
  loadInterfaces,
  rosList,
  rosSuggestions,
  servedList,
} from "../code/known-interfaces.js";
import {failureSuggestions, loadFailures} from "../code/known-failures.js";
import {placed} from "../data/problems.js";
import {importLink} from "../data/import-link.js";
import {language, rich, t} from "../kit/texts.js";
import {placeOf} from "../data/places.js";
import {tabStrip} from "../kit/tabs.js";
import {ASSUMPTIONS, verdictOf} from "../code/verdicts.js";

const OF_AUTOMATON = new Set(["timing", "period", "variables", "functions", "inputs", "outputs", "import"]);

class DataPanel extends PageElement {
  static properties = {section: {attribute: false}, place: {attribute: false}, half: {state: true}};
  /** @type {typeof PageElement.watches} */
  static watches = {page: ["change"], store: ["document", "problems"]};

  #wanted = 0;

  constructor() {
    super();
    /** @type {string} `automaton` or `component` */
    this.half = "automaton";
  }

  connectedCallback() {
    super.connectedCallback();
    const [ofRealm, ofRobot] = [loadIdentities, loadFailures];
    for (const load of [loadInterfaces, ofRealm, ofRobot]) load().then(() => this.requestUpdate());
    this.listen(store, "robot", () => Promise.all([ofRealm(), ofRobot()]).then(() => this.requestUpdate()));
  }

  /** Show a section; set by the page, and followed by `place`. @param {string} section */
  set section(section) {
    if (section) this.revealed = this.#reveal({kind: "document", part: section});
  }

  /** Show a place in a section. @param {Place & At} place */
  set place(place) {
    if (place) this.revealed = this.#reveal(place);
  }

  /** Resolves when the requested place has the focus, to undefined if it has not. @type {Promise<true | void>} */
  revealed = Promise.resolve();

  render() {
    const {document, automaton} = page;
    if (!document || !automaton)
      return html`<div class="data-panel"><p class="empty">${t("No document is open.")}</p></div>`;
    const problems = placed(document.problems);
    const ofAutomaton = problems.filter(
      (each) => placeOf(each).kind === "automaton" && placeOf(each).automaton === automaton.id,
    );
    const ofComponent = problems.filter((each) => placeOf(each).kind === "document" && placeOf(each).part);
    const tabs = [
      {id: "automaton", label: t("Automaton {name}", {name: page.title()}), problems: ofAutomaton},
      {id: "component", label: t("Behavior"), problems: ofComponent},
    ];
    const about = {tab: page.tab, document, automaton, readonly: false};
    return html`<div class="data-panel" @keydown=${leave}>
      ${tabStrip({label: t("Whose data"), tabs, chosen: this.half, choose: (half) => (this.half = half), prefix: "data"})}
      <div class="tab-panel scrolling" role="tabpanel" id="data-panel" aria-labelledby="data-tab-${this.half}">
        ${
          this.half === "automaton"
            ? automatonData(about)
            : componentData({
                ...about,
                known: knownInterfaces(),
                update: () => this.requestUpdate(),
                showProblems: () => this.context.app.showBottom("hfsm-problems"),
              })
        }
      </div>
    </div>`;
  }

  /** @param {Place & At} place */
  async #reveal(place) {
    const part = place.part === "timing" ? "period" : place.part;
    this.half = OF_AUTOMATON.has(place.part ?? "") ? "automaton" : "component";
    const number = ++this.#wanted;
    this.requestUpdate();
    await this.updateComplete;
    if (number !== this.#wanted) return undefined;
    /** @type {HTMLElement | Entries | CodeField | null} */
    const section = this.querySelector(`[data-part="${part}"]`);
    if (!section) return undefined;
    /** @type {NodeListOf<CodeField>} */
    const codes = this.querySelectorAll("hfsm-code-field");
    await Promise.all([...codes].map(({loaded}) => loaded)); // which changes their heights
    (section.closest(".section") ?? section).scrollIntoView({block: "start"});
    const {line, column, length, focus = true} = place;
    if ("reveal" in section) {
      if (place.index !== undefined) await section.reveal(place.index, place.name, {focus});
      else if (focus) await focusFirst(section);
    } else if ("goTo" in section && line) await section.goTo(line, column, {length, focus});
    else if (focus) {
      /** @type {TextField | CodeField | null} */
      const inner = section.querySelector("hfsm-text-field, hfsm-code-field");
      await ("goTo" in section ? section : (inner ?? section)).focus();
    }
    return section.matches(":focus-within") || undefined;
  }
}

/** @param {Entries} list */
async function focusFirst(list) {
  await list.updateComplete;
  /** @type {HTMLElement | null} */ (list.querySelector("input, button.add"))?.focus();
}

/** The data of one automaton: its period, variables, functions, inputs, outputs, and the source of its content. @param {About} about */
function automatonData(about) {
  const {document, automaton} = about;
  /** @type {Place} */
  const place = {kind: "automaton", automaton: automaton.id};
  const isRoot = automaton.father === 0;
  const {imported} = automaton;
  return html` ${
    imported
      ? html`<p class="explain">
          ${rich("The content of this automaton comes from {file}; change it there.", {file: importLink(imported.file)})}
        </p>`
      : html` <div class="section">
            ${textField(about, {...place, part: "period"}, automaton.period, {
              kind: "time",
              label: t("Period"),
              hint: "100 ms",
            })}
            <p class="explain">${t("Time from one cycle to the next.")} ${rate(automaton.period)}</p>
          </div>
          <div class="section">
            <h3>${t("Variables")} <span class="faint">${t("run once, before everything")}</span></h3>
            ${codeField(about, {...place, part: "variables"}, automaton.variables, {
              label: t("Variables"),
              example: "count = 0",
            })}
          </div>
          <div class="section">
            <h3>${t("Functions")} <span class="faint">${t("called as self.name() by all automata")}</span></h3>
            ${codeField(about, {...place, part: "functions"}, automaton.functions, {
              label: t("Functions"),
              example: "def name(self):\n    ...",
            })}
          </div>
          ${isRoot ? "" : entryList(about, "inputs", automaton.inputs, {automaton: automaton.id})}
          ${entryList(about, "outputs", automaton.outputs, {automaton: automaton.id})}`
  }
  ${isRoot || !document.own.has(automaton.id) ? "" : importSection(about, place)}`;
}

/** A period as a rate, in words. @param {string} period */
function rate(period) {
  const milliseconds = Number(period.trim());
  if (!(milliseconds > 0)) return "";
  const hertz = 1000 / milliseconds;
  return `${(hertz >= 10 ? Math.round(hertz) : Number(hertz.toPrecision(2))).toLocaleString(language)} Hz.`;
}

/** @param {About} about @param {Place} place */
function importSection(about, place) {
  const {automaton} = about;
  const {imported} = automaton;
  const {states, transitions, inputs, outputs} = automaton;
  const isEmpty = [states, transitions, inputs, outputs].every((each) => !each.length);
  if (!imported && !isEmpty) return "";
  /** @param {(text: string) => object} fields @returns {TextField["send"]} */
  const set = (fields) => (to, text) => {
    const former = store.documents.get(to)?.automata.get(automaton.id)?.imported;
    return store.do(to, {
      command: "setImport",
      automaton: automaton.id,
      file: former?.file ?? "",
      source: former?.automaton ?? 0,
      ...fields(text),
    });
  };
  const where = {...place, part: "import"};
  return html`<div class="section" data-part="import">
    <h3>${t("Import")} <span class="faint">${t("the content comes from another document")}</span></h3>
    ${textField(about, where, imported?.file ?? "", {
      label: t("File"),
      hint: t("such as search.xml"),
      mono: true,
      send: set((file) => ({file})),
    })}
    ${
      imported
        ? textField(about, {...where, name: "source"}, imported.automaton ? String(imported.automaton) : "", {
            label: t("Automaton in it"),
            hint: t("the root"),
            kind: "number",
            send: set((text) => ({source: Math.max(0, Number.parseInt(text, 10) || 0)})),
          })
        : ""
    }
  </div>`;
}

/**
 * @param {About} about @param {Commands["addEntry"]["list"]} name @param {object[]} entries
 * @param {Partial<Pick<Entries, "automaton" | "details" | "suggest">>} more
 */
const entryList = (
  {tab, document},
  name,
  entries,
  {automaton = 0, details = nothingMore, suggest = noSuggestions} = {},
) =>
  html`<hfsm-entries
    data-part=${name}
    .tab=${tab}
    .automaton=${automaton}
    .of=${LISTS[name]}
    .entries=${entries}
    .problems=${placed(document.problems)}
    .details=${details}
    .suggest=${suggest}
  ></hfsm-entries>`;

/** The choices after an error; an empty text means "stop". @param {string} text @returns {Options} */
const afterError = (text) => [
  [text.trim() === "stop" ? "stop" : "", t("Stop the robot")],
  ["continue", t("Go on without it")],
];
/** The choices after a refused command; an empty text means "pause". @param {string} text @returns {Options} */
const afterRefusal = (text) => [
  [text.trim() === "pause" ? "pause" : "", t("Wait for the robot")],
  ["error", t("Same as an error")],
];
/** The worlds of the simulation, and that of the document. @param {string} chosen @returns {Options} */
const worlds = (chosen) => [
  ["", t("Any")],
  ...[...new Set([...(store.greeting.worlds ?? []).map(({name}) => name), chosen])]
    .filter(Boolean)
    .map((name) => /** @type {[string, string]} */ ([name, name])),
];
/** @type {Options} */
const LANGUAGES = [
  ["", "Python"],
  ["C++", t("C++: kept, but not run")],
];

/**
 * The data of the component: its description, interfaces, libraries, parameters, events, properties and failures.
 *
 * @param {About & {known: InterfaceDescription[] | undefined, update: () => void, showProblems: () => void}} about
 */
function componentData(about) {
  const {document, known, update, showProblems} = about;
  const {fields} = document;
  /** @param {"description" | "onError" | "onRefused" | "world" | "language"} part @param {string} label @param {Partial<OfText>} more */
  const text = (part, label, more) =>
    textField(about, {kind: "document", part}, fields[part] ?? "", {label, kind: "select", ...more});
  /**
   * @param {"interfaces" | "ros" | "libraries" | "parameters" | "events" | "properties" | "survives"} name
   * @param {Partial<Pick<Entries, "details" | "suggest">>} [more]
   */
  const list = (name, more) => entryList(about, name, fields[name] ?? [], more);
  return html` ${text("description", t("Description"), {kind: "area", hint: t("what the behavior is for")})}
  ${text("onError", t("After an error in its code"), {options: afterError(fields.onError ?? "")})}
  ${text("onRefused", t("After a refused command"), {options: afterRefusal(fields.onRefused ?? "")})}
  ${text("world", t("World of its simulation"), {options: worlds(fields.world)})}
  ${text("language", t("Language of the code"), {options: LANGUAGES})}
  ${list("interfaces", {
    details: ({name, type}) => interfaceDetails({name, type}, known),
    suggest: (field, {type}) =>
      field === "type" ? interfaceNames(known) : field === "proxy" ? identitiesOf(type) : [],
  })}
  ${servedList(fields.interfaces)} ${list("ros", {suggest: rosSuggestions})} ${rosList(fields.ros ?? [], update)}
  ${list("libraries", {suggest: (field) => (field === "name" ? ["math", "numpy as np", "cv2", "random", "json"] : [])})}
  ${list("parameters")} ${list("events")}
  ${list("properties", {details: (entry, index) => verdict(document, index, showProblems)})}
  ${list("survives", {suggest: failureSuggestions})}`;
}

const nothingMore = () => nothing;
/** @returns {string[]} */
const noSuggestions = () => [];

/** @param {OpenDocument} document @param {number} index @param {() => void} showProblems */
function verdict(document, index, showProblems) {
  const found = verdictOf(document, index);
  if (!found) return nothing;
  return html`<p class="verdict ${found.kind}">
    <span class="dot" aria-hidden="true"></span>${found.words}
    ${
      found.kind === "violated"
        ? html`<button type="button" class="link" @click=${showProblems}>${t("Show how")}</button>`
        : nothing
    }
  </p>`;
}

/**
 * The lists of a document that are edited as lists, and the fields of their entries.
 *
 * @typedef {[value: string, label: string][]} Options
 * @typedef {{name: string, label: string, kind?: string, options?: Options, hint?: string,
 *   example?: string, mono?: boolean}} Field the `hint` is in words, an `example` is code
 * @typedef {{list: Commands["addEntry"]["list"], title: string, noun: string, add: string, explain: string, fields: Field[]}} EntryList
 */

/** @type {Options} */
const TYPES = ["int", "float", "bool", "str"].map((each) => [each, each]);
/** @type {Options} */
const INPUT_TYPES = [...TYPES, ["object", "object"]];

/** @param {Options} types @param {string} hint @returns {Field[]} */
const parameterFields = (types, hint) => [
  {name: "name", label: t("Name"), mono: true},
  {name: "type", label: t("Type"), kind: "select", options: types},
  {name: "default", label: t("Default"), mono: true, hint},
  {name: "description", label: t("Description"), hint: t("purpose and unit")},
];

/** @type {Options} */
const ROS_KINDS = [
  ["subscribe", t("Subscribe")],
  ["publish", t("Publish")],
  ["service", t("Call a service")],
  ["action", t("Send goals")],
];
/** The message that is published when the component stops; by default zeros for velocities. @type {Options} */
const AT_STOP = [
  ["", t("Automatic")],
  ["true", t("Default message")],
  ["false", t("Nothing")],
];

/** @type {Options} */
const WAYS_TO_SURVIVE = [
  ["", t("Stop, or go on")],
  ["succeed", t("Go on")],
];

/** @type {Record<string, EntryList>} */
const LISTS = {
  libraries: {
    list: "libraries",
    title: t("Libraries"),
    noun: t("library"),
    add: t("Add a library"),
    explain: t("What the code imports: numpy as np, from math import pi."),
    fields: [{name: "name", label: t("Import"), mono: true, example: "math"}],
  },
  interfaces: {
    list: "interfaces",
    title: t("Interfaces"),
    noun: t("interface"),
    add: t("Add an interface"),
    explain: t("Parts of the robot that the code uses, each as an attribute of self."),
    fields: [
      {name: "name", label: "self.", mono: true, example: "camera"},
      {name: "type", label: t("Interface"), mono: true, example: "Camera"},
      {name: "proxy", label: t("On the robot"), mono: true, hint: t("same as its name")},
    ],
  },
  ros: {
    list: "ros",
    title: t("Interfaces of ROS 2"),
    noun: t("topic"),
    add: t("Add a topic"),
    explain: t("Topics, services and actions that the code uses, each as an attribute of self."),
    fields: [
      {name: "name", label: "self.", mono: true, example: "scan"},
      {name: "kind", label: t("Kind"), kind: "select", options: ROS_KINDS},
      {name: "target", label: t("Name in ROS"), mono: true, example: "/scan"},
      {name: "type", label: t("Type"), mono: true, example: "std_msgs/msg/Bool"},
      {name: "qos", label: t("QoS"), mono: true, example: "reliable depth=10"},
      {name: "stop", label: t("At the stop"), kind: "select", options: AT_STOP},
    ],
  },
  parameters: {
    list: "parameters",
    title: t("Parameters"),
    noun: t("parameter"),
    add: t("Add a parameter"),
    explain: t("Attributes of self, and command-line options."),
    fields: parameterFields(TYPES, "0.0"),
  },
  events: {
    list: "events",
    title: t("Events"),
    noun: t("event"),
    add: t("Add an event"),
    explain: t("Events that may come from outside. Events that only the code sends need no entry."),
    fields: [
      {name: "name", label: t("Name")},
      {name: "description", label: t("Description"), hint: t("when it is sent")},
    ],
  },
  properties: {
    list: "properties",
    title: t("Properties"),
    noun: t("property"),
    add: t("Add a property"),
    explain: `${t("What the model checker proves or refutes for all possible runs.")} ${ASSUMPTIONS}`,
    fields: [
      {name: "name", label: t("Name")},
      {
        name: "kind",
        label: t("Kind"),
        kind: "select",
        options: [
          ["always", t("always")],
          ["eventually", t("eventually")],
          ["never", t("never")],
        ],
      },
      {name: "within", label: t("Within"), kind: "time", hint: t("any time")},
      {
        name: "expression",
        label: t("Expression"),
        kind: "area",
        mono: true,
        example: "not (day/lamp/red and day/lamp/green)",
      },
    ],
  },
  survives: {
    list: "survives",
    title: t("Failures that it survives"),
    noun: t("failure"),
    add: t("Add a failure"),
    explain: t("What its robot may have: Is it ready? tries each, and asks that it stops or goes on."),
    fields: [
      {name: "part", label: t("Part that fails"), mono: true, example: "Camera"},
      {name: "kind", label: t("How it fails"), mono: true, example: "black"},
      {name: "amount", label: t("How much"), mono: true, hint: t("as much as is usual")},
      {name: "after", label: t("Fails at second"), mono: true, example: "2"},
      {name: "must", label: t("What it must do"), kind: "select", options: WAYS_TO_SURVIVE},
    ],
  },
  inputs: {
    list: "inputs",
    title: t("Inputs"),
    noun: t("input"),
    add: t("Add an input"),
    explain: t("Variables that the state above sets each time it is entered."),
    fields: parameterFields(INPUT_TYPES, t("none: must be passed")),
  },
  outputs: {
    list: "outputs",
    title: t("Outputs"),
    noun: t("output"),
    add: t("Add an output"),
    explain: t("Variables that the code sets and the state above may take."),
    fields: parameterFields(INPUT_TYPES, t("until the code sets it")),
  },
};

customElements.define("hfsm-data-panel", DataPanel);
