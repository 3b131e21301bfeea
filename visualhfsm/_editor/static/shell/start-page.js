/** The start page: templates of behaviors, and files to open. */

import {html, live, nothing, svg} from "lit";

import {ask} from "../data/commands.js";
import {PageElement} from "../data/element.js";
import {openFile, openNew, openPath, recentFiles, recover} from "../data/files.js";
import {icon, iconButton} from "../kit/icons.js";
import {bodies, chooseBody, chosenBody} from "../data/robot.js";
import {pictureOf, SIZE} from "../data/robot-pictures.js";
import {store} from "../data/store.js";
import {language, t, visible} from "../kit/texts.js";
import {viewing} from "../kit/viewers.js";

const RADIUS = 13;
const STAY = 1.4; // s in a state of a small picture
const isStill = matchMedia("(prefers-reduced-motion: reduce)");

/** @param {number[]} place @param {boolean} parent @param {boolean} initial */
const circle = ([x, y], parent, initial) => {
  const color = `var(--${parent ? "parent" : "plain"})`;
  const line = `var(--${parent ? "parent" : "plain"}-line)`;
  return svg`<g fill="none" stroke-width="2">
    <circle cx=${x} cy=${y} r=${RADIUS} fill=${color} stroke=${line}></circle>
    ${initial ? svg`<circle cx=${x} cy=${y} r="9" stroke=${line} stroke-width="1.4"></circle>` : nothing}
  </g>`;
};
/** Arcs with their heads, each `M...` one. @param {string} paths */
const arcs = (
  paths,
) => svg`<marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6" markerHeight="6" orient="auto">
    <path d="M0 0L8 4L0 8Z" fill="var(--arc)"></path></marker>
  ${paths
    .split("M")
    .slice(1)
    .map(
      (path) =>
        svg`<path d="M${path}" fill="none" stroke="var(--arc)" stroke-width="1.6" marker-end="url(#head)"></path>`,
    )}`;

/** The current state, which is one after the other as in a run. @param {number[][]} places @param {boolean} parent */
const current = (places, parent) => {
  /** @param {number} axis */
  const values = (axis) => places.map((place) => place[axis]).join(";");
  const lasts = `${places.length * STAY}s`;
  return svg`<circle r=${RADIUS} fill="var(--${parent ? "parent" : "plain"}-line)">
    <animate attributeName="cx" values=${values(0)} calcMode="discrete" dur=${lasts} repeatCount="indefinite"></animate>
    <animate attributeName="cy" values=${values(1)} calcMode="discrete" dur=${lasts} repeatCount="indefinite"></animate>
  </circle>`;
};

/**
 * An automaton, which runs unless the user wants nothing to move.
 *
 * @param {string} paths of its arcs @param {number[][]} states @param {number[]} run the states in the order of a run
 */
const automaton = (paths, states, run, parent = false) =>
  svg`${arcs(paths)}${states.map((place, index) => circle(place, parent, index === 0))}
    ${
      isStill.matches
        ? nothing
        : current(
            run.map((index) => states[index]),
            parent,
          )
    }`;

/** The templates: the three behaviors of the paper, football, and an empty document. */
const BEGINNINGS = [
  {
    template: "dance",
    name: t("Dance"),
    text: t("Both arms move from pose to pose."),
    picture: automaton(
      "M33 20Q90 8 147 20M160 33V53M147 66Q90 78 33 66M20 53V33",
      [
        [20, 20],
        [160, 20],
        [160, 66],
        [20, 66],
      ],
      [0, 1, 2, 3],
    ),
  },
  {
    template: "follow_ball",
    name: t("Follow the ball"),
    text: t("The head follows a ball, and searches for it when it is lost."),
    picture: automaton(
      "M42 36Q90 10 138 36M138 50Q90 76 42 50",
      [
        [30, 43],
        [150, 43],
      ],
      [0, 0, 1, 0, 1],
    ),
  },
  {
    template: "dance_and_follow",
    name: t("Dance and follow"),
    text: t("Two behaviors in turn, on three levels."),
    picture: svg`${automaton(
      "M42 22Q90 4 138 22M138 28Q90 40 42 28M30 37V55M150 37V55",
      [
        [30, 24],
        [150, 24],
      ],
      [0, 1],
      true,
    )}${automaton(
      "",
      [
        [30, 70],
        [150, 70],
      ],
      [0, 1],
      true,
    )}`,
  },
  {
    template: "score",
    name: t("Football"),
    text: t("It walks to a ball and kicks it into the goal."),
    picture: automaton(
      "M42 36Q66 22 78 34M102 34Q118 22 138 24M102 52Q118 64 138 62M90 58Q56 76 38 54",
      [
        [30, 43],
        [90, 43],
        [150, 24],
        [150, 62],
      ],
      [0, 1, 0, 1, 3],
    ),
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

/** @param {string} name */
function robotPicture(name) {
  const address = pictureOf(name);
  return address ? html`<img src=${address} width=${SIZE / 2} height=${SIZE / 2} alt="" />` : icon("robot");
}

class Start extends PageElement {
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["connection", "robot", "workspace"]};

  render() {
    const recent = recentFiles();
    const {recoverable = []} = store.workspace;
    const {status, started} = store.robot;
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
      </div>
      ${bodies().length > 1 && (status !== "present" || started === "simulation") ? this.#robots() : nothing}
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

  /** The choice of the robot on which behaviors run, unless one is here that was not simulated for them. */
  #robots() {
    const chosen = chosenBody();
    return html`<h2 id="start-robots">${t("Robot")}</h2>
      <div class="robot-cards">
        <div role="radiogroup" aria-labelledby="start-robots">
          ${bodies().map(
            ({name, title}) =>
              html`<label
                ><input
                  type="radio"
                  name="robot"
                  .checked=${live(name === chosen)}
                  @change=${() => chooseBody(name)}
                />${robotPicture(name)}<span>${title}</span></label
              >`,
          )}
        </div>
        <button type="button" @click=${() => this.#makeRobot()}>
          ${icon("add")}<span>${t("Your own robot")}</span>
        </button>
      </div>`;
  }

  async #makeRobot() {
    (await import("../dialogs/own-robot.js")).makeRobot();
  }

  async #dance() {
    (await import("./robot-run.js")).watchDance(this.context.app);
  }

  async #tour() {
    (await import("./tour.js")).startTour(this.context);
  }
}

customElements.define("hfsm-start", Start);
