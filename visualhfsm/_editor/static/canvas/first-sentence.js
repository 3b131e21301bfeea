/** What a newcomer may do first, in one sentence on the drawing; gone for good after the first edit in this browser. */

import {html, render} from "lit";

import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {browserStorage} from "../kit/location.js";
import {rich, visible} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";

const EDITED = "visualhfsm.edited";
const FINGERS = matchMedia("(pointer: coarse)");

/** @param {import("./canvas.js").HfsmCanvas} canvas */
export function invite(canvas) {
  if (viewing.on || browserStorage.getItem(EDITED)) return;
  const note = document.createElement("p");
  note.className = "invitation";
  canvas.append(note);
  const stop = new AbortController();
  const draw = () => {
    const words = sentence();
    note.hidden = !words;
    if (words) render(words, note);
    if (![...store.documents.values()].some(({undo}) => undo.length)) return;
    browserStorage.setItem(EDITED, "yes");
    note.remove();
    stop.abort();
  };
  store.addEventListener("document", draw, {signal: stop.signal});
  page.addEventListener("change", draw, {signal: stop.signal});
  draw();
}

/** The sentence for the shown automaton; undefined where nothing can be changed. */
function sentence() {
  const {automaton} = page;
  if (!automaton || automaton.imported || store.isRecorded(page.tab)) return undefined;
  const states = automaton.states.toSorted((one, other) => Number(other.initial) - Number(one.initial));
  const state = states.find(({code, children}) => code.trim() && !children.length) ?? states.find(({name}) => name);
  if (!state) return undefined;
  const words = {title: html`<b>${visible(page.title())}</b>`, state: html`<b>${visible(state.name)}</b>`};
  if (state.children.length)
    return FINGERS.matches
      ? rich("This is {title}. Tap {state} twice to see what is inside.", words)
      : rich("This is {title}. Double-click {state} to see what is inside.", words);
  return FINGERS.matches
    ? rich("This is {title}. Tap {state} twice to change it.", words)
    : rich("This is {title}. Double-click {state} to change it.", words);
}
