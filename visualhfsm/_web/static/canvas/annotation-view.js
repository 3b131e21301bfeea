/**
 * Notes and frames in the drawing, below states and transitions. They are made, written and resized in annotations.js,
 * which is loaded when somebody does.
 *
 * @import {Annotation} from "../protocol.js"
 * @import {Box, Point} from "./geometry.js"
 */

import {t} from "../texts.js";
import {areaOf, colorOf, FARTHEST, isFrame, within} from "./areas.js";
import {make} from "./svg.js";
import {shortened, wrapped} from "./text.js";

const SIZE = 13; // of letters
const LINE = 18;
const PADDING = 10;
const TITLE_AT = 20; // the foot of a title, from the top of its frame
/** The height of the part of a frame that moves it, besides its border. */
const BAR = 30;

/** The notes and frames of a drawing. */
export class AnnotationLayer {
  group = make("g", {class: "annotations"});
  /** By keys such as `a1`. @type {Map<string, AnnotationView>} */
  views = new Map();
  /** @type {Annotation[] | undefined} */
  #shown;
  /** @type {Map<string, string> | undefined} */
  #marks;

  /**
   * Show annotations: the largest frames at the bottom, notes above all frames.
   *
   * @param {Annotation[]} annotations
   * @param {Map<string, string>} [marks] of a comparison, by key
   */
  update(annotations, marks) {
    if (annotations === this.#shown && marks === this.#marks && !this.#moved) return;
    [this.#shown, this.#marks, this.#moved] = [annotations, marks, false];
    const former = this.views;
    this.views = new Map();
    for (const annotation of annotations) {
      const key = `a${annotation.id}`;
      const view = former.get(key) ?? new AnnotationView();
      view.update(annotation, marks?.get(key) ?? "");
      this.views.set(key, view);
    }
    for (const [key, view] of former) if (!this.views.has(key)) view.group.remove();
    const piled = [...this.views.values()].sort((one, other) => other.depth - one.depth);
    piled.forEach(({group}, index) => {
      const there = this.group.children[index];
      if (there !== group) this.group.insertBefore(group, there ?? null);
    });
  }

  #moved = false;

  /** Forget all, as when another automaton is shown. */
  clear() {
    this.#shown = undefined;
    this.views.clear();
    this.group.replaceChildren();
  }

  /** Show one elsewhere while it is dragged. @param {string} key @param {Point} corner */
  preview(key, corner) {
    this.#moved = true;
    this.views.get(key)?.place(corner);
  }

  /** Write those that are in sight; the others have no text yet. @param {Box} seen */
  look(seen) {
    for (const view of this.views.values()) view.look(seen);
  }

  /** @param {Set<number>} ids */
  select(ids) {
    for (const view of this.views.values()) view.select(ids.has(view.annotation.id));
  }

  /** The areas of all. @returns {Box[]} */
  boxes() {
    return [...this.views.values()].map(({box}) => box);
  }
}

/** One note or frame. */
export class AnnotationView {
  paper = make("rect", {class: "paper"});
  /** The part of a frame besides its border that can be grabbed. */
  bar = make("rect", {class: "bar"});
  text = make("text", {"aria-hidden": "true"});
  /** Cuts off what is larger than the annotation, as titles of frames that are seen from far away. */
  room = make("svg", {}, this.text);
  group = make("g", {role: "button", tabindex: "-1"}, this.paper, this.bar, this.room);
  selected = false;
  words = "";
  /** @type {Annotation} */
  // @ts-expect-error - `update` follows at once
  annotation = undefined;
  /** @type {Box} */
  box = {left: 0, top: 0, right: 0, bottom: 0};
  #mark = "";
  #isWritten = false;

  /** The text beside the pointer: all of it, where it does not fit. */
  get tip() {
    return this.annotation.text.trim();
  }

  /** Its height in the pile, the highest first. */
  get depth() {
    const {left, right, top, bottom} = this.box;
    return isFrame(this.annotation) ? (right - left) * (bottom - top) : -1;
  }

  /** @param {Annotation} annotation @param {string} mark */
  update(annotation, mark) {
    const isSame = annotation === this.annotation && mark === this.#mark;
    this.annotation = annotation;
    this.#mark = mark;
    this.place(annotation);
    if (isSame) return;
    this.group.dataset.key = `a${annotation.id}`;
    this.#classify();
    this.words = isFrame(annotation)
      ? t("Frame {title}", {title: annotation.text})
      : t("Note: {text}", {text: annotation.text});
    if (mark) this.words += `, ${mark}`;
    this.group.setAttribute("aria-label", this.words);
    this.resize(areaOf(annotation));
  }

  /** Show it with other edges, also while they are dragged. @param {Box} box */
  resize(box) {
    this.place({x: box.left, y: box.top});
    const [width, height] = [box.right - box.left, box.bottom - box.top];
    this.box = box;
    for (const each of [this.paper, this.room]) {
      each.setAttribute("width", String(width));
      each.setAttribute("height", String(height));
    }
    this.paper.setAttribute("rx", isFrame(this.annotation) ? "10" : "5");
    this.bar.setAttribute("width", String(width));
    this.bar.setAttribute("height", String(Math.min(BAR, height)));
    if (this.#isWritten) this.#write();
  }

  /** @param {Point} corner */
  place({x, y}) {
    const {left, top, right, bottom} = this.box;
    [x, y] = [within(x, -FARTHEST), within(y, -FARTHEST)];
    this.box = {left: x, top: y, right: x + right - left, bottom: y + bottom - top};
    this.group.setAttribute("transform", `translate(${x},${y})`);
  }

  /** @param {Box} seen */
  look({left, top, right, bottom}) {
    const {box} = this;
    if (this.#isWritten || box.left > right || box.right < left || box.top > bottom || box.bottom < top) return;
    this.#isWritten = true;
    this.#write();
  }

  /** @param {boolean} selected */
  select(selected) {
    if (selected === this.selected) return;
    this.selected = selected;
    this.#classify();
  }

  #classify() {
    const {annotation, selected} = this;
    const kinds = ["annotation", isFrame(annotation) ? "frame" : "note", colorOf(annotation)];
    if (this.#mark) kinds.push(`is-${this.#mark}`);
    if (selected) kinds.push("selected");
    this.group.setAttribute("class", kinds.join(" "));
    this.group.setAttribute("aria-pressed", String(selected));
  }

  #write() {
    const {annotation, box, text} = this;
    const room = box.right - box.left - 2 * PADDING;
    if (isFrame(annotation)) {
      const title = annotation.text.replace(/\s+/g, " ").trim();
      text.replaceChildren(shortened(title, SIZE, room, 600));
      text.setAttribute("x", String(PADDING));
      text.setAttribute("y", String(TITLE_AT));
      return;
    }
    let lines = wrapped(annotation.text, SIZE, room);
    const fitting = Math.max(1, Math.floor((box.bottom - box.top - 2 * PADDING + LINE - SIZE) / LINE));
    if (lines.length > fitting)
      lines = [...lines.slice(0, fitting - 1), shortened(`${lines[fitting - 1]} …`, SIZE, room)];
    text.replaceChildren(
      ...lines.map((line, index) => {
        const span = make("tspan", {x: PADDING, y: PADDING + SIZE + index * LINE});
        span.textContent = line;
        return span;
      }),
    );
  }
}
