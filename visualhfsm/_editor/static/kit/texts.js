/**
 * The texts of the page in its language: English is in the code, others come from visualhfsm/_base/languages.
 *
 * A module that imports this one waits until the texts are there, so that constants may have some.
 *
 * @typedef {Record<string, unknown>} Values by the names of placeholders, such as `{name}`
 */

import {browserStorage} from "./location.js";

/** What the chosen language is kept as. */
export const CHOSEN = "visualhfsm.language";

const found = document.querySelector("meta[name=languages]")?.getAttribute("content") ?? "";
/** The languages that the page has, English first. */
export const languages = ["en", ...found.split(" ").filter(Boolean)];

/** The language of the page: the chosen one, or else the first of the browser's that the page has. */
export const language =
  [browserStorage.getItem(CHOSEN), ...navigator.languages]
    .flatMap((each) => (each ? [each, each.split("-")[0]] : []))
    .find((each) => languages.includes(each)) ?? "en";
document.documentElement.lang = language;

/** Texts by those of the code; those with a number by its category. @type {Record<string, any>} */
const catalog = language === "en" ? {} : await load();
const rules = new Intl.PluralRules(language);

async function load() {
  const inFile = document.getElementById(`texts-${language}`)?.textContent; // of a page without a server
  return inFile ? JSON.parse(inFile) : (await fetch(new URL(`../languages/${language}.json`, import.meta.url))).json();
}

/**
 * A name with marks for the characters that turn the direction of what follows: nobody sees them, and
 * `a\u202egnp.xml` would read like a picture's name.
 *
 * @param {string} name
 */
export const visible = (name) =>
  name.replace(
    /[\u200e\u200f\u202a-\u202e\u2066-\u2069]/g,
    (each) => `‹U+${each.charCodeAt(0).toString(16).toUpperCase()}›`,
  );

/** @param {string} text @param {Values} [values] */
const filled = (text, values) => (values ? text.replace(/{(\w+)}/g, (_, name) => visible(String(values[name]))) : text);

/** A text in the language of the page. @param {string} text in English @param {Values} [values] */
export const t = (text, values) => filled(catalog[text] ?? text, values);

/** A text of a document that comes along, if the catalog has it. @param {string} text */
export const translated = (text) => catalog[text] ?? text;

/**
 * A text with a number, `{count}`.
 *
 * @param {string} one in English, for 1
 * @param {string} other in English, for other numbers
 * @param {number} count @param {Values} [values]
 */
export const n = (one, other, count, values) =>
  filled(catalog[one]?.[rules.select(count)] ?? (count === 1 ? one : other), {count, ...values});

/**
 * The parts of a text whose values may be elements, for a template.
 *
 * @param {string} text in English
 * @param {Values} values
 */
export const rich = (text, values) =>
  t(text)
    .split(/{(\w+)}/)
    .map((part, index) => (index % 2 ? values[part] : part));

/** A number in prose. @param {number} value @param {number} digits after the point, or the comma */
export const decimal = (value, digits) =>
  value.toLocaleString(language, {minimumFractionDigits: digits, maximumFractionDigits: digits});

/** A component time for display. @param {number} seconds @param {number} [digits] after the point */
export function spokenSeconds(seconds, digits = 1) {
  if (!Number.isFinite(seconds)) return "–";
  const minutes = Math.floor(seconds / 60);
  const rest = `${decimal(seconds - minutes * 60, digits)} s`;
  return minutes ? `${minutes} min ${rest}` : rest;
}

/** The parts of a text in which names stand between backticks, these as elements. @param {string} text @returns {(string | HTMLElement)[]} */
export const coded = (text) =>
  text.split("`").map((part, index) => {
    if (!(index % 2)) return part;
    const code = document.createElement("code");
    code.textContent = part;
    return code;
  });

/** A text for screen readers and bubbles of the browser, which show no code. @param {string} text */
export const uncoded = (text) => text.replaceAll("`", "");

/** @type {Record<string, number>} */
const UNITS = {"": 1, ms: 1, s: 1000, min: 60_000};

/** A time of a document in minutes, seconds or milliseconds; other text stays as it is. @param {string} milliseconds */
export function spokenTime(milliseconds) {
  const value = Number(milliseconds);
  if (!milliseconds.trim() || !Number.isFinite(value)) return milliseconds.trim();
  if (value >= UNITS.min && value % UNITS.min === 0) return `${value / UNITS.min} min`;
  return value >= UNITS.s && Number.isInteger(value) ? `${value / UNITS.s} s` : `${value} ms`;
}

/** A typed time such as `1.5 s` or `500 ms` in milliseconds; other text stays as it is. @param {string} typed */
export function toMilliseconds(typed) {
  const [, number, unit] = /^(\d+(?:[.,]\d+)?)\s*(ms|s|min|)$/i.exec(typed.trim()) ?? [];
  if (number === undefined) return typed;
  return String(+(Number(number.replace(",", ".")) * UNITS[unit.toLowerCase()]).toFixed(6));
}

/** A text as it is compared: neither case nor accents matter. @param {string} text */
export const folded = (text) => text.trim().normalize("NFD").replace(/\p{M}/gu, "").toLowerCase();

/** Whether a text contains all words of another one, or parts of words, in any order. @param {string} text @param {string} sought */
export function containsWords(text, sought) {
  const all = folded(text);
  return folded(sought)
    .split(/\s+/)
    .every((word) => all.includes(word));
}
