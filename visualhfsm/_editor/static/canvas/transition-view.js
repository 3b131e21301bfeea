/**
 * One transition in the drawing: its arc, its handle and its name.
 *
 * @import {Problem, Transition} from "../data/protocol.js"
 * @import {Arc, Point} from "../measures/geometry.js"
 * @typedef {{from: string, to: string, rank: number, problem?: Problem, mark?: string}} More `rank` is its place among
 *   the transitions out of its state, 0 when it is the only one
 */

import {sameProblem} from "../data/problems.js";
import {spokenTime, t, uncoded, visible} from "../kit/texts.js";
import {arc} from "../measures/geometry.js";
import {ElementView} from "./element-view.js";
import {TRIGGERS, UNKNOWN_TRIGGER} from "./glyphs.js";
import {beside, HANDLE} from "./labels.js";
import {transitionClasses} from "./live-marks.js";
import {set, template} from "./svg.js";
import {shortened, width} from "../measures/text.js";

const blank = template(`
  <g class="transition" role="button" tabindex="-1">
    <path class="hit"/><path class="glow"/><path class="line"/><path class="head"/>
    <g class="handle"><circle class="grip" r="${HANDLE + 4}"/><circle class="knob" r="${HANDLE}"/><path class="glyph"/>
    <circle class="timer" r="${HANDLE + 2.5}" pathLength="1"/><circle class="mark" cx="7" cy="-7" r="4"/>
    <circle class="focus-ring" r="${HANDLE + 8}"/></g>
  </g>`);
/** The name is separate: all names are above all arcs, and screen readers read the label of the group. */
const blankLabel = template(
  `<g class="label"><text class="rank"/><text><tspan class="title"/><tspan class="detail"/></text></g>`,
);
const NAME = 12;
const DETAIL = 10.5;
const LINE = 13.5;
/** Pixels of a line, where there is room and where there is not. */
const WIDTHS = [400, 260, 150];

/** The arc of a transition that was not placed yet. @type {Arc} */
const NOWHERE = arc(undefined, undefined, {x: 0, y: 0});

/**
 * The lines of a label, the size of the letters of its name, and its size in pixels; that of its name alone, too.
 *
 * @typedef {{name: string, detail: string, size: number, width: number, height: number, nameWidth: number}} Text
 */

/** @type {Text} */
const NO_TEXT = {name: "", detail: "", size: NAME, width: 0, height: 0, nameWidth: 0};

export class TransitionView extends ElementView {
  arc = NOWHERE;
  /** The middle of its name, once it has a place. @type {Point | undefined} */
  nameAt = undefined;
  /** The same relative to the handle, with which it moves. @type {Point | undefined} */
  offset = undefined;
  /** The present text of its label, and the others that it may have. @type {Text} */
  text = NO_TEXT;
  /** @type {Text[]} */
  #texts = [NO_TEXT];

  /** @param {Transition} transition */
  constructor(transition) {
    const [group, label] = [blank(), blankLabel()];
    super(group, label);
    this.parts = partsOf(group, label);
    this.transition = transition;
  }

  #signature = "";
  /** @type {Partial<More>} */
  #more = {};

  /**
   * Show a transition as it is now; returns whether it looks different.
   *
   * @param {Transition} transition @param {More} more
   */
  update(transition, more) {
    const {from, to, rank, problem, mark = ""} = more;
    const former = this.#more;
    if (
      transition === this.transition &&
      from === former.from &&
      to === former.to &&
      rank === former.rank &&
      more.mark === former.mark &&
      sameProblem(problem, former.problem)
    )
      return false;
    this.transition = transition;
    this.#more = more;
    const {id, name, type, trigger, guard} = transition;
    const hasCode = Boolean(transition.code.trim());
    const signature = JSON.stringify([
      id,
      name,
      type,
      trigger,
      guard,
      hasCode,
      from,
      to,
      rank,
      mark,
      problem?.severity,
      problem && uncoded(problem.message),
    ]);
    if (signature === this.#signature) return false;
    this.#signature = signature;
    this.#write();
    return true;
  }

  get classes() {
    const {type, code} = this.transition;
    const kinds = ["transition", `by-${type}`, code.trim() && "has-code"];
    return this.classesOf(kinds, this.#more, this.live ? transitionClasses(this.live) : {});
  }

  #write() {
    const {label, glyph, rank: number} = this.parts;
    const {from = "", to = "", rank = 0} = this.#more;
    const {id, name, type, trigger, guard, code} = this.transition;
    const kind = TRIGGERS[type] ?? UNKNOWN_TRIGGER;
    const what = t("Transition {name} from {from} to {to}", {name: name || t("without a name"), from, to});
    const tip = [
      `${visible(name)}: ${kind.word}`,
      trigger.trim(),
      guard.trim() && t("if {guard}", {guard: guard.trim()}),
      code.trim() && t("code runs when it fires"),
    ];
    label.dataset.key = `t${id}`;
    this.tell(`t${id}`, this.classes, [what, kind.word, rank && t("number {rank}", {rank})], tip, this.#more);
    set(glyph, "d", kind.path);
    glyph.classList.toggle("filled", kind.filled);
    number.textContent = rank ? String(rank) : "";
    this.#writeLabel();
    this.#placeHandle();
  }

  /** Write its name in letters of a size at least; it is then to be placed. @param {number} letters */
  scaleLetters(letters) {
    this.letters = letters;
    this.#writeLabel();
  }

  #writeLabel() {
    this.#texts = textsOf(visible(this.transition.name.trim()), whatFires(this.transition), this.letters);
    this.#show(this.#texts[this.#texts.length - 1]);
  }

  /** @param {Text} text */
  #show(text) {
    if (text === this.text) return;
    this.text = text;
    const {nameSpan, detailSpan} = this.parts;
    nameSpan.textContent = text.name;
    detailSpan.textContent = text.detail;
    nameSpan.style.fontSize = text.size > NAME ? `${text.size}px` : "";
  }

  #drawArc() {
    const {hit, glow, line, head} = this.parts;
    const {arc: drawn} = this;
    for (const each of [hit, glow, line]) each.setAttribute("d", drawn.path);
    head.setAttribute("d", drawn.head);
    this.#placeHandle();
  }

  #placeHandle() {
    const {handle, rank} = this.parts;
    const {middle, first} = this.arc;
    handle.setAttribute("transform", `translate(${middle.x},${middle.y})`);
    if (!rank.textContent) return;
    rank.setAttribute("x", first.x.toFixed(1));
    rank.setAttribute("y", (first.y + 3.5).toFixed(1));
  }

  /** @type {{from?: Point, to?: Point, handle?: Point, isLoop?: boolean}} */
  #placed = {};

  /**
   * Draw the arc between two points through a handle; returns whether anything differs from before.
   *
   * @param {Point | undefined} from @param {Point | undefined} to @param {Point} handle @param {boolean} isLoop
   */
  place(from, to, handle, isLoop) {
    if (this.#carried) {
      this.#carried = undefined;
      this.#shift();
    }
    const former = this.#placed;
    const stays = samePlace(from, former.from) && samePlace(to, former.to) && samePlace(handle, former.handle);
    if (stays && isLoop === former.isLoop) return false;
    this.#placed = {from, to, handle, isLoop};
    this.arc = arc(from, to, handle, isLoop);
    this.#drawArc();
    return true;
  }

  /** How far from its place it is shown. @type {Point | undefined} */
  #carried = undefined;

  /** Show it elsewhere, otherwise unchanged. @param {number} dx @param {number} dy */
  carry(dx, dy) {
    this.#carried = {x: dx, y: dy};
    this.#shift();
  }

  #shift() {
    const {x = 0, y = 0} = this.#carried ?? {};
    for (const each of [this.group, this.label])
      if (each) set(each, "transform", this.#carried && `translate(${x},${y})`);
  }

  /** The name as a label for `placeLabels`. */
  asLabel() {
    return {key: this, handle: this.arc.middle, normal: this.arc.normal, sizes: this.#texts};
  }

  /**
   * Put the name beside the handle, with its middle at a point, by default at the best place without other names.
   *
   * @param {Point} [middle]
   * @param {Text} [text] one of its texts
   */
  placeName(middle, text = this.text) {
    this.#show(text);
    middle ??= beside({handle: this.arc.middle, ...text}, this.arc.normal);
    const {nameSpan, detailSpan} = this.parts;
    const [x, y] = [middle.x.toFixed(1), middle.y];
    const top = y - text.height / 2 + text.size - 1;
    nameSpan.setAttribute("x", x);
    nameSpan.setAttribute("y", top.toFixed(1));
    detailSpan.setAttribute("x", x);
    detailSpan.setAttribute("y", (top + (text.name ? LINE : 0)).toFixed(1));
    this.offset = {x: middle.x - this.arc.middle.x, y: middle.y - this.arc.middle.y};
    this.nameAt = middle;
  }
}

/** @param {Point} [one] @param {Point} [other] */
const samePlace = (one, other) => one === other || (one?.x === other?.x && one?.y === other?.y);

/** The parts of an arc with its handle, and of a label. @param {SVGElement} group @param {SVGElement} label */
function partsOf(group, label) {
  const [hit, glow, line, head, handle] = group.children;
  const [, , glyph, timer] = handle.children;
  const [rank, text] = label.children;
  const [nameSpan, detailSpan] = text.children;
  return {
    hit,
    glow,
    line,
    head,
    handle: /** @type {SVGElement} */ (handle),
    glyph,
    timer,
    label,
    rank,
    nameSpan: /** @type {SVGElement} */ (nameSpan),
    detailSpan,
  };
}

/**
 * The texts of a label, the longest first.
 *
 * @param {string} fullName @param {string} fullDetail
 * @param {number} letters the smallest readable ones
 */
function textsOf(fullName, fullDetail, letters) {
  const size = Math.max(NAME, letters);
  if (letters > DETAIL) fullDetail = ""; // it is not readable, and hidden
  /** @type {Text[]} */
  const texts = [];
  for (const widest of WIDTHS) {
    const name = shortened(fullName, size, widest);
    const detail = shortened(fullDetail, DETAIL, widest);
    const lines = Number(Boolean(name)) + Number(Boolean(detail));
    const nameWidth = name && width(name, size) + 6;
    const wide = lines ? Math.max(nameWidth || 0, width(detail, DETAIL) + 6) : 0;
    const height = lines * LINE + 2 + size - NAME;
    const text = {name, detail, size, width: wide, height, nameWidth: nameWidth || 0};
    const former = texts[texts.length - 1];
    if (former?.name === name && former.detail === detail) continue;
    texts.push(text);
  }
  return texts;
}

/** The trigger of a transition in a few words. @param {Transition} transition */
function whatFires({type, trigger, guard}) {
  const text = trigger.trim().split("\n")[0];
  const first =
    type === "time"
      ? spokenTime(trigger) || t("no time")
      : type === "event"
        ? text || t("no event")
        : type === "condition"
          ? text
          : "";
  const if_ = guard.trim().split("\n")[0];
  return [first, if_ && `[${if_}]`].filter(Boolean).join(" ");
}
