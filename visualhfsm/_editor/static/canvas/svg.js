/** Create SVG quickly: templates are parsed once and cloned. */

import {required} from "../kit/existence.js";

const NAMESPACE = "http://www.w3.org/2000/svg";

/** Parse the content of an SVG; returns a function that makes a copy of its first element. @param {string} text */
export function template(text) {
  const parsed = new DOMParser().parseFromString(`<svg xmlns="${NAMESPACE}">${text}</svg>`, "image/svg+xml");
  const element = document.importNode(required(parsed.documentElement.firstElementChild, "element in it"), true);
  return () => /** @type {SVGElement} */ (element.cloneNode(true));
}

/**
 * Make an element with attributes.
 *
 * @template {keyof SVGElementTagNameMap} Name
 * @param {Name} name @param {Record<string, string | number>} attributes @param {...Node} children
 * @returns {SVGElementTagNameMap[Name]}
 */
export function make(name, attributes = {}, ...children) {
  const element = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.append(...children);
  return element;
}

/**
 * Set an attribute, or remove it when there is no value.
 *
 * @param {Element} element @param {string} name @param {unknown} value
 */
export function set(element, name, value) {
  if (value === undefined || value === null || value === false) element.removeAttribute(name);
  else element.setAttribute(name, String(value));
}
