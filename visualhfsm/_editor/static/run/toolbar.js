/** The list of running components in the header, to follow one of them. */

import {html} from "lit";

import {keyOf} from "../kit/keys.js";
import {required} from "../kit/existence.js";
import {started} from "../data/component-status.js";
import {n, t} from "../kit/texts.js";
import {MonitorElement} from "./element.js";
import {monitor} from "./monitor.js";

export class MonitorToolbar extends MonitorElement {
  /** @type {typeof MonitorElement.kinds} */
  static kinds = ["mode", "present"];

  render() {
    const {present} = monitor;
    const words = present.length ? n("{count} running", "{count} running", present.length) : t("Nothing runs");
    return html`<button
      type="button"
      class="running-now ${present.length ? "some" : ""}"
      aria-label=${words}
      aria-haspopup="menu"
      aria-expanded="false"
      title=${t("Behaviors that run now ({key})", {key: keyOf("followComponent")})}
      @click=${() => this.open()}
    >
      <span class="pulse" aria-hidden="true"></span><span class="word">${words}</span
      ><span class="short" aria-hidden="true">${present.length || ""}</span>
    </button>`;
  }

  /** Show the running components, to choose one; hide the list if it is shown already. */
  async open() {
    const {dropMenu} = await import("../shell/menu.js");
    const {present} = monitor;
    const components = present.map((name) => {
      const isFollowed = name === monitor.component;
      const shown = started.elsewhere.includes(name) ? t("{name}, started elsewhere", {name}) : name;
      const label = isFollowed ? t("{name} (followed)", {name: shown}) : shown;
      return {id: name, label, icon: isFollowed ? "properties" : "link", run: () => this.#follow(name)};
    });
    const more = monitor.component ? ["openRecording", "unfollow"] : ["openRecording"];
    const title = present.length ? t("Running now") : t("No behavior runs now");
    const groups = present.length ? [components, more] : [more];
    dropMenu(required(this.querySelector("button"), "button"), {groups, title}, this.context);
  }

  /** @param {string} name */
  async #follow(name) {
    await this.context.app.follow(name);
    this.context.canvas.focusSelected();
  }
}

customElements.define("hfsm-monitor-toolbar", MonitorToolbar);
