/** One transition in the drawing: its arc, its handle and its name. */

import {sameProblem} from "../problems.js";
import {arc} from "./geometry.js";
import {spokenTime, TRIGGERS, UNKNOWN_TRIGGER} from "./glyphs.js";
import {beside, HANDLE} from "./labels.js";
import {set, template} from "./svg.js";
import {shortened, width} from "./text.js";

const blank = template(`
  <g class="transition" role="button" tabindex="-1">
    <path class="hit"/><path class="glow"/><path class="line"/><path class="head"/>
  </g>`);
/** Its handle and its name are not seen from far away. */
const blankHandle = template(`
    <g class="handle"><circle class="grip" r="${HANDLE + 4}"/><circle class="knob" r="${HANDLE}"/><path class="glyph"/>
    <circle class="timer" r="${HANDLE + 2.5}" pathLength="1"/><circle class="mark" cx="7" cy="-7" r="4"/></g>`);
/** The name stands apart: all names are above all arcs, and screen readers hear the label of the group. */
const blankLabel = template(
  `<g class="label"><text class="rank"/><text><tspan class="title"/><tspan class="detail"/></text></g>`,
);
const NAME = 12;
const DETAIL = 10.5;
const WIDEST = 150;

/** @typedef {import("../store.js").Transition} Transition */

export class TransitionView {
  constructor() {
    this.group = blank();
    [this.hit, this.glow, this.line, this.head] = this.group.children;
    /** Whether it has its handle and its label. */
    this.complete = false;
  }

  #signature = "";
  #more = {};

  /**
   * Write what a transition is; does nothing when nothing that is drawn differs.
   *
   * @param {Transition} transition
   * @param {{from: string, to: string, rank: number, problem?: {severity: string, message: string}, mark?: string}}
   *   more `rank` is its place among those out of its state, 0 when it is the only one
   * @returns {boolean} whether anything differed
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
      problem?.message,
    ]);
    if (signature === this.#signature) return false;
    this.#signature = signature;
    const kind = TRIGGERS[type] ?? UNKNOWN_TRIGGER;
    this.group.dataset.key = `t${id}`;
    const kinds = [
      "transition",
      `by-${type}`,
      hasCode && "has-code",
      problem && `has-${problem.severity}`,
      mark && `is-${mark}`,
    ];
    this.group.setAttribute("class", kinds.filter(Boolean).join(" "));
    this.words = [
      `Transition ${name || "without a name"} from ${from} to ${to}`,
      kind.word,
      rank && `number ${rank}`,
      mark,
      problem && `${problem.severity}: ${problem.message}`,
    ]
      .filter(Boolean)
      .join(", ");
    this.group.setAttribute("aria-label", this.words);
    /** What is shown beside the pointer. */
    this.tip = [
      `${name}: ${kind.word}`,
      trigger.trim(),
      guard.trim() && `if ${guard.trim()}`,
      hasCode && "code runs when it fires",
      problem?.message,
    ]
      .filter(Boolean)
      .join("\n");
    if (this.complete) this.#write();
    return true;
  }

  /** Draw its handle and its label, too; the label is then to be placed. */
  finish() {
    if (this.complete) return;
    this.complete = true;
    this.handle = blankHandle();
    [, , this.glyph, this.timer] = this.handle.children;
    this.label = blankLabel();
    [this.rank] = this.label.children;
    [this.nameSpan, this.detailSpan] = this.label.lastElementChild.children;
    this.group.append(this.handle);
    this.label.classList.toggle("selected", this.group.classList.contains("selected"));
    this.#write();
    if (this.arc) this.#placeHandle();
  }

  /** Whether a part of its arc may be in a box. @param {import("./geometry.js").Box} box */
  isIn({left, right, top, bottom}) {
    const {box} = this.arc;
    return box.right > left && box.left < right && box.bottom > top && box.top < bottom;
  }

  #write() {
    const {id, name, type} = this.transition;
    const kind = TRIGGERS[type] ?? UNKNOWN_TRIGGER;
    this.label.dataset.key = `t${id}`;
    set(this.glyph, "d", kind.path);
    this.glyph.classList.toggle("filled", kind.filled);
    this.rank.textContent = this.#more.rank || "";
    this.shortName = shortened(name.trim(), NAME, WIDEST, 500);
    this.detail = shortened(whatFires(this.transition), DETAIL, WIDEST);
    this.nameSpan.textContent = this.shortName;
    this.detailSpan.textContent = this.detail;
    this.width = Math.max(width(this.shortName, NAME, 500), width(this.detail, DETAIL)) + 6;
    this.lines = Number(Boolean(this.shortName)) + Number(Boolean(this.detail));
    this.height = this.lines * 13.5 + 2;
    if (!this.lines) this.width = 0;
    if (this.arc) this.#placeHandle();
  }

  #placeHandle() {
    const {middle, first} = this.arc;
    this.handle.setAttribute("transform", `translate(${middle.x},${middle.y})`);
    if (!this.rank.textContent) return;
    this.rank.setAttribute("x", first.x.toFixed(1));
    this.rank.setAttribute("y", (first.y + 3.5).toFixed(1));
  }

  #placed = [];

  /** Draw the arc between two points through a handle; returns whether anything differs from before. */
  place(from, to, handle, isLoop) {
    if (this.#carried) {
      this.#carried = false;
      this.group.removeAttribute("transform");
      this.label?.removeAttribute("transform");
    }
    const placed = [from?.x, from?.y, to?.x, to?.y, handle.x, handle.y, isLoop];
    if (placed.every((value, index) => value === this.#placed[index])) return false;
    this.#placed = placed;
    const made = arc(from, to, handle, isLoop);
    this.arc = made;
    this.hit.setAttribute("d", made.path);
    this.glow.setAttribute("d", made.path);
    this.line.setAttribute("d", made.path);
    this.head.setAttribute("d", made.head);
    if (this.complete) this.#placeHandle();
    return true;
  }

  #carried = false;

  /** Show it elsewhere as it is. */
  carry(dx, dy) {
    this.#carried = true;
    this.group.setAttribute("transform", `translate(${dx},${dy})`);
    this.label?.setAttribute("transform", `translate(${dx},${dy})`);
  }

  /** What `placeLabels` needs to know of this name. */
  asLabel() {
    return {key: this, handle: this.arc.middle, normal: this.arc.normal, width: this.width, height: this.height};
  }

  /** Put the name beside the handle, with its middle at a point, or where it stands best alone. */
  placeName(middle = beside(this.asLabel(), this.arc.normal)) {
    const [x, y] = [middle.x.toFixed(1), middle.y];
    const top = y - this.height / 2 + 11;
    this.nameSpan.setAttribute("x", x);
    this.nameSpan.setAttribute("y", top.toFixed(1));
    this.detailSpan.setAttribute("x", x);
    this.detailSpan.setAttribute("y", (top + (this.shortName ? 13.5 : 0)).toFixed(1));
    /** Relative to the handle, so that it can come along when that is dragged. */
    this.offset = {x: middle.x - this.arc.middle.x, y: middle.y - this.arc.middle.y};
    this.nameAt = middle;
  }
}

/** What makes a transition fire, in a few words. */
function whatFires({type, trigger, guard}) {
  const text = trigger.trim().split("\n")[0];
  const first =
    {time: () => spokenTime(trigger), event: () => text || "no event", condition: () => text}[type]?.() ?? "";
  const if_ = guard.trim().split("\n")[0];
  return [first, if_ && `[${if_}]`].filter(Boolean).join(" ");
}
