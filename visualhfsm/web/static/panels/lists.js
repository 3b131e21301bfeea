/**
 * The lists of a document that are edited as such, and what each entry has.
 *
 * @typedef {{name: string, label: string, kind?: string, options?: [string, string][], hint?: string, mono?: boolean, unit?: string,
 *   wide?: boolean}} Field `wide` takes a line of its own
 * @typedef {{list: string, title: string, noun: string, explain: string, fields: Field[]}} EntryList
 */

const TYPES = ["int", "float", "bool", "str"].map((each) => [each, each]);
const INPUT_TYPES = [...TYPES, ["object", "object"]];

const parameterFields = (types, hint) => [
  {name: "name", label: "Name", mono: true},
  {name: "type", label: "Type", kind: "select", options: types},
  {name: "default", label: "Default", mono: true, hint},
  {name: "description", label: "Description", wide: true, hint: "what it is for, and its unit"},
];

/** @type {Record<string, EntryList>} */
export const LISTS = {
  libraries: {
    list: "libraries", title: "Libraries", noun: "library", explain: "What the code imports: numpy as np, from math import pi.",
    fields: [{name: "name", label: "Import", mono: true, wide: true, hint: "math"}],
  },
  interfaces: {
    list: "interfaces", title: "Interfaces", noun: "interface", explain: "Servants that the code uses, each by an attribute of self.",
    fields: [
      {name: "name", label: "self.", mono: true, hint: "camera"},
      {name: "type", label: "Interface", mono: true, hint: "Camera"},
      {name: "proxy", label: "Identity", mono: true, hint: "as its name"},
    ],
  },
  parameters: {
    list: "parameters", title: "Parameters", noun: "parameter", explain: "Attributes of self, and options of the command line.",
    fields: parameterFields(TYPES, "0.0"),
  },
  events: {
    list: "events", title: "Events", noun: "event", explain: "Events that may come from outside. Those that only the code sends need no entry.",
    fields: [{name: "name", label: "Name"}, {name: "description", label: "Description", wide: true, hint: "when it comes"}],
  },
  properties: {
    list: "properties", title: "Properties", noun: "property", explain: "What the model checker is to prove, of all runs there may be.",
    fields: [
      {name: "name", label: "Name"},
      {name: "kind", label: "Kind", kind: "select", options: [["always", "always"], ["eventually", "eventually"], ["never", "never"]]},
      {name: "within", label: "Within", kind: "number", unit: "ms", hint: "any time"},
      {name: "expression", label: "Expression", kind: "area", mono: true, wide: true, hint: "not (day/lamp/red and day/lamp/green)"},
    ],
  },
  inputs: {
    list: "inputs", title: "Inputs", noun: "input", explain: "Variables that the state above sets each time it is entered.",
    fields: parameterFields(INPUT_TYPES, "none: must be handed over"),
  },
};
