/**
 * A drawing in one file, without a server: the views of the editor show the document from visualhfsm/_drawing/page.py,
 * and change nothing.
 *
 * @import {Automaton, Fields} from "../data/protocol.js"
 * @typedef {{name: string, document: Fields & {automata: Automaton[]}, imported: Automaton[]}} Content
 */

import {html, nothing, render} from "lit";

import "../shell/actions.js";
import {HfsmCanvas} from "../canvas/canvas.js";
import "./selected-code.js";
import "../shell/tree.js";
import {iconButton} from "../kit/icons.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {begin, pushes, TAB, themeButton} from "./frame.js";
import {unpackedData} from "./unpacked.js";

/** @param {Content} content */
function layout({name, document: {description}}, /** @type {HfsmCanvas} */ canvas) {
  return html`<div class="run-page drawing-page">
    <header>
      <h1>${name}</h1>
      <p>${description || nothing}</p>
      ${iconButton("up", t("To the automaton above"), () => page.up(), {disabled: page.path.length < 2})}
      ${iconButton("minus", t("Zoom out"), () => canvas.viewport.zoom(0.8))}
      ${iconButton("add", t("Zoom in"), () => canvas.viewport.zoom(1.25))}
      ${iconButton("fit", t("Show everything"), () => canvas.fit())} ${themeButton()}
    </header>
    <nav class="left" aria-label=${t("Tree of automata")}><hfsm-tree></hfsm-tree></nav>
    <main>${canvas}</main>
    <aside aria-label=${t("Code")}><hfsm-selected-code></hfsm-selected-code></aside>
  </div>`;
}

async function show() {
  /** @type {Content} */
  const content = JSON.parse(await unpackedData());
  const {name, imported} = content;
  store.show({answer: () => null, frames: {}}, pushes(name, name, content.document));
  if (imported.length) store.showContent(TAB, imported);
  page.show(TAB);
  const canvas = new HfsmCanvas();
  const draw = () => render(layout(content, canvas), document.body);
  draw();
  page.addEventListener("change", draw);
  document.addEventListener("keydown", (event) => press(event, canvas));
}

/** The keys of the canvas that change nothing. @param {KeyboardEvent} event @param {HfsmCanvas} canvas */
function press({key, altKey, ctrlKey, metaKey, target}, canvas) {
  if (ctrlKey || metaKey || !(target instanceof Node)) return;
  const inDrawing = canvas.contains(target) || target === document.body;
  /** @type {Record<string, [number, number]>} */
  const ways = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  if (key === "Backspace") page.up();
  else if (key === "Enter" && inDrawing && page.state?.children.length) page.open(page.state.children[0]);
  else if (inDrawing && key in ways) canvas.order.goTo(ways[key]);
  else if (inDrawing && (key === "." || key === ",")) canvas.order.goOn(key === "." ? 1 : -1);
  else if (!altKey && key === "f") canvas.fit();
  else if (!altKey && (key === "+" || key === "=")) canvas.viewport.zoom(1.25);
  else if (!altKey && key === "-") canvas.viewport.zoom(0.8);
}

begin(show);
