/** The start page: templates of behaviors, and files to open. */

import {html, nothing, svg} from "lit";

import {ask} from "../data/commands.js";
import {PageElement} from "../data/element.js";
import {openFile, openNew, openPath, recentFiles, recover} from "../data/files.js";
import {icon, iconButton} from "../kit/icons.js";
import {bodies, chooseBody, chosenBody} from "../data/robot.js";
import {store} from "../data/store.js";
import {language, t, visible} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";

/** @import {From} from "../data/element.js" */

/** @param {number} x @param {number} y */
const circle = (x, y, parent = false, initial = false) => {
  const color = `var(--${parent ? "parent" : "plain"})`;
  const line = `var(--${parent ? "parent" : "plain"}-line)`;
  return svg`<g fill="none" stroke-width="2">
    <circle cx=${x} cy=${y} r="13" fill=${color} stroke=${line}></circle>
    ${initial ? svg`<circle cx=${x} cy=${y} r="9" stroke=${line} stroke-width="1.4"></circle>` : nothing}
  </g>`;
};
/** @param {string} path */
const arcs = (path) => svg`<path d=${path} fill="none" stroke="var(--arc)" stroke-width="1.6"></path>`;

/** The templates: the three behaviors of the paper, football, and an empty document. */
const BEGINNINGS = [
  {
    template: "dance",
    name: t("Dance"),
    text: t("Both arms move from pose to pose."),
    picture: svg`${arcs("M33 20Q90 8 147 20M160 33V55M147 66Q90 78 33 66M20 55V33")}
      ${circle(20, 20, false, true)}${circle(160, 20)}${circle(160, 66)}${circle(20, 66)}`,
  },
  {
    template: "follow_ball",
    name: t("Follow the ball"),
    text: t("The head follows a ball, and searches for it when it is lost."),
    picture: svg`${arcs("M42 36Q90 10 138 36M138 50Q90 76 42 50")}${circle(30, 43, false, true)}${circle(150, 43)}`,
  },
  {
    template: "dance_and_follow",
    name: t("Dance and follow"),
    text: t("Two behaviors in turn, on three levels."),
    picture: svg`${arcs("M42 22Q90 4 138 22M138 28Q90 40 42 28M30 37V55M150 37V55")}
      ${circle(30, 24, true, true)}${circle(150, 24, true)}
      ${circle(30, 70, true)}${circle(150, 70)}`,
  },
  {
    template: "score",
    name: t("Football"),
    text: t("It walks to a ball and kicks it into the goal."),
    picture: svg`${arcs("M42 36Q66 22 78 34M102 34Q118 22 138 24M102 52Q118 64 138 62M90 58Q56 76 38 54")}
      ${circle(30, 43, false, true)}${circle(90, 43)}${circle(150, 24)}${circle(150, 62)}`,
  },
  {
    template: "empty",
    name: t("Empty"),
    text: t("Start with a blank sheet."),
    picture: svg`<circle cx="90" cy="43" r="15" fill="none" stroke="var(--strong-line)" stroke-width="1.6"
        stroke-dasharray="4 4"></circle>
      <path d="M90 36v14M83 43h14" stroke="var(--strong-line)" stroke-width="1.6"></path>`,
  },
];

class Start extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["connection", "robot", "workspace"]};

  render() {
    const recent = recentFiles();
    const {recoverable = []} = store.workspace;
    if (viewing.on)
      return html`<div class="start">
        <h1>${t("No document is open.")}</h1>
        <p class="lead">${t("You look on. When a document is opened in the editor, this page shows it.")}</p>
      </div>`;
    return html`<div class="start">
      <h1>${t("Draw what your robot does")}</h1>
      <p class="lead">${t("States, transitions between them, and automata inside states. Press Run and watch.")}</p>
      <div class="offers">
        <button type="button" class="button primary" @click=${() => this.#dance()}>${t("Watch a robot dance")}</button>
        <button type="button" class="button" @click=${() => this.#tour()}>${t("Take the tour")}</button>
        <button type="button" class="button" @click=${openFile}>${t("Open a document")}</button>
        ${bodies().length > 1 ? this.#robots() : nothing}
      </div>
      ${
        recoverable.length
          ? html`<h2>${t("Not saved when the editor ended")}</h2>
              <ul class="recent">
                ${recoverable.map(
                  (each) =>
                    html`<li class="offers">
                      <button type="button" @click=${() => recover(each.journal)}>
                        ${icon("history")}<span>${t("Recover {name}", {name: each.name})}</span
                        ><span class="when">${new Date(each.changedAt * 1000).toLocaleString(language)}</span>
                      </button>
                      ${iconButton(
                        "delete",
                        t("Discard the changes of {name}", {name: each.name}),
                        () => ask("discard", {journal: each.journal}),
                        {title: t("Discard these changes")},
                      )}
                    </li>`,
                )}
              </ul>`
          : nothing
      }
      <h2>${t("Start with")}</h2>
      <div class="cards">
        ${BEGINNINGS.map(
          ({template, name, text, picture}) =>
            html`<button type="button" class="card" @click=${() => openNew(template)}>
              <svg viewBox="0 0 180 86" aria-hidden="true">${picture}</svg><span class="name">${name}</span
              ><span class="text">${text}</span>
            </button>`,
        )}
      </div>
      ${
        recent.length
          ? html`<h2>${t("Recent")}</h2>
              <ul class="recent">
                ${recent.map(
                  (path) =>
                    html`<li>
                      <button type="button" @click=${() => openPath(path)}>
                        ${icon("file")}<span>${visible(path)}</span>
                      </button>
                    </li>`,
                )}
              </ul>`
          : nothing
      }
      <p class="drop">${t("You can also drop a document or SCXML anywhere on this page.")}</p>
    </div>`;
  }

  /** The choice of the robot that is simulated. */
  #robots() {
    const chosen = chosenBody();
    return html`<label class="robots"
        ><span>${t("Robot")}</span
        ><select @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => chooseBody(target.value)}>
          ${bodies().map(({name, title}) => html`<option value=${name} ?selected=${name === chosen}>${title}</option>`)}
        </select></label
      ><button type="button" class="button" @click=${() => this.#makeRobot()}>${t("Your own robot")}</button>`;
  }

  async #makeRobot() {
    await (await import("../dialogs/own-robot.js")).makeRobot();
    this.requestUpdate();
  }

  async #dance() {
    (await import("./robot-run.js")).watchDance(this.context.app);
  }

  async #tour() {
    (await import("./tour.js")).startTour(this.context);
  }
}

customElements.define("hfsm-start", Start);
