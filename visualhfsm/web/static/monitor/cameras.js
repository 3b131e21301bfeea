/** What the robot's cameras see. */

import {html, nothing} from "lit";

import {MonitorElement} from "./element.js";
import {receiveFrames} from "./frames.js";
import {monitor} from "./monitor.js";

const TITLES = {Camera: "Top camera", CameraBottom: "Bottom camera", CameraOutside: "From outside"};

class Cameras extends MonitorElement {
  static kinds = ["mode", "structure"];

  render() {
    const names = monitor.recording ? [] : monitor.robot.cameras;
    if (!names.length) return html`<p class="empty">${monitor.recording ? "A recording holds no images." : "No camera is there in this realm."}</p>`;
    return html`<div class="cameras">${monitor.looking ? html`<p class="faint explain">Images are those of now, also while you look back.</p>` : nothing}
      ${names.map((name) => html`<hfsm-camera .name=${name}></hfsm-camera>`)}</div>`;
  }
}

class Camera extends MonitorElement {
  static kinds = [];
  static properties = {name: {attribute: false}, problem: {state: true}};

  render() {
    const title = TITLES[this.name] ?? this.name;
    return html`<figure class="camera ${this.problem ? "lost" : ""}"><canvas width="320" height="240" role="img" aria-label=${title}></canvas>
      <figcaption>${title}<span class="faint">${this.problem ?? html`<span class="rate"></span>`}</span></figcaption></figure>`;
  }

  updated(changed) {
    super.updated(changed);
    if (!changed.has("name")) return;
    this.frames?.close();
    let [count, since] = [0, performance.now()];
    this.frames = receiveFrames(`/camera/${encodeURIComponent(this.name)}`, {
      draw: async (frame) => {
        const image = await createImageBitmap(new Blob([frame], {type: "image/jpeg"}));
        const canvas = this.querySelector("canvas");
        if (canvas.width !== image.width) Object.assign(canvas, {width: image.width, height: image.height});
        canvas.getContext("2d").drawImage(image, 0, 0);
        image.close();
        this.problem = undefined;
        count += 1;
        const passed = performance.now() - since;
        if (passed > 1000) {
          const rate = this.querySelector(".rate");
          if (rate) rate.textContent = `${canvas.width} × ${canvas.height}, ${Math.round((count * 1000) / passed)} images/s`;
          [count, since] = [0, performance.now()];
        }
        if (document.hidden) return;
        await new Promise(requestAnimationFrame);
      },
      lost: (reason) => (this.problem = reason || "no image"),
    });
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
