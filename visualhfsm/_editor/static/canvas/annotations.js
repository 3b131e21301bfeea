/**
 * Make notes and frames, write on them, and drag their edges.
 *
 * @import {HfsmCanvas} from "./canvas.js"
 * @import {Annotation} from "../data/protocol.js"
 * @import {AnnotationView} from "./annotation-view.js"
 * @import {Box, Point} from "../measures/geometry.js"
 */

import {applyHere} from "../data/commands.js";
import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {LINE, neededHeight, PADDING, SIZE} from "../measures/annotation-text.js";
import {areaOf, grown, isFrame, SMALLEST} from "../measures/areas.js";
import {make} from "./svg.js";
import {wrapped} from "../measures/text.js";
import {freePlace, PlacingTool} from "./tools.js";

const TOUCH = 24; // pixels of the window around an edge that is dragged
const GRIP = 8; // pixels of the window of its sign
const LEGIBLE = 12; // pixels of the window of the letters that are written
const BORDER = 4; // pixels of the field's borders, left and right or above and below
const FIELD = {width: 120, height: 34}; // its least size
const FRAME = {width: 360, height: 260};
const NOTE = {width: 200, height: 96};
const AROUND = {side: 34, top: 54, bottom: 34}; // pixels between a frame and the states in it

/** Where each edge is: from the left and from the top, as parts of the size. @type {Record<string, [number, number]>} */
const EDGES = {nw: [0, 0], n: [0.5, 0], ne: [1, 0], e: [1, 0.5], se: [1, 1], s: [0.5, 1], sw: [0, 1], w: [0, 0.5]};

/** Edits the selected annotation on the canvas. */
export class Annotating {
  /** The annotation that is written, and its text before. @type {{id: number, text: string} | undefined} */
  #written;
  #field = document.createElement("textarea");
  #edges = make("g", {class: "edges"});
  /** Where the edges are while one is dragged. @type {Box | undefined} */
  #dragged;

  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    const field = this.#field;
    Object.assign(field, {className: "note-field", hidden: true, spellcheck: true, maxLength: 100_000});
    field.addEventListener("keydown", (event) => this.#key(event));
    field.addEventListener("blur", () => this.commit());
    field.addEventListener("input", () => this.#grow());
    canvas.append(field);
    canvas.svg.append(this.#edges);
  }

  /** The view of an annotation, unless it was deleted. @param {number} [id] @returns {AnnotationView | undefined} */
  #view(id) {
    return this.canvas.drawing.annotations.views.get(`a${id}`);
  }

  /** Write on an annotation; returns its field, undefined if it was deleted. @param {number} id */
  async write(id) {
    this.commit();
    const view = this.#view(id);
    if (!view) return undefined;
    const field = this.#field;
    const {text} = view.annotation;
    this.#written = {id, text};
    field.value = text;
    field.setAttribute("aria-label", isFrame(view.annotation) ? t("Title of the frame") : t("Text of the note"));
    field.className = `note-field ${view.group.getAttribute("class")}`;
    field.hidden = false;
    view.group.classList.add("written");
    const {left, top} = view.box;
    this.canvas.viewport.reveal({x: left, y: top});
    this.follow();
    field.focus({preventScroll: true});
    field.select();
    return field;
  }

  /** Keep what was written. */
  commit() {
    const written = this.#written;
    if (!written) return;
    this.#written = undefined;
    this.#view(written.id)?.group.classList.remove("written");
    this.#field.hidden = true;
    const text = this.#field.value;
    if (text !== written.text) applyHere("setAnnotationText", {annotation: written.id, text});
    const view = this.#view(written.id);
    view?.resize(areaOf(view.annotation)); // until the answer, and after a refusal
  }

  /** A note grows while it is written. */
  #grow() {
    const view = this.#view(this.#written?.id);
    view?.resize(areaOf({...view.annotation, text: ""}), this.#field.value);
    this.follow();
  }

  /** Keep field and edges at the annotation while the drawing moves. */
  follow() {
    this.#followField();
    this.#followEdges();
  }

  #followField() {
    if (!this.#written) return;
    const view = this.#view(this.#written.id);
    if (!view) {
      this.#written = undefined; // it was deleted, as in another window
      this.#field.hidden = true;
      return;
    }
    view.group.classList.add("written"); // after a change of another window
    const {left, top, right, bottom} = view.box;
    const {viewport} = this.canvas;
    const start = viewport.toWindow({x: left, y: top});
    const {scale} = viewport;
    const {style} = this.#field;
    const size = Math.max(LEGIBLE, SIZE * scale);
    const part = size / SIZE;
    const wide = Math.max(FIELD.width, (right - left) * scale);
    const least = Math.max(FIELD.height, isFrame(view.annotation) ? LINE * part : (bottom - top) * scale);
    const lines = isFrame(view.annotation) ? 0 : wrapped(this.#field.value, size, wide - 2 * PADDING * part).length;
    const padding = PADDING * part - BORDER / 2;
    style.left = `${start.x}px`;
    style.top = `${start.y}px`;
    style.width = `${wide}px`;
    // Letters that stay legible need more room than there is in a note that is seen from far away.
    style.height = `${Math.max(least, lines * LINE * part + 2 * padding + BORDER)}px`;
    style.padding = `${padding - (LINE - SIZE) * part * 0.5}px ${padding}px`;
    style.fontSize = `${size}px`;
  }

  #followEdges() {
    const annotation = this.canvas.readOnly ? undefined : page.annotation;
    const view = this.#view(annotation?.id);
    if (!annotation || !view) {
      this.#edges.replaceChildren();
      return;
    }
    const {left, top, right, bottom} = this.#dragged ?? view.box;
    const {scale} = this.canvas.viewport;
    if (!this.#edges.childElementCount)
      for (const edge of Object.keys(EDGES))
        this.#edges.append(
          make("g", {class: "edge", "data-edge": edge}, make("rect", {class: "touch"}), make("rect", {class: "sign"})),
        );
    for (const each of /** @type {Iterable<SVGElement>} */ (this.#edges.children)) {
      const {edge = ""} = each.dataset;
      const [x, y] = EDGES[edge];
      each.setAttribute("transform", `translate(${left + (right - left) * x},${top + (bottom - top) * y})`);
      each.style.cursor = `${edge}-resize`;
      for (const [index, size] of [TOUCH, GRIP].entries()) {
        const part = /** @type {SVGElement} */ (each.children[index]);
        part.dataset.key = `a${annotation.id}`;
        part.dataset.edge = edge;
        for (const name of ["x", "y"]) part.setAttribute(name, String(-size / 2 / scale));
        for (const name of ["width", "height"]) part.setAttribute(name, String(size / scale));
        part.setAttribute("stroke-width", String(1.5 / scale));
      }
    }
  }

  /** Drag an edge of the selected annotation. @param {PointerEvent} event @param {string} edge */
  grab(event, edge) {
    const {annotation} = page;
    const view = this.#view(annotation?.id);
    if (!annotation || !view) return undefined;
    const start = this.canvas.point(event);
    const former = areaOf(annotation);
    let box = former;
    /** @param {Box | undefined} shown */
    const show = (shown) => {
      this.#dragged = shown;
      this.#view(annotation.id)?.resize(shown ?? former);
      this.#followEdges();
    };
    return {
      scrolls: true,
      move: (/** @type {PointerEvent} */ now) => {
        const point = this.canvas.point(now);
        show((box = dragged(annotation, edge, Math.round(point.x - start.x), Math.round(point.y - start.y))));
      },
      end: async () => {
        if (box !== former) await resize(annotation, edge, box);
        this.#dragged = undefined;
        this.canvas.redraw(); // even after a refusal, to move everything back
        this.#view(annotation.id)?.resize(areaOf(page.annotation ?? annotation));
        this.#followEdges();
      },
      cancel: () => show(undefined),
    };
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const {key, ctrlKey, metaKey} = event;
    const view = this.#view(this.#written?.id);
    const ends = key === "Escape" || (key === "Enter" && (ctrlKey || metaKey || (view && isFrame(view.annotation))));
    // The browser's undo would go on in other fields once nothing is left to undo in this one.
    if ((ctrlKey || metaKey) && /^[zy]$/i.test(key)) {
      event.preventDefault();
      if (key === "z" && this.#written) this.#field.value = this.#written.text;
    }
    event.stopPropagation();
    if (!ends) return;
    event.preventDefault();
    this.commit();
    this.canvas.focusSelected();
  }
}

/**
 * The area of an annotation after one of its edges was dragged by some pixels. What is written on it keeps its room.
 *
 * @param {Annotation} annotation @param {string} edge @param {number} dx @param {number} dy
 * @returns {Box}
 */
function dragged(annotation, edge, dx, dy) {
  const box = areaOf(annotation);
  const left = edge.includes("w") ? Math.min(box.left + dx, box.right - SMALLEST) : box.left;
  const right = edge.includes("e") ? Math.max(box.right + dx, box.left + SMALLEST) : box.right;
  const least = isFrame(annotation) ? SMALLEST : Math.max(SMALLEST, neededHeight(annotation.text, right - left));
  const top = edge.includes("n") ? Math.min(box.top + dy, box.bottom - least) : box.top;
  // Where its height is not dragged, a note keeps its own one, so that it gets lower when it gets wider.
  const own = edge.includes("s") ? box.bottom + dy : edge.includes("n") ? box.bottom : top + annotation.height;
  return grown(annotation, {left, right, top, bottom: Math.max(own, top + SMALLEST)});
}

/** @param {Annotation} annotation @param {string} edge that was dragged @param {Box} box @returns {Promise<unknown>} */
function resize({id, height}, edge, {left, top, right, bottom}) {
  const high = /[ns]/.test(edge) ? bottom - top : height;
  return applyHere("resizeAnnotation", {annotation: id, x: left, y: top, width: right - left, height: high});
}

/** Make the selected annotation wider and higher by some pixels. @param {number} dx @param {number} dy */
export async function grow(dx, dy) {
  const {annotation} = page;
  const edge = `${dy ? "s" : ""}${dx ? "e" : ""}`;
  if (annotation) await resize(annotation, edge, dragged(annotation, edge, dx, dy));
}

/** Draw a frame around the selection, and write its title. @param {HfsmCanvas} canvas */
export function frameSelection(canvas) {
  const {drawing} = canvas;
  const {states, annotations} = page;
  const points = [...states].flatMap((id) => drawing.places.get(`s${id}`) ?? []);
  const boxes = [
    ...points.map(({x, y}) => ({left: x - 40, right: x + 40, top: y - 40, bottom: y + 40})),
    ...[...annotations].flatMap((id) => drawing.annotations.views.get(`a${id}`)?.box ?? []),
  ];
  const left = Math.min(...boxes.map((box) => box.left)) - AROUND.side;
  const top = Math.min(...boxes.map((box) => box.top)) - AROUND.top;
  const right = Math.max(...boxes.map((box) => box.right)) + AROUND.side;
  const bottom = Math.max(...boxes.map((box) => box.bottom)) + AROUND.bottom;
  const size = {width: Math.round(right - left), height: Math.round(bottom - top)};
  return canvas.add("annotation", "addAnnotation", {kind: "frame", x: Math.round(left), y: Math.round(top), ...size});
}

/** Add a note with a text, where there is room. @param {HfsmCanvas} canvas @param {string} text @param {Point} [corner] */
export function writeNote(canvas, text, corner) {
  const {x, y} = freePlace(canvas, undefined, NOTE);
  const place = corner ?? {x: x - NOTE.width / 2, y: y - NOTE.height / 2};
  return applyHere("addAnnotation", {kind: "note", ...place, ...NOTE, text});
}

/** Place a note. */
export class NoteTool extends PlacingTool {
  kind = /** @type {"note" | "frame"} */ ("note");
  size = NOTE;
  hint = t("New note: click, or move it with the arrows and press Enter. Esc cancels.");

  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    super(canvas, make("rect", {class: "placed-annotation", rx: 5}));
    queueMicrotask(() => this.to(this.start())); // with the size of the tool's own kind
  }

  /** Where it is before it is moved. @returns {Point} */
  start() {
    return freePlace(this.canvas, undefined, this.size);
  }

  /** @param {Point} point @override */
  to(point) {
    super.to(point);
    for (const [name, value] of Object.entries(this.#area)) this.shape.setAttribute(name, String(value));
  }

  /** @override */
  put() {
    this.canvas.add("annotation", "addAnnotation", {kind: this.kind, ...this.#area});
  }

  get #area() {
    const {width, height} = this.size;
    return {x: Math.round(this.point.x - width / 2), y: Math.round(this.point.y - height / 2), width, height};
  }
}

/** Place a frame in the same way; states are drawn or moved into it. */
export class FrameTool extends NoteTool {
  kind = /** @type {"note" | "frame"} */ ("frame");
  size = FRAME;
  hint = t("New frame: click, or move it with the arrows and press Enter. Esc cancels.");

  /** Around what is there, too. @override */
  start() {
    return this.point;
  }
}
