/** The canvas: shows the automaton of the page and lets it be drawn. */

import * as commands from "../commands.js";
import {page} from "../page.js";
import {problemOf} from "../problems.js";
import {store} from "../store.js";
import {distance, RADIUS} from "./geometry.js";
import {Band, Link, Move, Pan, resetHandle} from "./gestures.js";
import {Minimap} from "./minimap.js";
import {Rename} from "./rename.js";
import {Scene} from "./scene.js";
import {make} from "./svg.js";
import {neighbor} from "./tools.js";
import {Viewport} from "./viewport.js";

const WHEEL = 600; // pixels of a wheel for a zoom by e
/** Below these scales ever less is drawn, see canvas.css. */
const FAR = 0.55;
const VERY_FAR = 0.28;
const TINY = 0.15;
const MOST_DETAILED = 1000; // transitions whose names are placed before it is known whether they are seen
const BORDER = 28; // pixels from the edge, where a drag makes the drawing move along

export class HfsmCanvas extends HTMLElement {
  scene = new Scene();
  viewport = new Viewport(() => this.#size, () => this.#transform());
  sketch = make("g", {class: "sketch"});
  tip = make("title");
  /** The tool in use, see tools.js. */
  tool = undefined;
  /** A comparison with another version, see comparison.js. */
  comparison = undefined;
  /** Whether changes are refused, as for another version of the document. */
  readOnly = false;

  #size = {width: 0, height: 0};
  #views = new Map(); // of each automaton that was seen: where and how large
  #shown = "";
  #gesture;
  #current = ""; // key of what has the place in the order of focus
  #unfitted = false;
  #pressed; // what the pointer was last pressed on
  #spaceHeld = false;
  #live;

  connectedCallback() {
    if (this.svg) return;
    this.world = make("g", {class: "world"}, ...this.scene.layers, this.sketch);
    this.svg = make("svg", {role: "application", "aria-roledescription": "canvas", tabindex: "-1"}, this.world);
    this.speech = document.createElement("div");
    this.speech.className = "for-readers";
    this.speech.setAttribute("aria-live", "polite");
    this.hint = document.createElement("div");
    this.hint.className = "hint";
    this.hint.hidden = true;
    this.empty = document.createElement("div");
    this.empty.className = "empty";
    this.minimap = new Minimap(this);
    this.rename = new Rename(this);
    this.append(this.svg, this.empty, this.hint, this.minimap.element, this.rename.input, this.speech);
    new ResizeObserver(() => this.#resized()).observe(this);
    this.#listen();
    for (const kind of ["document", "problems"]) {
      store.addEventListener(kind, (event) => event.detail.tab === page.tab && this.redraw());
    }
    for (const kind of ["tab", "automaton"]) page.addEventListener(kind, () => this.redraw());
    page.addEventListener("selection", () => this.#showSelection());
    page.addEventListener("reveal", () => this.#reveal());
    this.redraw();
  }

  /** Draw what the document holds now. */
  redraw() {
    const automaton = page.automaton;
    const key = automaton ? `${page.tab}/${automaton.id}` : "";
    const other = key !== this.#shown;
    if (other) this.#leave();
    if (other) this.scene.detailed = (automaton?.transitions.length ?? 0) < MOST_DETAILED;
    const {comparison} = this;
    const shown = automaton && comparison ? comparison.merged(automaton) : automaton;
    const marks = automaton && comparison?.marks(automaton);
    this.scene.update(shown, {imported: isImporting, problem: problemIn(automaton), marks});
    this.#shown = key;
    this.svg.setAttribute("aria-label", automaton ? `Automaton ${page.title()}` : "No automaton");
    this.#showEmpty(automaton);
    if (other) this.#arrive(key);
    this.scene.select(page.states, page.transitions);
    this.scene.showLive(this.#live);
    this.#keepFocusable();
    if (other && this.hadFocus) this.focusSelected();
    this.minimap.draw();
  }

  /** Show what a running component does in the shown automaton. @param {Map<string, import("./scene.js").Live>} [live] */
  showLive(live) {
    this.#live = live;
    this.scene.showLive(live);
  }

  /** Where a pointer is in the drawing. */
  point({clientX, clientY}) {
    const {left, top} = this.#box();
    return this.viewport.toDrawing(clientX - left, clientY - top);
  }

  /** The state at a point, or undefined; the rim counts. */
  stateAt(point) {
    return page.automaton?.states.findLast((state) => distance(state, point) <= RADIUS + 6);
  }

  /** Show everything; as soon as there is a place to show it in. */
  fit() {
    this.#unfitted = !this.#size.width;
    if (this.#unfitted) this.viewport.zoom(0); // little is drawn until then
    else this.viewport.fit(this.scene.bounds());
  }

  /** Show the selected things, and everything without. */
  fitSelection() {
    const places = this.selectedKeys().map((key) => this.scene.places.get(key)).filter(Boolean);
    if (!places.length) return this.fit();
    const [xs, ys] = [places.map(({x}) => x), places.map(({y}) => y)];
    const far = RADIUS * 2;
    return this.viewport.fit({left: Math.min(...xs) - far, right: Math.max(...xs) + far, top: Math.min(...ys) - far, bottom: Math.max(...ys) + far});
  }

  /** Show each automaton whole when it is shown next. */
  forgetViews() {
    this.#views.clear();
  }

  selectedKeys() {
    return [...[...page.states].map((id) => `s${id}`), ...[...page.transitions].map((id) => `t${id}`)];
  }

  /** Use a tool of tools.js, or none. */
  useTool(Tool) {
    this.tool?.cancel();
    this.tool = Tool && page.automaton && !this.readOnly ? new Tool(this) : undefined;
    this.classList.toggle("placing", Boolean(this.tool));
    this.showHint(this.tool?.hint);
    if (this.tool) this.svg.focus({preventScroll: true});
    this.dispatchEvent(new Event("tool"));
  }

  showHint(text = "") {
    this.hint.textContent = text;
    this.hint.hidden = !text;
    if (text) this.announce(text);
  }

  /** Let screen readers say something. */
  announce(text) {
    this.speech.textContent = text;
  }

  /** Mark the state to which a transition is about to lead. */
  markTarget(id) {
    this.target?.classList.remove("target");
    this.target = id === undefined ? undefined : this.scene.states.get(`s${id}`)?.group;
    this.target?.classList.add("target");
  }

  /** Let a name be typed where it stands. @param {"state" | "transition"} kind */
  beginRename(kind, id) {
    if (!this.readOnly) this.rename.begin(kind, id);
  }

  /** Let what is under way be, and say whether there was anything. */
  cancel() {
    const busy = this.tool ?? this.#gesture;
    this.#gesture?.cancel();
    this.#gesture = undefined;
    if (this.tool) this.useTool(undefined);
    return Boolean(busy);
  }

  /** Focus what is selected, or the first state. */
  focusSelected() {
    const key = this.selectedKeys()[0] ?? this.#current;
    (this.scene.view(key)?.group ?? this.svg).focus({preventScroll: true});
  }

  /** Select the nearest thing in a direction. @param {[number, number]} direction */
  goTo(direction) {
    const things = [...this.scene.places].map(([key, {x, y}]) => ({key, x, y}));
    const from = things.find(({key}) => key === (this.selectedKeys()[0] ?? this.#current));
    const next = from ? neighbor(things, from, direction) : things[0];
    if (next) this.#focusKey(next.key);
  }

  /** Select the next thing in the order of reading: each state, then the transitions out of it. */
  goOn(step) {
    const order = this.#order();
    if (!order.length) return;
    const index = order.indexOf(this.selectedKeys()[0] ?? this.#current);
    this.#focusKey(order[(index + step + order.length) % order.length]);
  }

  /** While something is dragged at the edge, the drawing moves along. */
  autoPan({clientX, clientY}) {
    const box = this.#box();
    const step = (before, after) => (before < BORDER ? 8 : after < BORDER ? -8 : 0);
    const dx = step(clientX - box.left, box.right - clientX);
    const dy = step(clientY - box.top, box.bottom - clientY);
    if (dx || dy) this.viewport.pan(dx, dy);
  }

  #box() {
    return this.getBoundingClientRect();
  }

  #focusKey(key) {
    this.#select(key, false);
    this.viewport.reveal(this.scene.places.get(key));
    this.scene.view(key).group.focus({preventScroll: true});
  }

  #select(key, add) {
    const id = Number(key.slice(1).replaceAll("'", ""));
    const kind = key.startsWith("s") ? "states" : "transitions";
    const chosen = add ? {states: new Set(page.states), transitions: new Set(page.transitions)} : {[kind]: new Set()};
    if (add && chosen[kind].has(id)) chosen[kind].delete(id);
    else chosen[kind].add(id);
    this.#current = key;
    page.select(chosen);
  }

  #order() {
    const {states = [], transitions = []} = page.automaton ?? {};
    const owned = new Set(states.map((each) => each.id));
    return [
      ...states.flatMap(({id}) => [`s${id}`, ...transitions.filter(({origin}) => origin === id).map((each) => `t${each.id}`)]),
      ...transitions.filter(({origin}) => !owned.has(origin)).map((each) => `t${each.id}`),
    ];
  }

  #reveal() {
    const place = this.scene.places.get(this.selectedKeys()[0]);
    if (place) this.viewport.reveal(place);
  }

  #showSelection() {
    this.scene.select(page.states, page.transitions);
    this.#keepFocusable();
    this.minimap.draw();
  }

  /** One thing of the drawing is reached by Tab. */
  #keepFocusable() {
    const key = this.selectedKeys().find((each) => this.scene.view(each)) ?? this.#current;
    const view = this.scene.view(key || "s") ?? this.scene.states.values().next().value;
    if (this.focusable !== view?.group) {
      this.focusable?.setAttribute("tabindex", "-1");
      view?.group.setAttribute("tabindex", "0");
    }
    const lost = this.focusable && !this.focusable.isConnected && document.activeElement === document.body;
    this.focusable = view?.group;
    if (lost && view) view.group.focus({preventScroll: true});
    if (view) this.#current = view.group.dataset.key;
  }

  #leave() {
    this.cancel();
    this.rename.cancel();
    if (this.#shown) this.#views.set(this.#shown, {x: this.viewport.x, y: this.viewport.y, scale: this.viewport.scale});
    this.#current = "";
    this.hadFocus = this.contains(document.activeElement);
  }

  #arrive(key) {
    const known = this.#views.get(key);
    if (known) {
      Object.assign(this.viewport, known);
      this.#transform();
    } else {
      this.fit();
    }
  }

  #showEmpty(automaton) {
    this.empty.hidden = !automaton || automaton.states.length > 0 || Boolean(this.tool);
    if (this.empty.hidden) return;
    this.empty.textContent = automaton.imported
      ? `This automaton comes from ${automaton.imported.file}. Open that file to change it.`
      : "Nothing here yet. Press S for the first state, or double click.";
  }

  #transform() {
    const {x, y, scale} = this.viewport;
    this.world.setAttribute("transform", `translate(${x.toFixed(2)},${y.toFixed(2)}) scale(${scale.toFixed(4)})`);
    this.classList.toggle("far", scale < FAR);
    this.classList.toggle("very-far", scale < VERY_FAR);
    this.classList.toggle("tiny", scale < TINY);
    this.scene.detailed = scale >= VERY_FAR;
    this.minimap?.frame();
    this.rename?.follow();
    this.dispatchEvent(new Event("view"));
  }

  #resized() {
    const before = this.#size;
    this.#size = {width: this.clientWidth, height: this.clientHeight};
    if (this.#unfitted && this.#size.width) {
      this.fit();
    } else if (before.width && this.#size.width) {
      this.viewport.pan((this.#size.width - before.width) / 2, (this.#size.height - before.height) / 2);
      this.#reveal(); // a panel that opens for a state does not cover it
    }
  }

  #listen() {
    this.svg.addEventListener("pointerdown", (event) => this.#down(event));
    this.svg.addEventListener("pointermove", (event) => (this.#gesture ?? this.tool)?.move(event));
    this.svg.addEventListener("pointerup", () => this.#up());
    this.svg.addEventListener("pointercancel", () => this.cancel());
    this.svg.addEventListener("dblclick", (event) => this.#doubleClick(event));
    this.svg.addEventListener("contextmenu", (event) => this.#menu(event));
    this.svg.addEventListener("wheel", (event) => this.#wheel(event), {passive: false});
    this.svg.addEventListener("pointerover", (event) => this.#showTip(event));
    this.svg.addEventListener("focusin", (event) => this.#focused(event));
    this.addEventListener("keydown", (event) => {
      if (event.key === " ") this.#spaceHeld = true;
      if (this.tool && !event.ctrlKey && !event.metaKey && event.target !== this.rename.input && this.tool.key(event)) {
        event.preventDefault();
        event.stopPropagation();
      }
    });
    this.addEventListener("keyup", (event) => event.key === " " && (this.#spaceHeld = false));
  }

  #down(event) {
    if (this.#gesture) return;
    this.rename.commit();
    this.#pressed = event.target;
    const group = event.target.closest?.("[data-key]");
    const grabbed = group ?? this.svg;
    if (event.button === 1 || (event.button === 0 && this.#spaceHeld)) {
      event.preventDefault();
      this.#gesture = new Pan(this, event);
    } else if (event.button !== 0) {
      return;
    } else if (this.tool) {
      event.preventDefault();
      this.tool.click(event);
      return;
    } else if (!group) {
      this.svg.focus({preventScroll: true});
      this.#gesture = new Band(this, event);
    } else {
      const {key} = group.dataset;
      const selected = this.selectedKeys().includes(key);
      if (event.target.classList.contains("rim") && !event.shiftKey && !this.readOnly) {
        this.#select(key, false);
        this.#gesture = new Link(this, Number(key.slice(1)));
      } else {
        if (!selected || event.shiftKey) this.#select(key, event.shiftKey);
        this.#gesture = this.readOnly ? undefined : new Move(this, event);
      }
    }
    // The group itself, or a double click would be told to the whole drawing.
    if (this.#gesture) grabbed.setPointerCapture(event.pointerId);
  }

  #up() {
    const gesture = this.#gesture;
    this.#gesture = undefined;
    gesture?.end();
  }

  #doubleClick(event) {
    const target = this.#pressed; // that of the event is what has captured the pointer
    const key = target.closest("[data-key]")?.dataset.key;
    if (!key) {
      if (!this.readOnly && page.automaton && !page.automaton.imported) this.#addAt(this.point(event));
      return;
    }
    const id = Number(key.slice(1).replaceAll("'", ""));
    if (target.closest(".label, .name")) this.beginRename(key.startsWith("s") ? "state" : "transition", id);
    else if (key.startsWith("t")) {
      if (target.closest(".handle") && !this.readOnly) resetHandle(id);
      else page.edit({kind: "transition", automaton: page.automaton.id, id, part: "trigger"});
    } else {
      const state = page.automaton.states.find((each) => each.id === id);
      if (state.children.length) page.open(state.children[0]);
      else page.edit({kind: "state", automaton: page.automaton.id, id, part: "code"});
    }
  }

  async #addAt(point) {
    const id = await commands.addState({x: Math.round(point.x), y: Math.round(point.y)});
    if (id !== undefined) this.beginRename("state", id);
  }

  #menu(event) {
    event.preventDefault();
    const key = event.target.closest?.("[data-key]")?.dataset.key;
    if (key && !this.selectedKeys().includes(key)) this.#select(key, false);
    else if (!key) page.select({});
    this.dispatchEvent(new CustomEvent("hfsm-menu", {bubbles: true, detail: {x: event.clientX, y: event.clientY, point: this.point(event)}}));
  }

  #wheel(event) {
    event.preventDefault();
    const unit = event.deltaMode === 1 ? 16 : 1;
    if (event.shiftKey) {
      this.viewport.pan(-(event.deltaX || event.deltaY) * unit, 0);
      return;
    }
    const {left, top} = this.#box();
    const factor = Math.exp((-event.deltaY * unit) / (event.ctrlKey ? WHEEL / 4 : WHEEL));
    this.viewport.zoom(factor, event.clientX - left, event.clientY - top);
  }

  /** Only what the pointer is on has a tip, or screen readers would say everything twice. */
  #showTip(event) {
    const group = event.target.closest?.("[data-key]");
    if (this.tip.parentNode === (group ?? null)) return;
    this.tip.remove();
    if (!group) return;
    this.tip.textContent = this.scene.view(group.dataset.key)?.tip ?? "";
    group.append(this.tip);
  }

  #focused(event) {
    const key = event.target.dataset?.key;
    if (!key) return;
    this.#current = key;
    if (!this.#gesture && !this.selectedKeys().includes(key)) this.#select(key, false);
  }
}

/** Whether any automaton of a state comes from another file. */
const isImporting = (state) => state.children.some((id) => page.document.automata.get(id)?.imported);

/** Finds the worst problem of a state or transition. */
const problemIn = (automaton) => (kind, id) => problemOf(page.document.problems, automaton.id, kind, id);

customElements.define("hfsm-canvas", HfsmCanvas);
