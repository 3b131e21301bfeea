/** Light or dark: as the system, unless the user has chosen; always as the system if that forces its colors. */

import {browserStorage} from "./location.js";

const KEY = "visualhfsm.theme";
const system = matchMedia("(prefers-color-scheme: dark)");
const forced = matchMedia("(forced-colors: active)");

/** @returns {"light" | "dark"} */
export function currentTheme() {
  return document.documentElement.dataset.theme === "dark" ? "dark" : "light";
}

function show() {
  const chosen = forced.matches ? null : browserStorage.getItem(KEY);
  document.documentElement.dataset.theme = chosen ?? (system.matches ? "dark" : "light");
  dispatchEvent(new Event("theme"));
}

export function initTheme() {
  system.addEventListener("change", show);
  forced.addEventListener("change", show);
  show();
}

export function switchTheme() {
  browserStorage.setItem(KEY, currentTheme() === "dark" ? "light" : "dark");
  show();
}

/** Style sheets that nothing in the first picture needs: they are loaded after it. */
const LATER = ["dialogs", "print", "panels", "run", "shelf", "tests"];

/** @type {Promise<unknown> | undefined} */
let loading;

/** Load them, once; resolves when they are there, or cannot be loaded. */
export const laterStyles = () =>
  (loading ??= Promise.all(
    LATER.map((name) =>
      addStyles(new URL(`../styles/${name}.css`, import.meta.url), name === "print" ? "print" : "all"),
    ),
  ));

/** Load a style sheet; resolves when it is there, or cannot be loaded. @param {URL} url @param {string} [media] */
export const addStyles = (url, media = "all") =>
  new Promise((resolve) => {
    const link = document.createElement("link");
    link.rel = "stylesheet";
    link.href = url.href;
    link.media = media;
    link.onload = link.onerror = resolve;
    // The last of several equal rules counts, and those of the monitor come later.
    const next = document.querySelector('link[href$="/styles/monitor.css"]');
    if (next) next.before(link);
    else document.head.append(link);
  });
