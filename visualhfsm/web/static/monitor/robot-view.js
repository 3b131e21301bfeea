/** The robot and the balls in 3D, as the server knows where they are. three.js is loaded with this module. */

import {html} from "lit";

import {messageOf} from "../notices.js";
import {required} from "../required.js";
import {MonitorElement, whyUnknown} from "./element.js";
import {receiveFrames} from "./frames.js";
import {monitor} from "./monitor.js";
import {RobotDrawing} from "./robot-drawing.js";

class RobotView extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "shown"];
  static properties = {problem: {state: true}};

  constructor() {
    super();
    /** @type {string | undefined} */
    this.problem = undefined;
    /** @type {ReturnType<typeof receiveFrames> | undefined} */
    this.frames = undefined;
    /** @type {RobotDrawing | undefined} */
    this.drawing = undefined;
  }

  render() {
    return html`<div class="robot-view">
      <div class="stage"></div>
      <p class="robot-hint faint" role="status">${this.problem ?? hint()}</p>
    </div>`;
  }

  /** @param {import("lit").PropertyValues} changed */
  updated(changed) {
    super.updated(changed);
    if (!this.frames && this.isConnected) this.#begin();
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.frames?.close();
    this.drawing?.close();
    this.frames = this.drawing = undefined;
  }

  #begin() {
    /** @type {HTMLElement | null} */
    const stage = this.querySelector(".stage");
    try {
      this.drawing = new RobotDrawing(required(stage, "place for it"));
    } catch (error) {
      this.problem = `This browser cannot draw in 3D: ${messageOf(error)}`;
      this.frames = {close() {}};
      return;
    }
    this.frames = receiveFrames("/poses", {
      draw: async (frame, isFirst) => {
        if (!this.drawing) return;
        const content = JSON.parse(new TextDecoder().decode(frame));
        if (isFirst) {
          this.drawing.build(content);
          return;
        }
        const known = this.drawing.pose(content);
        this.problem = known ? undefined : whyUnknown();
        if (!document.hidden) await this.drawing.drawn();
      },
      lost: (reason) => (this.problem = reason || "The server is offline."),
    });
  }
}

function hint() {
  if (monitor.newest?.robot.health?.fallen)
    return "It has fallen. A real robot reports how far it is tilted, but not to which side.";
  return monitor.looking
    ? "The robot is shown as it is now, also while you look back."
    : "Drag to turn, use the wheel to zoom.";
}

customElements.define("hfsm-robot-view", RobotView);
