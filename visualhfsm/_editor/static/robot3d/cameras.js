/**
 * The pictures of the robot's cameras, with the marks of the component.
 *
 * @import {PropertyValues} from "lit"
 * @import {Mark} from "../data/protocol.js"
 */

import {html, nothing} from "lit";

import {offers} from "../kit/buttons.js";
import {messageOf} from "../kit/notices.js";
import {required} from "../kit/existence.js";
import {n, t} from "../kit/texts.js";
import {MonitorElement} from "../run/element.js";
import {receiveFrames} from "./frames.js";
import {monitor} from "../run/monitor.js";

const BOTTOM = "CameraBottom";
/** @type {Record<string, string>} */
const TITLES = {Camera: t("Top camera"), [BOTTOM]: t("Bottom camera"), CameraOutside: t("From outside")};

/** The cameras of the robot, or those of the recording that is shown. */
export const cameraNames = () =>
  monitor.recording ? recordedCameras(monitor.recording.cameras) : monitor.robot.cameras;

/** The title of a camera; one without another below it is just the camera. @param {string} name */
export const titleOf = (name) =>
  (cameraNames().includes(BOTTOM) || name !== "Camera" ? TITLES[name] : undefined) ?? name;

/** @param {HTMLCanvasElement} canvas */
const penOf = (canvas) => required(canvas.getContext("2d"), "canvas");

const COLORS = ["red", "green", "blue", "yellow", "magenta", "cyan"];

class Cameras extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "structure"];
  static properties = {large: {state: true}};

  constructor() {
    super();
    /** The camera whose picture is large, with the others inside it; "" for none. */
    this.large = "";
  }

  render() {
    const {recording} = monitor;
    const names = cameraNames();
    if (!names.length)
      return html`<div class="empty">
        ${
          recording
            ? t("This recording contains no pictures.")
            : html`<p>${t("No robot with a camera is here.")}</p>
                ${offers({robot: t("Choose a robot")}, this.context)}`
        }
      </div>`;
    const explanation =
      recording && !recording.cameras.length && t("This recording contains no pictures: these are the marks.");
    const large = names.includes(this.large) ? this.large : "";
    return html`<div class="cameras ${large ? "inside" : ""}">
      ${explanation ? html`<p class="faint explain">${explanation}</p>` : nothing}
      ${names.map(
        (name) =>
          html`<hfsm-camera
            class=${name === large ? "large" : ""}
            .name=${name}
            .past=${Boolean(monitor.looking)}
            .isLarge=${name === large}
            @enlarge=${() => (this.large = name === large ? "" : name)}
          ></hfsm-camera>`,
      )}
    </div>`;
  }
}

/** The cameras whose pictures a recording contains, or on which the component marked something. */
function recordedCameras(/** @type {string[]} */ cameras) {
  const marked = [...monitor.past.numbers].flatMap((name) => /^mark\.([^/]*)\//.exec(name)?.[1] || []);
  return [...new Set([...cameras, ...marked])].sort();
}

/**
 * The marks on a camera's picture at the moment that is shown.
 *
 * @param {string} camera
 * @returns {Mark[]}
 */
function marksOn(camera) {
  const silent = !monitor.looking && (monitor.since || monitor.ended);
  return silent ? [] : (monitor.snapshot?.component.marks ?? []).filter((mark) => mark.camera === camera);
}

/**
 * Draw a cross at each mark, in the color that its label names.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Mark[]} marks
 */
function drawMarks(canvas, marks) {
  const pen = penOf(canvas);
  const arm = canvas.width / 24;
  for (const {u, v, label} of marks) {
    const words = label.toLowerCase().split(/\s+/);
    for (const {width, color} of [
      {width: canvas.width / 80, color: "black"},
      {width: canvas.width / 160, color: COLORS.find((each) => words.includes(each)) ?? "white"},
    ]) {
      pen.lineWidth = width;
      pen.strokeStyle = color;
      pen.beginPath();
      pen.moveTo(u - arm, v);
      pen.lineTo(u + arm, v);
      pen.moveTo(u, v - arm);
      pen.lineTo(u, v + arm);
      pen.stroke();
    }
  }
}

export class Camera extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["shown"];
  static properties = {
    name: {attribute: false},
    past: {attribute: false},
    isLarge: {attribute: false},
    problem: {state: true},
    seen: {state: true},
  };

  constructor() {
    super();
    this.name = "";
    /** Whether a moment of the past is shown. */
    this.past = false;
    /** Whether its picture is large. */
    this.isLarge = false;
    /** @type {string | undefined} */
    this.problem = undefined;
    /** @type {ReturnType<typeof receiveFrames> | undefined} */
    this.frames = undefined;
    /** What the robot sees on its present picture, as `Sight` says. @type {Mark[]} */
    this.seen = [];
  }

  /** Those of the component and, on the present picture, what is seen. */
  #marks() {
    return [...marksOn(this.name), ...(this.past ? [] : this.seen)];
  }

  render() {
    const title = titleOf(this.name);
    const size = this.isLarge ? t("Smaller") : t("Larger");
    const marks = this.#marks().map(({u, v, label}) => `${label} ${Math.round(u)}, ${Math.round(v)}`.trim());
    return html`<figure class="camera ${this.problem ? "lost" : ""}">
      <canvas
        width="320"
        height="240"
        role="img"
        aria-label=${title}
        @dblclick=${() => this.dispatchEvent(new Event("enlarge"))}
      ></canvas>
      <figcaption>
        <span>${title}</span><span class="faint">${this.problem ?? html`<span class="rate"></span>`}</span>
        ${marks.length ? html`<span class="marks">${marks.join("; ")}</span>` : nothing}
        <button
          type="button"
          class="enlarge"
          aria-label="${size}: ${title}"
          @click=${() => this.dispatchEvent(new Event("enlarge"))}
        >
          ${size}
        </button>
      </figcaption>
    </figure>`;
  }

  /** @param {PropertyValues<Camera>} changed */
  updated(changed) {
    super.updated(changed);
    if (changed.has("name") || changed.has("past")) {
      this.frames?.close();
      this.frames = undefined;
      this.#former = undefined;
      if (!this.past) this.#showNow();
    }
    if (this.past) this.#showPast();
  }

  #showNow() {
    let [count, since] = [0, performance.now()];
    this.seen = [];
    this.frames = receiveFrames(`camera/${encodeURIComponent(this.name)}`, {
      draw: async (frame) => {
        const canvas = await this.#paint(new Blob([frame], {type: "image/jpeg"}));
        this.problem = undefined;
        count += 1;
        const passed = performance.now() - since;
        if (passed > 1000) {
          const rate = this.querySelector(".rate");
          if (rate)
            rate.textContent = n(
              "{width} × {height}, {count} image/s",
              "{width} × {height}, {count} images/s",
              Math.round((count * 1000) / passed),
              {width: canvas.width, height: canvas.height},
            );
          [count, since] = [0, performance.now()];
        }
        if (document.hidden) return;
        await new Promise(requestAnimationFrame);
      },
      lost: (reason) => (this.problem = reason || t("no image")),
      told: (marks) => (this.seen = JSON.parse(marks)),
    });
  }

  /** @param {Blob} jpeg */
  async #paint(jpeg) {
    const image = await createImageBitmap(jpeg);
    const canvas = this.#canvas;
    if (canvas.width !== image.width) Object.assign(canvas, {width: image.width, height: image.height});
    penOf(canvas).drawImage(image, 0, 0);
    image.close();
    drawMarks(canvas, this.#marks());
    return canvas;
  }

  /** The wall time whose picture is requested or shown. @type {number | undefined} */
  #former;
  #busy = false;

  /** Show the picture of the shown moment of the past, with one request at a time. */
  async #showPast() {
    if (this.#busy) return;
    this.#busy = true;
    while (monitor.looking && monitor.looking.at !== this.#former) {
      const at = (this.#former = monitor.looking.at);
      try {
        const picture = await monitor.ask("picture", {camera: this.name, at});
        this.problem = picture ? "" : t("no picture of this moment");
        if (picture) await this.#paint(new Blob([Uint8Array.from(atob(picture), (c) => c.charCodeAt(0))]));
        else this.#drawWithoutImage();
      } catch (error) {
        this.problem = messageOf(error);
        this.#drawWithoutImage();
      }
    }
    this.#busy = false;
  }

  get #canvas() {
    return required(this.querySelector("canvas"), "canvas");
  }

  /** Draw the marks alone, on a picture that is at least as large as they need. */
  #drawWithoutImage() {
    const canvas = this.#canvas;
    const marks = this.#marks();
    while (canvas.width < 2560 && marks.some(({u, v}) => u >= canvas.width || v >= canvas.height))
      Object.assign(canvas, {width: 2 * canvas.width, height: 2 * canvas.height});
    penOf(canvas).clearRect(0, 0, canvas.width, canvas.height);
    drawMarks(canvas, marks);
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.frames?.close();
    this.frames = undefined;
  }

  connectedCallback() {
    super.connectedCallback();
    if (this.name && !this.frames) this.requestUpdate("name", null);
  }
}

customElements.define("hfsm-cameras", Cameras);
customElements.define("hfsm-camera", Camera);
