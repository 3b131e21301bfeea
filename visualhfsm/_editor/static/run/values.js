/** Values as a monitor shows them, in Python's notation, and as it accepts them, in JSON. */

import {decimal} from "../kit/texts.js";

/** @type {Record<string, number>} */
const TRUTHS = {True: 1, False: 0};

/** @type {Record<string, string>} */
const WORDS = {True: "true", False: "false", None: "null"};

/** The number that a text shows, 1 or 0 for a truth value, undefined for anything else. @param {string} text */
function numberIn(text) {
  if (text in TRUTHS) return TRUTHS[text];
  const bare = text.startsWith("np.") && text.endsWith(")") ? text.slice(text.indexOf("(") + 1, -1) : text;
  const value = /^[+-]?\d/.test(bare) ? Number(bare) : NaN;
  return Number.isFinite(value) ? value : undefined;
}

/**
 * The value of a text in JSON or in Python's notation; undefined when it is not a value.
 *
 * @param {string} text
 */
export function valueIn(text) {
  const written = text.trim();
  try {
    return JSON.parse(written);
  } catch {
    // Then as Python would write it. Its texts are distinguished from words first.
  }
  let json = "";
  for (const [part] of written.matchAll(/'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|[A-Za-z_]\w*|[^'"A-Za-z_]+|['"]/g)) {
    if (part.length > 1 && part.startsWith("'")) json += JSON.stringify(part.slice(1, -1).replace(/\\(['\\])/g, "$1"));
    else if (part.length > 1 && part.startsWith('"')) json += part;
    else if (/^[A-Za-z_]/.test(part)) json += WORDS[part] ?? part;
    else
      json += part
        .replaceAll("(", "[")
        .replaceAll(/,?\s*\)/g, "]")
        .replaceAll(/,\s*\]/g, "]");
  }
  try {
    return JSON.parse(json);
  } catch {
    return undefined;
  }
}

/**
 * All that can be plotted of a moment, by the names that the server has for it.
 *
 * @param {import("../data/protocol.js").LiveSnapshot} snapshot
 */
export function numbersOf({component, robot}) {
  /** @type {Map<string, number>} */
  const found = new Map();
  /** @param {string} name @param {number | undefined} value */
  const put = (name, value) => value !== undefined && Number.isFinite(value) && found.set(name, value);
  for (const {id, lastCycle, overruns, variables} of component.automata) {
    put(`${id}:lastCycle`, lastCycle);
    put(`${id}:overruns`, overruns);
    for (const [name, text] of Object.entries(variables)) put(`${id}.${name}`, numberIn(text));
  }
  for (const [name, text] of Object.entries(component.parameters)) put(`self.${name}`, numberIn(text));
  for (const {camera, label, u, v} of component.marks) {
    put(`mark.${camera}/${label}.u`, u);
    put(`mark.${camera}/${label}.v`, v);
  }
  for (const [name, angle] of Object.entries(robot.joints)) put(`joint.${name}`, angle);
  if (robot.health) {
    put("robot.realTimeFactor", robot.health.realTimeFactor);
    put("robot.lag", robot.health.lag);
    put("robot.torsoTilt", robot.health.torsoTilt);
    for (const [camera, rate] of Object.entries(robot.health.cameraRates)) put(`images.${camera}`, rate);
  }
  return found;
}

/** An angle for display. @param {number} radians */
export const spokenAngle = (radians) => `${decimal((radians * 180) / Math.PI, 1)}°`;

/** The place of a joint that slides, for display. @param {number} metres */
export const spokenPlace = (metres) => `${decimal(metres * 1000, 1)} mm`;
