/**
 * The pointer on the canvas: gestures, opening, zooming, tips and the menu.
 *
 * @import {HfsmCanvas} from "./canvas.js"
 * @typedef {{move: (event: PointerEvent) => void, end: () => unknown, cancel: () => void, scrolls?: boolean}} Gesture
 *   one that `scrolls` moves the drawing along at the edge
 */

import {page} from "../data/page.js";
import {Band, Link, Move, Pan, Pinch} from "./gestures.js";
import {idOf} from "./order.js";
import {browserStorage} from "../kit/location.js";

const WHEEL = 600; // pixels of a wheel for a zoom by e
const PINCH = 150; // the same for a pinch on a trackpad
const LINE = 16; // pixels of a line, for wheels that count lines
const LARGE = 40; // pixels; a trackpad's first steps are smaller
const NOTCH = 120; // units that browsers report for one notch of a mouse's wheel
const TRACKPAD = 400; // ms for which a trackpad is remembered
const SLOP = 10; // pixels; a finger that moves less counts as resting
const LONG = 500; // ms that a finger rests before the menu opens
const BORDER = 28; // pixels from the edge within which a drag scrolls the drawing
const FASTEST = 20; // pixels in one frame

const WHEEL_KEY = "visualhfsm.wheel";

/** Whether the wheel always zooms, in this browser. */
export const wheelSetting = {
  zooms: browserStorage.getItem(WHEEL_KEY) === "zooms",

  toggle() {
    this.zooms = !this.zooms;
    browserStorage.setItem(WHEEL_KEY, this.zooms ? "zooms" : "");
  },
};

/** Whether two events are further apart than a resting finger. @param {MouseEvent} one @param {MouseEvent} other */
const far = (one, other) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) > SLOP;

export class Pointer {
  /** @type {Gesture | undefined} */
  #gesture;
  /** The pointers of the gesture; others are ignored. @type {Set<number>} */
  #owners = new Set();
  /** The fingers that touch the screen. @type {Map<number, PointerEvent>} */
  #fingers = new Map();
  /** The timer that opens the menu. */
  #longPress = 0;
  #opened = false; // whether the resting finger has opened the menu
  /** Where the gesture began, until the pointer has moved far enough. @type {PointerEvent | undefined} */
  #resting;
  /** The last event of a pointer at the edge. @type {PointerEvent | undefined} */
  #atEdge;
  #trackpadSeen = -Infinity;
  /** The element on which the pointer was last pressed. @type {EventTarget | null} */
  #pressed = null;
  #spaceHeld = false;
  /** @type {(() => void) | undefined} */
  #whenDone;

  /** @param {HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    const {surface} = canvas;
    surface.addEventListener("pointerdown", (event) => this.#down(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    surface.addEventListener("pointerup", (event) => {
      canvas.tool?.release?.(canvas.point(event));
      if (this.#lift(event)) this.#up();
    });
    surface.addEventListener("pointercancel", (event) => this.#lift(event) && canvas.cancel());
    // When the finger is lifted, the menu must keep the focus.
    surface.addEventListener("touchend", (event) => this.#opened && event.cancelable && event.preventDefault());
    surface.addEventListener("pointerover", (event) => this.#showTip(event));
    surface.addEventListener("dblclick", (event) => this.#doubleClick(event));
    surface.addEventListener("contextmenu", (event) => this.#menu(event));
    surface.addEventListener("wheel", (event) => this.#wheel(event), {passive: false});
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("keyup", (event) => event.key === " " && (this.#spaceHeld = false));
    // Let go elsewhere.
    canvas.addEventListener(
      "focusout",
      (event) => canvas.contains(/** @type {Node | null} */ (event.relatedTarget)) || (this.#spaceHeld = false),
    );
  }

  /** Whether something is being dragged. */
  get isBusy() {
    return Boolean(this.#gesture);
  }

  /** Do something as soon as nothing is dragged. @param {() => void} action */
  whenFree(action) {
    if (this.#gesture) this.#whenDone = action;
    else action();
  }

  /** Cancel a drag; return whether there was one. */
  cancel() {
    const gesture = this.#gesture;
    gesture?.cancel();
    this.#finish();
    return Boolean(gesture);
  }

  #finish() {
    this.#gesture = undefined;
    this.#rest();
    const action = this.#whenDone;
    this.#whenDone = undefined;
    action?.();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const {canvas} = this;
    if (event.key === " ") this.#spaceHeld = true;
    if (
      !canvas.tool ||
      event.ctrlKey ||
      event.metaKey ||
      event.target instanceof HTMLInputElement ||
      event.target instanceof HTMLTextAreaElement ||
      !canvas.tool.key(event)
    )
      return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {PointerEvent} event */
  #down(event) {
    if (event.pointerType === "touch" && this.#touch(event)) return;
    if (this.#gesture) return;
    const {canvas} = this;
    canvas.rename?.commit();
    canvas.annotating?.commit();
    const group = groupAt(event.target);
    this.#pressed = event.target;
    const pans = event.button === 1 || (event.button === 0 && this.#spaceHeld);
    if (event.button !== 0 && !pans) return;
    if (canvas.tool && !pans) {
      event.preventDefault();
      canvas.tool.click(canvas.point(event));
      return;
    }
    if (pans) {
      event.preventDefault();
      this.#gesture = new Pan(canvas, event);
    } else if (group) {
      this.#gesture = this.#grab(event, group.dataset.key ?? "");
    } else {
      canvas.surface.focus({preventScroll: true});
      this.#gesture = new Band(canvas, event);
    }
    this.#owners = new Set([event.pointerId]);
    this.#resting = event;
    // The group itself, or a double click would go to the whole drawing.
    if (this.#gesture) (group ?? canvas.surface).setPointerCapture(event.pointerId);
  }

  /** Put a finger down; two of them pan and zoom. @param {PointerEvent} event @returns {boolean} whether they do */
  #touch(event) {
    const {canvas} = this;
    if (event.isPrimary) this.#fingers.clear(); // a finger may have been lifted elsewhere
    this.#fingers.set(event.pointerId, event);
    this.#opened = false;
    clearTimeout(this.#longPress);
    if (this.#fingers.size === 1 && !canvas.tool) this.#longPress = setTimeout(() => this.#hold(event), LONG);
    if (this.#fingers.size !== 2) return this.#fingers.size > 2;
    canvas.cancel();
    this.#gesture = new Pinch(canvas, this.#fingers);
    this.#owners = new Set(this.#fingers.keys());
    return true;
  }

  /** A finger has rested: open the menu. @param {PointerEvent} event */
  #hold(event) {
    this.cancel();
    this.#opened = true;
    this.#menu(event, this.#pressed);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (this.#fingers.has(event.pointerId)) this.#fingers.set(event.pointerId, event);
    if (this.#resting && far(event, this.#resting)) this.#rest();
    if (!this.#gesture) this.canvas.tool?.move(event);
    else if (this.#owners.has(event.pointerId)) {
      this.#gesture.move(event);
      this.#scroll(event);
    }
  }

  /** The pointer no longer rests where it was pressed. */
  #rest() {
    clearTimeout(this.#longPress);
    this.#resting = undefined;
    this.#atEdge = undefined;
  }

  /** While something is dragged at the edge, scroll the drawing. @param {PointerEvent} event */
  #scroll(event) {
    const scrolls = !this.#resting && this.#gesture?.scrolls && this.#beyond(event).some(Boolean);
    const goesOn = this.#atEdge !== undefined;
    this.#atEdge = scrolls ? event : undefined;
    if (scrolls && !goesOn) requestAnimationFrame(() => this.#scrollOn());
  }

  #scrollOn() {
    const event = this.#atEdge;
    if (!event || !this.#gesture) return;
    const [dx, dy] = this.#beyond(event);
    this.canvas.viewport.pan(dx, dy);
    this.#gesture.move(event);
    requestAnimationFrame(() => this.#scrollOn());
  }

  /** The pixels by which the drawing scrolls in one frame for a pointer at the edge. @param {MouseEvent} event */
  #beyond({clientX, clientY}) {
    const {left, top, right, bottom} = this.canvas.getBoundingClientRect();
    /** @param {number} before @param {number} after */
    const step = (before, after) =>
      before < BORDER
        ? Math.min(FASTEST, (BORDER - before) / 2)
        : after < BORDER
          ? -Math.min(FASTEST, (BORDER - after) / 2)
          : 0;
    return [step(clientX - left, right - clientX), step(clientY - top, bottom - clientY)];
  }

  /** Forget a pointer. @param {PointerEvent} event @returns {boolean} whether its gesture is over */
  #lift({pointerId}) {
    this.#fingers.delete(pointerId);
    clearTimeout(this.#longPress);
    return !this.#gesture || this.#owners.has(pointerId);
  }

  /** @param {PointerEvent} event @param {string} key */
  #grab(event, key) {
    const {canvas} = this;
    if (
      event.target instanceof Element &&
      event.target.classList.contains("rim") &&
      !event.shiftKey &&
      !canvas.readOnly
    ) {
      canvas.order.select(key);
      return new Link(canvas, idOf(key));
    }
    const {edge} = /** @type {SVGElement} */ (event.target).dataset;
    if (edge) return canvas.annotating?.grab(event, edge);
    const selected = canvas.selectedKeys().includes(key);
    if (!selected || event.shiftKey) canvas.order.select(key, event.shiftKey);
    return canvas.readOnly
      ? undefined
      : new Move(canvas, event, () => selected && !event.shiftKey && canvas.order.select(key));
  }

  /**
   * Actions that wait for the end of the gesture run after the answer of the server: until then, everything stays where
   * it was dragged.
   */
  async #up() {
    const gesture = this.#gesture;
    this.#gesture = undefined;
    this.#rest();
    try {
      await gesture?.end();
    } finally {
      if (!this.#gesture) this.#finish();
    }
  }

  /** @param {MouseEvent} event */
  #doubleClick(event) {
    const {canvas} = this;
    const target = this.#pressed; // the event's target is the element that captured the pointer
    const key = groupAt(target)?.dataset.key;
    if (!(target instanceof Element) || !key) {
      const {x, y} = canvas.point(event);
      if (!canvas.readOnly && page.automaton) canvas.add("state", "addState", {x: Math.round(x), y: Math.round(y)});
      return;
    }
    const id = idOf(key);
    if (key.startsWith("a")) {
      canvas.beginRename("annotation", id);
      return;
    }
    const kind = key.startsWith("s") ? "state" : "transition";
    const state = kind === "state" ? page.shownAutomaton.states.find((each) => each.id === id) : undefined;
    if (target.closest(".title")) canvas.beginRename(kind, id);
    else if (state?.children.length) page.open(state.children[0]);
    else page.edit({kind, automaton: page.shownAutomaton.id, id, part: state ? undefined : "trigger"});
  }

  /** @param {MouseEvent} event @param {EventTarget | null} target */
  #menu(event, target = event.target) {
    event.preventDefault();
    const {canvas} = this;
    const key = groupAt(target)?.dataset.key;
    if (key && !canvas.selectedKeys().includes(key)) canvas.order.select(key);
    else if (!key) page.select({});
    this.#showMenu(event);
  }

  /** Show the menu by a key, for which WebKit and Macs make no event: at the first of what is selected. */
  openMenu() {
    const {surface} = this.canvas;
    const at = surface.querySelector(`[data-key="${this.canvas.selectedKeys()[0]}"]`) ?? surface;
    const {left, top, width, height} = at.getBoundingClientRect();
    this.#showMenu({clientX: left + width / 2, clientY: top + height / 2});
  }

  /** @param {Pick<MouseEvent, "clientX" | "clientY">} place */
  #showMenu(place) {
    const detail = {x: place.clientX, y: place.clientY, point: this.canvas.point(place)};
    this.canvas.dispatchEvent(new CustomEvent("hfsm-menu", {bubbles: true, detail}));
  }

  /** A mouse's wheel zooms; two fingers on a trackpad pan, or zoom with a pinch. @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const {viewport} = this.canvas;
    const unit = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE : 1;
    const mouse = this.#isMouse(event);
    const [dx, dy] = [event.deltaX * unit, event.deltaY * unit];
    if (!event.ctrlKey && (!mouse || event.shiftKey || !dy)) {
      viewport.pan(event.shiftKey ? -(dx || dy) : -dx, event.shiftKey ? 0 : -dy);
      return;
    }
    const {left, top} = this.canvas.getBoundingClientRect();
    const factor = Math.exp(-dy / (mouse ? WHEEL : PINCH)); // browsers report a pinch with Ctrl
    viewport.zoom(factor, event.clientX - left, event.clientY - top);
  }

  /**
   * Whether a mouse's wheel was turned: it counts lines, or makes large vertical steps when no trackpad was just used.
   * The steps of a trackpad are small at first. Some mice make small steps, too: a setting makes their wheel zoom.
   *
   * @param {WheelEvent & {wheelDeltaX?: number, wheelDeltaY?: number}} event
   */
  #isMouse({deltaMode, deltaX, deltaY, wheelDeltaX = 1, wheelDeltaY = 1, timeStamp}) {
    if (wheelSetting.zooms || deltaMode !== WheelEvent.DOM_DELTA_PIXEL) return true;
    const large = !deltaX && Math.abs(deltaY) >= LARGE;
    const notches = wheelDeltaX % NOTCH === 0 && wheelDeltaY % NOTCH === 0;
    const goesOn = timeStamp - this.#trackpadSeen < TRACKPAD;
    if ((large || notches) && !goesOn) return true;
    this.#trackpadSeen = timeStamp;
    return false;
  }

  /**
   * Only the element below the pointer has a tip; otherwise screen readers would say everything twice.
   *
   * @param {PointerEvent} event
   */
  #showTip(event) {
    const {tip, drawing} = this.canvas;
    const group = groupAt(event.target);
    if (tip.parentNode === group) return;
    tip.remove();
    if (!group) return;
    tip.textContent = drawing.find(group.dataset.key ?? "")?.tip ?? "";
    group.append(tip);
  }
}

/** The state, transition or annotation that a part of the drawing belongs to. @param {EventTarget | null} target */
const groupAt = (target) =>
  target instanceof Element ? /** @type {SVGElement | null} */ (target.closest("[data-key]")) : null;
