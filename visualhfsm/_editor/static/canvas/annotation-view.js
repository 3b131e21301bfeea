/**
 * Notes and frames in the drawing, below states and transitions. They are made, written and resized in annotations.js,
 * which is loaded when somebody does.
 *
 * @import {Annotation} from "../data/protocol.js"
 * @import {Box, Point} from "../measures/geometry.js"
 */

import {t} from "../kit/texts.js";
import {fitTitle, LINE, linesOf, occupied, PADDING, SIZE, titleSize} from "../measures/annotation-text.js";
import {areaOf, colorOf, FARTHEST, grown, isFrame, within} from "../measures/areas.js";
import {lettersAt} from "./viewport.js";
import {make} from "./svg.js";

const BAR = 10; // pixels of the part of a frame that moves it besides its border, below the foot of its title
const NARROW = 3; // sizes of letters; a frame that is not wider has no room for a title
const OFFSET = 4; // pixels of the sign of the focus, around the annotation

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
   * @returns {boolean} whether any looks different, or is elsewhere
   */
  update(annotations, marks) {
    if (annotations === this.#shown && marks === this.#marks && !this.#moved) return false;
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
    return true;
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

  /**
   * Write all as it is read at a scale.
   *
   * @param {number} scale
   * @param {(box: Box) => Box[]} [inTheWay] what else is in a part of the drawing, which titles do not cover
   */
  look(scale = 1, inTheWay = () => []) {
    const size = titleSize(scale);
    for (const view of this.views.values()) {
      if (isFrame(view.annotation)) view.title(size, inTheWay);
      else view.write(Math.max(SIZE, lettersAt(scale)));
    }
  }

  /** Fit the titles of frames once more: what was in their way has moved. */
  refit() {
    for (const view of this.views.values()) view.wanted = 0;
  }

  /** Where no other words should be. @returns {Box[]} */
  occupied() {
    return [...this.views.values()].flatMap(({annotation, box}) => occupied(annotation.text, box, isFrame(annotation)));
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
  /** Cuts off what is larger than the annotation, such as a letter that is higher than a low frame. */
  room = make("svg", {}, this.text);
  /** The sign of the focus, unlike that of the selection. */
  ring = make("rect", {class: "focus-ring", x: -OFFSET, y: -OFFSET});
  group = make("g", {role: "button", tabindex: "-1"}, this.ring, this.paper, this.bar, this.room);
  selected = false;
  words = "";
  /** @type {Annotation} */
  // @ts-expect-error - `update` follows at once
  annotation = undefined;
  /** @type {Box} */
  box = {left: 0, top: 0, right: 0, bottom: 0};
  /** The size of letters for which its title was fitted last. */
  wanted = 0;
  #mark = "";

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

  /**
   * Show it with other edges, also while they are dragged or it is written: a note is always high enough for its text.
   *
   * @param {Box} edges @param {string} [text]
   */
  resize(edges, text) {
    this.place({x: edges.left, y: edges.top});
    const box = (this.box = grown(this.annotation, edges, text));
    const [width, height] = [box.right - box.left, box.bottom - box.top];
    const corner = isFrame(this.annotation) ? 10 : 5;
    for (const [each, more] of /** @type {[SVGElement, number][]} */ ([
      [this.paper, 0],
      [this.room, 0],
      [this.ring, OFFSET],
    ])) {
      each.setAttribute("width", String(width + 2 * more));
      each.setAttribute("height", String(height + 2 * more));
      if (each !== this.room) each.setAttribute("rx", String(corner + more));
    }
    this.bar.setAttribute("width", String(width));
    if (this.wanted) this.#write();
  }

  /** @param {Point} corner */
  place({x, y}) {
    const {left, top, right, bottom} = this.box;
    [x, y] = [within(x, -FARTHEST), within(y, -FARTHEST)];
    this.box = {left: x, top: y, right: x + right - left, bottom: y + bottom - top};
    this.group.setAttribute("transform", `translate(${x},${y})`);
  }

  /** Write the text of a note. @param {number} letters their size */
  write(letters) {
    if (this.wanted === letters) return;
    this.wanted = letters;
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
    const size = this.wanted || SIZE;
    if (isFrame(annotation)) {
      this.wanted = 0;
      this.title(size);
      return;
    }
    let end = 0;
    text.setAttribute("font-size", String(size));
    text.replaceChildren(
      ...linesOf(annotation.text, box, size).map((line, index) => {
        const span = make("tspan", {x: PADDING, y: PADDING + size + (index * LINE * size) / SIZE});
        end = annotation.text.indexOf(line, end) + line.length;
        // The last word of a line and the first one of the next are two words, as in the label.
        span.textContent = /\s/.test(annotation.text.charAt(end)) ? `${line} ` : line;
        return span;
      }),
    );
  }

  /**
   * Write the title of a frame in letters of a size, or as large as there is room.
   *
   * @param {number} wanted @param {(box: Box) => Box[]} [inTheWay]
   */
  title(wanted, inTheWay = undefined) {
    const {annotation, box, text} = this;
    if (wanted === this.wanted) return;
    this.wanted = wanted;
    const {line, size, foot} = fitTitle(annotation.text, box, wanted, inTheWay);
    text.replaceChildren(box.right - box.left < NARROW * wanted ? "" : line);
    text.setAttribute("x", String(PADDING));
    text.setAttribute("y", foot.toFixed(1));
    text.setAttribute("font-size", size.toFixed(2));
    this.bar.setAttribute("height", String(Math.min(foot + BAR, box.bottom - box.top)));
  }
}
