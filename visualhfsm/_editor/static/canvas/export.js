/**
 * Self-contained pictures of automata: every style is written into the SVG.
 *
 * @import {Automaton, State} from "../data/protocol.js"
 */

import {isImporting} from "../data/outline.js";
import {page} from "../data/page.js";
import {required} from "../kit/existence.js";
import {t} from "../kit/texts.js";
import {Drawing} from "./drawing.js";
import {make} from "./svg.js";

const MARGIN = 24;
const PIXELS = 2; // of a PNG per pixel of the drawing
const MOST_PIXELS = 8000; // in one direction, which browsers can still draw
/** The styles of a picture, as attributes, and the attributes that only the page needs. */
const PRESENTED =
  "fill fill-opacity stroke stroke-width stroke-opacity stroke-dasharray stroke-linecap stroke-linejoin paint-order " +
  "opacity font-size font-weight text-anchor";
const OF_THE_PAGE = "class tabindex role aria-label aria-pressed aria-hidden data-key data-angle";

/**
 * The picture of an automaton as an SVG element with its own styles.
 *
 * @param {Automaton} automaton @param {"light" | "dark"} colors
 * @param {(state: State) => string} [href] where a state leads; without it, nowhere
 * @returns {SVGSVGElement}
 */
export function picture(automaton, colors = "light", href) {
  const drawing = new Drawing();
  const live = make("svg", {class: "for-readers"}, ...drawing.layers);
  const {theme} = document.documentElement.dataset;
  document.documentElement.dataset.theme = colors;
  document.body.append(live);
  try {
    drawing.update(automaton, {imported: (state) => isImporting(page.shownDocument, state), problem: () => undefined});
    drawing.annotations.look();
    const box = drawing.bounds() ?? {left: 0, top: 0, right: 200, bottom: 100};
    const [width, height] = [
      Math.ceil(box.right - box.left + 2 * MARGIN),
      Math.ceil(box.bottom - box.top + 2 * MARGIN),
    ];
    const [left, top] = [Math.floor(box.left - MARGIN), Math.floor(box.top - MARGIN)];
    const made = make("svg", {
      viewBox: `${left} ${top} ${width} ${height}`,
      width,
      height,
      "font-family": "Inter, system-ui, 'DejaVu Sans', Arial, sans-serif",
    });
    const title = make("title");
    title.textContent = page.title(automaton);
    const links = new Map(href && automaton.states.map((state) => [`s${state.id}`, href(state)]));
    const layers = drawing.layers.map((each) => styled(each, links));
    made.append(title, make("rect", {x: left, y: top, width, height, fill: "#ffffff"}), ...layers);
    return made;
  } finally {
    live.remove();
    document.documentElement.dataset.theme = theme;
  }
}

/**
 * A copy of an element with its computed styles as attributes, without invisible parts.
 *
 * @param {Element} element @param {Map<string, string>} links by the keys of elements
 * @returns {Element}
 */
function styled(element, links) {
  const style = getComputedStyle(element);
  const copy = /** @type {Element} */ (element.cloneNode(false));
  for (const name of OF_THE_PAGE.split(" ")) copy.removeAttribute(name);
  if (element.childElementCount === 0 || element.tagName === "text") {
    for (const name of PRESENTED.split(" ")) {
      const value = style.getPropertyValue(name);
      if (
        value &&
        !(value === "none" && name === "stroke-dasharray") &&
        !(value === "normal" && name === "paint-order")
      )
        copy.setAttribute(name, value);
    }
  }
  for (const child of element.childNodes) {
    if (child instanceof Text) copy.append(child.data);
    else if (child instanceof Element && !isHidden(child)) copy.append(styled(child, links));
  }
  const href = links.get(element.getAttribute("data-key") ?? "");
  return href ? make("a", {href}, copy) : copy;
}

/** @param {Element} element */
function isHidden(element) {
  if (["hit", "rim", "grip", "bar"].some((name) => element.classList.contains(name))) return true;
  const {display, fill, stroke} = getComputedStyle(element);
  return display === "none" || (["path", "circle"].includes(element.tagName) && fill === "none" && stroke === "none");
}

/** The text of an SVG file. @param {Automaton} automaton */
export const svgText = (automaton) =>
  `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(picture(automaton))}\n`;

/** A PNG of an automaton. @returns {Promise<Blob>} @param {Automaton} automaton */
export async function pngOf(automaton) {
  const url = URL.createObjectURL(new Blob([svgText(automaton)], {type: "image/svg+xml"}));
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    const scale = Math.min(PIXELS, MOST_PIXELS / Math.max(image.width, image.height));
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [Math.ceil(image.width * scale), Math.ceil(image.height * scale)];
    required(canvas.getContext("2d"), "canvas").drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise((resolve, reject) =>
      canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error(t("The picture is too large.")))), "image/png"),
    );
  } finally {
    URL.revokeObjectURL(url);
  }
}

/** Download a file. @param {string} name @param {Blob} blob */
export function download(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
