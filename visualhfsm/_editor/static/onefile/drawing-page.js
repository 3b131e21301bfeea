/**
 * A drawing in one file, without a server: the views of the editor show the document from visualhfsm/_drawing/page.py,
 * and change nothing.
 *
 * @import {Fields} from "../data/messages.js"
 * @import {Automaton} from "../data/protocol.js"
 * @typedef {{name: string, document: Fields & {automata: Automaton[]}, imported: Automaton[]}} Content
 */

import {html, nothing, render} from "lit";

import "../shell/actions.js";
import {HfsmCanvas} from "../canvas/canvas.js";
import "./selected-code.js";
import "../shell/tree.js";
import {iconButton} from "../kit/icons.js";
import {messageOf} from "../kit/notices.js";
import {page} from "../data/page.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {currentTheme, initTheme, switchTheme} from "../kit/theme.js";
import {unpackedData} from "./unpacked.js";

const TAB = 1;

/** @param {Content} content */
function layout({name, document: {description}}, /** @type {HfsmCanvas} */ canvas) {
  const theme = () => {
    switchTheme();
    canvas.minimap.draw();
  };
  return html`<div class="run-page drawing-page">
    <header>
      <h1>${name}</h1>
      <p>${description || nothing}</p>
      ${iconButton("up", t("To the automaton above"), () => page.up(), {disabled: page.path.length < 2})}
      ${iconButton("minus", t("Zoom out"), () => canvas.viewport.zoom(0.8))}
      ${iconButton("add", t("Zoom in"), () => canvas.viewport.zoom(1.25))}
      ${iconButton("fit", t("Show everything"), () => canvas.fit())}
      ${iconButton(currentTheme() === "dark" ? "sun" : "moon", t("Light or dark"), theme)}
    </header>
    <nav class="left" aria-label=${t("Tree of automata")}><hfsm-tree></hfsm-tree></nav>
    <main>${canvas}</main>
    <aside aria-label=${t("Code")}><hfsm-selected-code></hfsm-selected-code></aside>
  </div>`;
}

async function show() {
  /** @type {Content} */
  const content = JSON.parse(await unpackedData());
  const {name, document: full, imported} = content;
  const named = {tab: TAB, title: name, component: name, path: "", recording: name, task: false};
  store.show({answer: () => null, frames: {}}, [
    {push: "workspace", tabs: [{...named, dirty: false, outside: "", changed: false}], recoverable: [], present: []},
    {push: "document", tab: TAB, revision: 0, undo: [], redo: [], dirty: false, full},
  ]);
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

initTheme();
show().catch((error) => {
  document.body.textContent = t("This page cannot be shown: {reason}. It needs a browser of 2023 or later.", {
    reason: messageOf(error),
  });
});
