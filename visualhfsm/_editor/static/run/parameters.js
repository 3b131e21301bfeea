/**
 * The values of parameters of the last run of each document, while the page is open.
 *
 * @import {Parameter} from "../data/protocol.js"
 * @typedef {Record<string, string>} Values by the parameter's name; a missing one means the default
 */

/** By tab. @type {Map<number, Values>} */
export const lastValues = new Map();

/**
 * The options of a component's command line that set its parameters, as `with_parameters` of hfsm_runtime/command.py
 * makes them.
 *
 * @param {Parameter[]} parameters
 * @param {Values} values
 */
export function parameterOptions(parameters, values) {
  return parameters.flatMap(({name, type}) => {
    const value = values[name];
    if (!value) return [];
    const option = name.replaceAll("_", "-");
    if (type === "bool") return value === "True" ? `--${option}` : `--no-${option}`;
    return `--${option}=${value}`;
  });
}
