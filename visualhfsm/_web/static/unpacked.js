/** The data of a page that is one file, from visualhfsm/_html_file.py. */

import {required} from "./required.js";

/** The data as text. */
export async function unpackedData() {
  const packed = atob(required(document.getElementById("data"), "data").textContent ?? "");
  const bytes = Uint8Array.from(packed, (each) => each.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}
