/** The data of a page that is one file, from visualhfsm/_base/html_file.py. */

import {required} from "../kit/existence.js";
import {language} from "../kit/texts.js";

/** The data as text. */
export async function unpackedData() {
  const packed = atob(required(document.getElementById("data"), "data").textContent ?? "");
  const bytes = Uint8Array.from(packed, (each) => each.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

/**
 * What a line of these data contains, with what is said in the language of the page: what `in_all_languages` of
 * visualhfsm/_base/languages writes.
 *
 * @param {string} text of JSON
 */
export const unpacked = (text) => (text.includes('{"said":') ? JSON.parse(text, said) : JSON.parse(text));

/** @param {string} _ @param {any} value */
const said = (_, value) => (typeof value?.said?.[language] === "string" ? value.said[language] : value);
