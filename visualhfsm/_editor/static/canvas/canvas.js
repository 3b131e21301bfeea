/**
 * The canvas: shows the automaton of the page and lets it be drawn.
 *
 * @import {Automaton, Commands, FieldsOf} from "../data/protocol.js"
 * @import {Annotating} from "./annotations.js"
 * @import {Comparison} from "./comparison.js"
 * @import {Box, Point} from "../measures/geometry.js"
 * @import {Live} from "./live-marks.js"
 * @import {DrawingTool} from "./tools.js"
 * @typedef {"state" | "transition" | "annotation"} Kind of what is drawn
 */

import {applyHere, selectAdded} from "../data/commands.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {keyOf} from "../kit/keys.js";
import {isImporting} from "../data/outline.js";
import {render, html, nothing} from "lit";
import {notify} from "../kit/notices.js";
import {offers} from "../kit/buttons.js";
import {importLink} from "../data/import-link.js";
import {page} from "../data/page.js";
import {errorBelow, problemOf} from "../data/problems.js";
import {store} from "../data/store.js";
import {rich, t} from "../kit/texts.js";
import {boxOf, contains, distance, RADIUS, wider} from "../measures/geometry.js";
import {Order} from "./order.js";
import {Pointer} from "./pointer.js";
import {Drawing} from "./drawing.js";
import {make} from "./svg.js";
import {FAR, FIT_LARGEST, NAMELESS, TINY, VERY_FAR, Viewport} from "./viewport.js";

const REST = 300; // ms
const MANY = 300; // states of one automaton
/** For these canvas.css makes handles larger, the farther away. */
const FINGERS = matchMedia("(pointer: coarse)");
const FIRST_ACTS = {newState: t("Draw a state"), shelf: t("Take one from the shelf"), example: t("Open an example")};

export class HfsmCanvas extends HTMLElement {
  drawing = new Drawing();
  viewport = new Viewport(
    () => this.#size,
    () => this.#transform(),
  );
  sketch = make("g", {class: "sketch"});
  /** The drawing, at its own scale: the browser zooms it without a new layout. */
  svg = make("svg", {role: "none"}, ...this.drawing.layers, this.sketch);
  /** The element that receives the pointer and the focus, as large as the canvas. */
  surface = division("surface");
  /** The text beside the pointer. */
  tip = make("title");
  /** The text for screen readers. */
  speech = division("for-readers");
  hint = division("hint");
  empty = division("empty");
  outside = document.createElement("button");
  /** What edits names in place, once the canvas had the focus. @type {import("./rename.js").Rename | undefined} */
  rename = undefined;
  order = new Order(this);
  pointer = new Pointer(this);
  /** The state to which a transition is about to lead. @type {SVGElement | undefined} */
  target = undefined;
  /** Whether it had the focus before another automaton was shown. */
  hadFocus = false;
  /** The tool in use, see tools.js. @type {DrawingTool | undefined} */
  tool = undefined;
  /** A comparison with another version, see comparison.js. @type {Comparison | undefined} */
  comparison = undefined;

  #size = {width: 0, height: 0};
  #corner = {x: 0, y: 0}; // of the canvas in the window
  #window = ""; // its size
  /** The middle of the view of each automaton that was shown. @type {Map<string, Point & {scale: number}>} */
  #views = new Map();
  #shown = "";
  #unfitted = false;
  /** The view in which everything was shown: unless the user changes it, everything stays visible. */
  #fitted = "";
  /** The scale of that view, to which it returns when there is room again. */
  #wanted = 1;
  /** The selection that the user is led to: until the user chooses another view, it stays legible. */
  #sought = "";
  /** @type {Map<string, Live> | undefined} */
  #live;

  /** Whether changes are refused: in a comparison, of a recorded document, and of content of another file. */
  get readOnly() {
    return Boolean(this.comparison || page.automaton?.imported) || store.isRecorded(page.tab);
  }

  connectedCallback() {
    if (this.contains(this.surface)) return;
    this.speech.setAttribute("aria-live", "polite");
    this.hint.hidden = true;
    for (const [name, value] of Object.entries({role: "application", "aria-roledescription": "canvas", tabindex: "-1"}))
      this.surface.setAttribute(name, value);
    this.surface.append(this.svg);
    Object.assign(this.outside, {className: "outside", type: "button", hidden: true});
    this.outside.textContent = t("Everything is outside: show it ({key})", {key: keyOf("fit")});
    this.outside.addEventListener("click", () => this.fit());
    this.append(this.surface, this.empty, this.outside, this.hint, this.speech);
    if (!this.readOnly) this.surface.addEventListener("focus", () => this.#renaming(), {once: true});
    new ResizeObserver(() => this.#resized()).observe(this);
    for (const kind of /** @type {const} */ (["document", "problems"])) {
      store.addEventListener(kind, ({detail}) => detail.tab === page.tab && this.pointer.whenFree(() => this.redraw()));
    }
    for (const kind of /** @type {const} */ (["tab", "automaton"])) page.addEventListener(kind, () => this.redraw());
    page.addEventListener("selection", () => this.#showSelection());
    page.addEventListener("reveal", ({detail}) => {
      this.#sought = detail?.legible ? this.#selected : "";
      this.#reveal();
    });
    page.addEventListener("say", ({detail}) => this.announce(detail));
    page.addEventListener("alert", ({detail}) => this.announce(detail, "assertive"));
    this.redraw();
  }

  /** Draw the document as it is now. */
  redraw() {
    const automaton = page.automaton;
    const key = automaton ? `${page.tab}/${automaton.id}` : "";
    const other = key !== this.#shown;
    if (other) this.#leave();
    const {comparison} = this;
    const shown = automaton && comparison ? comparison.merged(automaton) : automaton;
    const marks = automaton && comparison?.marks(automaton);
    this.drawing.update(shown, {
      imported: (state) => isImporting(page.shownDocument, state),
      problem: problemIn(automaton),
      marks,
    });
    this.#shown = key;
    this.surface.setAttribute(
      "aria-label",
      automaton ? t("Automaton {name}", {name: page.title()}) : t("No automaton"),
    );
    this.#showEmpty(automaton);
    if (other) this.#arrive(key);
    else this.#look();
    if (other && automaton && automaton.states.length > MANY)
      notify(
        t("More than {most} states in one automaton are slow, and hard to read: group some below a state.", {
          most: MANY,
        }),
      );
    this.drawing.select(page.states, page.transitions, page.annotations);
    this.drawing.showLive(this.#live);
    this.order.keep();
    this.rename?.follow();
    this.#offerEdges();
    if (other && this.hadFocus) this.focusSelected();
    this.#lookOutside();
  }

  /** Show what a running component does in the shown automaton. @param {Map<string, Live>} [live] */
  showLive(live) {
    this.#live = live;
    this.drawing.showLive(live);
  }

  /** The position of a pointer in the drawing. @param {Pick<MouseEvent, "clientX" | "clientY">} event */
  point({clientX, clientY}) {
    const {left, top} = this.getBoundingClientRect();
    return this.viewport.toDrawing(clientX - left, clientY - top);
  }

  /** The state at a point, or undefined; the rim counts. @param {Point} point */
  stateAt(point) {
    return page.automaton?.states.findLast((state) => distance(state, point) <= RADIUS + 6);
  }

  /** Show everything, as soon as the canvas has a size. */
  fit() {
    this.#sought = "";
    this.#fit();
  }

  #fit() {
    this.#unfitted = !this.#size.width;
    this.svg.style.visibility = this.#unfitted ? "hidden" : "";
    if (this.#unfitted)
      this.viewport.zoom(0); // little is drawn until then
    else this.#fitDrawn();
    this.#wanted = this.viewport.scale;
    this.#fitted = this.#view();
  }

  /** Fit what is drawn at the scale that this results in: labels that are too small to be drawn need no room. */
  #fitDrawn() {
    const {drawing, viewport} = this;
    let [scale, largest] = [1, FIT_LARGEST];
    for (const limit of [FAR, VERY_FAR]) {
      if (viewport.scaleFor(drawing.bounds(scale)) >= limit) break;
      scale = largest = limit * 0.999;
    }
    viewport.fit(drawing.bounds(scale), largest);
    if (!this.#isWhole()) viewport.fit(drawing.bounds(viewport.scale), viewport.scale); // letters have grown
  }

  /** Whether everything is in the window. */
  #isWhole() {
    return this.#size.width > 0 && contains(this.viewport.free, this.drawing.bounds(this.viewport.scale));
  }

  /** Show the selection, or everything if nothing is selected. */
  fitSelection() {
    const {annotations, places} = this.drawing;
    const points = this.selectedKeys().flatMap((key) => {
      const box = annotations.views.get(key)?.box;
      return box
        ? [
            {x: box.left, y: box.top},
            {x: box.right, y: box.bottom},
          ]
        : (places.get(key) ?? []);
    });
    if (!points.length) return this.fit();
    return this.viewport.fit(wider(boxOf(points), 2 * RADIUS));
  }

  /** Show each automaton whole when it is shown next. */
  forgetViews() {
    this.#views.clear();
  }

  selectedKeys() {
    return [
      ...[...page.states].map((id) => `s${id}`),
      ...[...page.transitions].map((id) => `t${id}`),
      ...[...page.annotations].map((id) => `a${id}`),
    ];
  }

  /** Use a tool of tools.js, or none. @param {(new (canvas: HfsmCanvas) => DrawingTool) | undefined} Tool */
  useTool(Tool) {
    this.tool?.cancel();
    this.tool = Tool && page.automaton && !this.readOnly ? new Tool(this) : undefined;
    this.classList.toggle("placing", Boolean(this.tool));
    this.showHint(this.tool?.hint);
    this.#showEmpty(page.automaton);
    if (this.tool) this.surface.focus({preventScroll: true});
    this.dispatchEvent(new Event("tool"));
  }

  showHint(text = "") {
    if (text && text !== this.hint.textContent) this.announce(text);
    this.hint.textContent = text;
    this.hint.hidden = !text;
  }

  /** Announce a text to screen readers, at once if it is "assertive". @param {string} text */
  announce(text, urgency = "polite") {
    this.speech.setAttribute("aria-live", urgency);
    this.speech.textContent = text;
  }

  /** Mark the state to which a transition is about to lead. @param {number} [id] */
  markTarget(id) {
    this.target?.classList.remove("target");
    this.target = id === undefined ? undefined : this.drawing.find(`s${id}`)?.group;
    this.target?.classList.add("target");
  }

  /** Start to edit a name, or the text of an annotation, in place. @param {Kind} kind @param {number} id */
  async beginRename(kind, id) {
    if (this.readOnly) return;
    if (kind === "annotation") await holdKeys(async () => (await this.#annotating()).write(id));
    else if (this.rename) this.rename.begin(kind, id);
    else await holdKeys(async () => (await this.#renaming()).begin(kind, id));
  }

  async #renaming() {
    const {Rename} = await import("./rename.js");
    if (!this.rename) this.append((this.rename = new Rename(this)).input);
    return this.rename;
  }

  /** What edits notes and frames in place, once it was needed. @type {Promise<Annotating> | undefined} */
  #loading = undefined;
  /** @type {Annotating | undefined} */
  annotating = undefined;

  #annotating() {
    this.#loading ??= import("./annotations.js").then((module) => (this.annotating = new module.Annotating(this)));
    return this.#loading;
  }

  /** Offer to drag the edges of the selected annotation. */
  #offerEdges() {
    if (page.annotation && !this.readOnly) this.#annotating().then((annotating) => annotating.follow());
    else this.annotating?.follow();
  }

  /**
   * Add an element to the shown automaton by a command, select it, and edit its name; keys pressed meanwhile go into
   * the name.
   *
   * @template {keyof Commands} Name
   * @param {Kind} kind @param {Name} command @param {FieldsOf<Omit<Commands[Name], "automaton">>} fields
   * @returns {Promise<number | undefined>} its id
   */
  add(kind, command, ...fields) {
    const done = applyHere(command, ...fields);
    return holdKeys(async () => {
      const id = selectAdded(await done, `${kind}s`);
      if (id !== undefined) await this.beginRename(kind, id);
      return id;
    });
  }

  /** Cancel the current gesture or tool; return whether there was one. */
  cancel() {
    const wasDragging = this.pointer.cancel();
    const wasDrawing = Boolean(this.tool);
    if (wasDrawing) this.useTool(undefined);
    return wasDragging || wasDrawing;
  }

  /** Focus the selection, or else the first state. */
  focusSelected() {
    this.order.focusSelected();
  }

  /** The first of what is selected, in the shown automaton. */
  get #selected() {
    return `${this.#shown} ${this.selectedKeys()[0]}`;
  }

  /** Show the selection. */
  #reveal() {
    const place = this.drawing.places.get(this.selectedKeys()[0]);
    if (place) this.viewport.reveal(place, {legible: this.#sought === this.#selected});
  }

  /** Show everything after the window has changed, or what the user was led to. */
  #fitAgain() {
    this.#fit();
    if (this.#sought === this.#selected) this.#reveal();
  }

  #showSelection() {
    this.drawing.select(page.states, page.transitions, page.annotations);
    this.order.keep();
    this.#offerEdges();
  }

  #leave() {
    this.cancel();
    this.rename?.cancel();
    this.annotating?.commit();
    this.drawing.automaton = undefined; // another document may have an automaton of the same number
    if (this.#fitted === this.#view())
      this.#views.delete(this.#shown); // fitted again: panels may have opened or closed
    else if (this.#shown) this.#views.set(this.#shown, {...this.viewport.middle, scale: this.viewport.scale});
    this.order.forget();
    this.hadFocus = this.contains(document.activeElement);
  }

  /** @param {string} key */
  #arrive(key) {
    const known = this.#views.get(key);
    if (known) {
      this.viewport.scale = known.scale;
      this.viewport.center(known);
    } else {
      this.#fit();
    }
  }

  /** @param {Automaton | undefined} automaton */
  #showEmpty(automaton) {
    const isEmpty = automaton && !automaton.states.length && !automaton.annotations.length;
    this.empty.hidden = !isEmpty || Boolean(this.tool);
    if (!automaton || this.empty.hidden) return;
    const {imported} = automaton;
    const {context} = /** @type {import("../shell/app.js").HfsmApp | null} */ (this.closest("hfsm-app")) ?? {};
    render(
      imported
        ? html`<p>
            ${rich("This automaton comes from {file}. Open that file to change it.", {file: importLink(imported.file)})}
          </p>`
        : html`<p>${t("Nothing here yet.")}</p>
            ${context && !this.readOnly ? offers(FIRST_ACTS, context) : nothing}`,
      this.empty,
    );
  }

  #transform() {
    const {x, y, scale} = this.viewport;
    this.svg.style.transform = `translate(${x.toFixed(2)}px, ${y.toFixed(2)}px) scale(${scale.toFixed(6)})`;
    this.classList.toggle("far", scale < FAR);
    this.classList.toggle("very-far", scale < VERY_FAR);
    this.classList.toggle("nameless", scale < NAMELESS);
    this.classList.toggle("tiny", scale < TINY);
    this.#look();
    this.rename?.follow();
    this.annotating?.follow();
    this.#lookOutside();
    this.dispatchEvent(new Event("view"));
  }

  #resting = 0;

  /** Once the view rests, show the hint if everything is outside. */
  #lookOutside() {
    clearTimeout(this.#resting);
    this.#resting = setTimeout(() => {
      const places = [...this.drawing.places.values()];
      const {seen} = this.viewport;
      // Not in each frame: the browser would look at the style of everything.
      if (FINGERS.matches) this.style.setProperty("--scale", this.viewport.scale.toFixed(2));
      this.outside.hidden = !this.#size.width || !places.length || places.some((place) => isNear(place, seen));
    }, REST);
  }

  /** Write what is read at this scale, once the size of the canvas is known. */
  #look() {
    if (this.#size.width) this.drawing.look(this.viewport.scale);
  }

  #view() {
    const {x, y, scale} = this.viewport;
    return [x, y, scale].join();
  }

  /** A panel or a bar beside it moves nothing and changes no scale unless some of what was whole would be hidden. */
  #resized() {
    const {x, y, width} = this.getBoundingClientRect();
    const {x: left, y: top} = this.#corner;
    if (width) this.#corner = {x, y};
    const former = this.#window;
    this.#window = `${innerWidth} ${innerHeight}`;
    const isNew = this.#unfitted || former !== this.#window;
    const fitted = this.#unfitted || this.#fitted === this.#view();
    const whole = fitted || this.#isWhole();
    this.#size = {width: this.clientWidth, height: this.clientHeight};
    if (!width) return;
    if (fitted && isNew) {
      this.#fitAgain();
      return;
    }
    const {viewport, drawing} = this;
    viewport.pan(left - x, top - y);
    const scale = fitted ? this.#wanted : viewport.scale;
    const box = drawing.bounds(viewport.scale);
    if (box && whole && (viewport.scale < scale || !this.#isWhole())) viewport.refit(box, scale);
    if (fitted) this.#fitted = this.#view();
    if (!fitted || this.#sought === this.#selected) this.#reveal(); // a panel that opens for a state does not cover it
  }
}

/** Whether a place is in a box, or the circle around it touches it. @param {Point} place @param {Box} box */
const isNear = ({x, y}, {left, top, right, bottom}) =>
  x > left - RADIUS && x < right + RADIUS && y > top - RADIUS && y < bottom + RADIUS;

/**
 * Find the worst problem of a state or transition; of a state also an error in the automata below it.
 *
 * @param {Automaton | undefined} automaton
 * @returns {import("./drawing.js").More["problem"]}
 */
const problemIn = (automaton) => (kind, id) => {
  if (!automaton) return undefined;
  const own = problemOf(page.shownDocument.problems, automaton.id, kind, id);
  return own?.severity === "error" || kind !== "state"
    ? own
    : (errorBelow(page.shownDocument, automaton.id, id) ?? own);
};

/** @param {string} name */
function division(name) {
  const made = document.createElement("div");
  made.className = name;
  return made;
}

customElements.define("hfsm-canvas", HfsmCanvas);
