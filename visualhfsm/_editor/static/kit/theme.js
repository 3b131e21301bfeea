/** Light or dark: as the system, unless the user has chosen; always as the system if that forces its colors. */

import {browserStorage} from "./storage.js";

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
