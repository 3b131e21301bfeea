/** Edit a name in place. */

import {rename} from "../data/commands.js";
import {page} from "../data/page.js";
import {t} from "../kit/texts.js";
import {RADIUS} from "../measures/geometry.js";
import {width} from "../measures/text.js";

const SIZE = 13;

export class Rename {
  /** @type {{kind: "state" | "transition", id: number, name: string} | undefined} */
  #what;

  /** @param {import("./canvas.js").HfsmCanvas} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.input = document.createElement("input");
    this.input.className = "rename";
    this.input.hidden = true;
    this.input.maxLength = 200;
    this.input.setAttribute("aria-label", t("Name"));
    this.input.addEventListener("keydown", (event) => this.#key(event));
    this.input.addEventListener("input", () => this.follow());
    this.input.addEventListener("blur", () => this.commit());
  }

  /** Edit a name; returns its field, undefined if it was deleted. @param {"state" | "transition"} kind @param {number} id */
  begin(kind, id) {
    const list = kind === "state" ? page.automaton?.states : page.automaton?.transitions;
    const item = list?.find((each) => each.id === id);
    this.commit();
    if (!item) return undefined;
    this.#what = {kind, id, name: item.name};
    this.input.value = item.name;
    this.input.setAttribute("aria-label", kind === "state" ? t("Name of the state") : t("Name of the transition"));
    this.input.hidden = false;
    const place = this.#place();
    if (place) this.canvas.viewport.reveal(place);
    this.follow();
    this.input.focus({preventScroll: true});
    this.input.select();
    return this.input;
  }

  /** Keep the field at the name while the drawing moves. */
  follow() {
    if (!this.#what) return;
    const place = this.#place();
    if (!place) {
      this.cancel(); // it was deleted, as in another window
      return;
    }
    const {scale} = this.canvas.viewport;
    const {x, y} = this.canvas.viewport.toWindow(place);
    const size = Math.max(11, Math.min(20, SIZE * scale));
    const wide = Math.max(RADIUS * 1.9 * scale, width(this.input.value, size) * 1.1 + 20, 70);
    const {style} = this.input;
    style.fontSize = `${size}px`;
    style.width = `${wide}px`;
    style.left = `${x - wide / 2}px`;
    style.top = `${y - size}px`;
  }

  commit() {
    const what = this.#what;
    if (!what) return;
    this.cancel();
    const name = this.input.value.trim();
    if (name !== what.name.trim()) rename(what.kind, what.id, name);
  }

  cancel() {
    this.#what = undefined;
    this.input.hidden = true;
  }

  #place() {
    if (!this.#what) return undefined;
    const {kind, id} = this.#what;
    if (kind === "state") return this.canvas.drawing.places.get(`s${id}`);
    const view = this.canvas.drawing.transitions.get(`t${id}`);
    return view?.nameAt ?? view?.arc.middle;
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const what = this.#what;
    if (event.key === "Enter") this.commit();
    else if (event.key === "Escape") this.cancel();
    else return;
    event.stopPropagation();
    event.preventDefault();
    this.canvas.focusSelected();
    if (what && event.key === "Enter" && event.shiftKey) {
      const {kind, id} = what;
      page.edit({kind, automaton: page.shownAutomaton.id, id, part: kind === "state" ? undefined : "trigger"});
    }
  }
}
