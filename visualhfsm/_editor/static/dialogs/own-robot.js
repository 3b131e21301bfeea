/**
 * A robot of the user's own: choose its model, see it, correct what it was taken for, and save it.
 *
 * @import {From} from "../data/element.js"
 * @import {OwnRobot} from "../data/protocol.js"
 * @import {RobotDrawing} from "../robot3d/robot-drawing.js"
 * @typedef {Pick<OwnRobot, "name" | "text">} Draft
 */

import {html, nothing} from "lit";

import {PageElement, properties} from "../data/element.js";
import {wordButton} from "../kit/buttons.js";
import {spokenAngle, spokenPlace} from "../run/values.js";
import {messageOf, notify, notifyError} from "../kit/notices.js";
import {required} from "../kit/existence.js";
import {chooseBody, simulate} from "../data/robot.js";
import {keepPicture, SIZE} from "../data/robot-pictures.js";
import {RequestError, store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {showDialog} from "../kit/dialog.js";
import {chooseFile} from "../data/file-dialog.js";

const FULL = {turns: Math.PI / 2, slides: 0.3}; // rad and m by which a joint is moved in the picture
const STEPS = 20;

/** What was typed and not saved, by the path of the model: a dialog that is closed loses nothing. @type {Map<string, Draft>} */
const drafts = new Map();

/** Ask for the model of a robot, and make a robot of it that can be simulated. */
export async function makeRobot() {
  const path = await chooseFile({
    title: t("Your own robot"),
    verb: t("Choose"),
    kind: "model",
    start: "robots",
    hint: t(
      "A URDF, xacro or MJCF in the folder robots of the project, or the file of a robot there. Put a model there with its meshes.",
    ),
  });
  if (!path) return;
  await showDialog({
    title: t("Your own robot: {path}", {path}),
    wide: true,
    content: (/** @type {import("../kit/dialog.js").Close<undefined>} */ close) =>
      html`<hfsm-own-robot .path=${path} .close=${() => close()}></hfsm-own-robot>`,
  });
}

class OwnRobotElement extends PageElement {
  static properties = properties("path", "close", "read", "busy", "failed", "isTaken", "joint", "angle");
  /** @type {typeof PageElement.watches} */
  static watches = {page: [], store: ["connection"]};

  constructor() {
    super();
    this.path = "";
    this.close = () => {};
    /** What the server read last. @type {OwnRobot} */
    this.read = {name: "", text: ""};
    /** What the model was taken for. @type {string[]} */
    this.took = [];
    this.draft = {name: "", text: ""};
    /** What is being done, in words. */
    this.busy = "";
    /** Why the last request failed. */
    this.failed = "";
    /** Whether another robot has the name. */
    this.isTaken = false;
    /** The name under which it was saved here. */
    this.saved = "";
    /** The joint that is moved in the picture, and where it is. */
    this.joint = "";
    this.angle = 0;
    /** @type {RobotDrawing | undefined} */
    this.drawing = undefined;
    /** @type {unknown} */
    this.drawn = undefined;
  }

  connectedCallback() {
    super.connectedCallback();
    this.updateComplete.then(() => this.#begin());
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    this.drawing?.close();
    this.drawing = undefined;
  }

  render() {
    const {read, draft, busy, failed, took} = this;
    const {problem = "", line = 0, notes = []} = read;
    const hasProblem = Boolean(failed || problem);
    const isBusy = Boolean(busy) || !store.online;
    return html`<div class="own-robot">
        <div>
          <div class="stage"></div>
          ${this.#joints()}
          ${
            took.length || notes.length
              ? html`<h3 id="own-robot-took">${t("What it was taken for")}</h3>
                  <ul aria-labelledby="own-robot-took">
                    ${[...took, ...notes].map((each) => html`<li>${each}</li>`)}
                  </ul>`
              : nothing
          }
        </div>
        <div>
          <div class="field">
            <label for="own-robot-text">${t("Its parts: correct what was guessed")}</label>
            <div class="numbered">
              <div class="numbers" aria-hidden="true">
                ${draft.text
                  .split("\n")
                  .map((_, index) => html`<div class=${index + 1 === line ? "wrong" : ""}>${index + 1}</div>`)}
              </div>
              <textarea
                id="own-robot-text"
                wrap="off"
                spellcheck="false"
                autocapitalize="off"
                aria-invalid=${hasProblem}
                aria-describedby="own-robot-problem"
                .value=${draft.text}
                @input=${(/** @type {From<HTMLTextAreaElement>} */ {target}) => this.#type({text: target.value})}
                @scroll=${(/** @type {From<HTMLTextAreaElement>} */ {target}) => this.#scroll(target)}
                @keydown=${this.#key}
              ></textarea>
            </div>
          </div>
          <div id="own-robot-problem" class="problem" role="alert">
            <span>${failed || (problem && (line ? t("Line {line}: {problem}", {line, problem}) : problem))}</span>
            ${
              line && !failed
                ? html`<button type="button" class="link" @click=${() => this.#goTo(line)}>
                    ${t("Go to the line")}
                  </button>`
                : nothing
            }
          </div>
          <p role="status" class="explain">${busy}</p>
          <div class="field">
            <label for="own-robot-name">${t("Name of its file in the folder robots")}</label>
            <input
              id="own-robot-name"
              spellcheck="false"
              .value=${draft.name}
              @input=${(/** @type {From<HTMLInputElement>} */ {target}) => this.#type({name: target.value})}
            />
          </div>
        </div>
      </div>
      <footer>
        <button type="button" class="button" ?disabled=${isBusy} @click=${() => this.#guess()}>
          ${t("Begin again")}
        </button>
        <button type="button" class="button" ?disabled=${isBusy} @click=${() => this.#check()}>${t("Check")}</button>
        ${
          this.isTaken
            ? wordButton(t("Replace robots/{name}.toml", {name: draft.name}), () => this.#save({overwrite: true}), {
                kind: "button danger",
                disabled: isBusy,
              })
            : [
                wordButton(t("Save"), () => this.#save(), {kind: "button", disabled: isBusy}),
                wordButton(t("Save and start"), () => this.#save({starts: true}), {
                  kind: "button primary",
                  disabled: isBusy,
                }),
              ]
        }
      </footer>`;
  }

  /** The joints of the robot, to see which is which. */
  #joints() {
    const joints = (this.read.robot?.links ?? []).filter(({joint}) => joint);
    const {sliding} = joints.find(({joint}) => joint === this.joint) ?? {};
    const full = sliding ? FULL.slides : FULL.turns;
    if (!joints.length) return nothing;
    return html`<div class="joint">
      <label
        ><span>${t("Joint")}</span
        ><select
          @change=${(/** @type {From<HTMLSelectElement>} */ {target}) => {
            this.joint = target.value;
            this.angle = 0;
          }}
        >
          ${joints.map(({joint}) => html`<option value=${joint} ?selected=${joint === this.joint}>${joint}</option>`)}
        </select></label
      ><input
        type="range"
        aria-label=${t("Move the joint in the picture")}
        aria-valuetext=${(sliding ? spokenPlace : spokenAngle)(this.angle)}
        min=${-full}
        max=${full}
        step=${full / STEPS}
        .value=${String(this.angle)}
        @input=${(/** @type {From<HTMLInputElement>} */ {target}) => (this.angle = Number(target.value))}
      />
    </div>`;
  }

  updated() {
    const {drawing, joint, angle} = this;
    const {robot} = this.read;
    if (!drawing || !robot) return;
    const isFirst = !drawing.body;
    if (robot !== this.drawn) {
      this.drawn = robot;
      drawing.build(robot);
    }
    const joints = Object.fromEntries(robot.links.map((link) => [link.joint ?? "", 0]));
    drawing.pose({joints: {...joints, [joint]: angle}, tilt: null, torso: null, objects: {}});
    if (isFirst) drawing.look("around");
  }

  async #begin() {
    const kept = drafts.get(this.path);
    await Promise.all([kept ? this.#take(kept) : this.#guess(), this.#prepare()]);
  }

  /** Load what draws the robot; without it, everything else works. */
  async #prepare() {
    try {
      const {RobotDrawing} = await import("../robot3d/robot-drawing.js");
      if (!this.isConnected) return;
      this.drawing = new RobotDrawing(required(this.querySelector(".stage"), "place for it"));
      this.requestUpdate();
    } catch {
      required(this.querySelector(".stage"), "place for it").textContent = t(
        "This browser cannot draw in 3D: WebGL is switched off or missing.",
      );
    }
  }

  /** Go on with what was typed before. @param {Draft} kept */
  #take(kept) {
    this.draft = kept;
    return this.#check();
  }

  /** Take the model for what it seems to be. */
  async #guess() {
    const read = await this.#ask(t("Reading {path}", {path: this.path}), () =>
      store.request("guessRobot", {path: this.path}),
    );
    if (!read) return;
    this.draft = {name: read.name, text: read.text};
    this.took = read.took ?? [];
    this.saved = /\.toml$/.test(this.path) ? read.name : "";
    drafts.delete(this.path);
    this.#show(read);
  }

  /** Read the text as it is now; returns whether it describes a robot. */
  async #check() {
    const {draft} = this;
    const read = await this.#ask(t("Checking"), () => store.request("checkRobot", draft));
    if (read) this.#show(read);
    return Boolean(read && !read.problem);
  }

  /** @param {{overwrite?: boolean, starts?: boolean}} how */
  async #save({overwrite = false, starts = false} = {}) {
    const {draft} = this;
    if (starts && !(await this.#check())) return;
    const own = draft.name === this.saved;
    const done = await this.#ask(t("Saving"), () =>
      store.request("saveRobot", {...draft, overwrite: overwrite || own}),
    );
    if (!done) return;
    await this.#takePicture(done.path);
    store.greeting.bodies = done.bodies;
    chooseBody(done.path);
    drafts.delete(this.path);
    this.saved = draft.name;
    notify(t("{path} is saved: it is among the robots to simulate.", {path: done.path}));
    if (!starts) return;
    this.close();
    await simulate().catch(notifyError);
  }

  /** Keep a small picture of the robot as it is seen here. @param {string} name */
  async #takePicture(name) {
    const {drawing} = this;
    if (!drawing?.body) return;
    const picture = document.createElement("canvas");
    picture.width = picture.height = SIZE;
    await drawing.drawn(); // until the next frame its pixels can be read
    const drawn = drawing.renderer.domElement;
    const side = Math.min(drawn.width, drawn.height);
    picture
      .getContext("2d")
      ?.drawImage(drawn, (drawn.width - side) / 2, (drawn.height - side) / 2, side, side, 0, 0, SIZE, SIZE);
    keepPicture(name, picture.toDataURL("image/webp", 0.8));
  }

  /**
   * Ask the server, saying so; undefined when it refuses.
   *
   * @template T
   * @param {string} busy @param {() => Promise<T>} request
   */
  async #ask(busy, request) {
    this.busy = busy;
    this.failed = "";
    this.isTaken = false;
    try {
      return await request();
    } catch (error) {
      this.isTaken = error instanceof RequestError && error.kind === "exists";
      this.failed = messageOf(error);
      return undefined;
    } finally {
      this.busy = "";
    }
  }

  /** @param {OwnRobot} read */
  #show(read) {
    this.read = {...read, robot: read.robot ?? this.read.robot};
    const joints = (this.read.robot?.links ?? []).flatMap(({joint}) => joint ?? []);
    if (!joints.includes(this.joint)) [this.joint, this.angle] = [joints[0] ?? "", 0];
    if (read.line) this.#goTo(read.line);
  }

  /** @param {Partial<Draft>} changed */
  #type(changed) {
    this.draft = {...this.draft, ...changed};
    drafts.set(this.path, this.draft);
    this.isTaken = false;
    this.requestUpdate();
  }

  /** Select a line of the text. @param {number} line from 1 */
  async #goTo(line) {
    await this.updateComplete;
    const field = this.#field;
    const lines = field.value.split("\n");
    const start = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
    field.focus();
    field.setSelectionRange(start, start + (lines[line - 1] ?? "").length);
    field.scrollTop = (field.scrollHeight / lines.length) * Math.max(0, line - 4);
  }

  get #field() {
    return /** @type {HTMLTextAreaElement} */ (required(this.querySelector("textarea"), "field"));
  }

  /** The numbers of the lines move with the text. @param {HTMLTextAreaElement} field */
  #scroll(field) {
    required(field.previousElementSibling, "numbers").scrollTop = field.scrollTop;
  }

  /** @param {KeyboardEvent} event */
  #key = (event) => {
    if (!(event.ctrlKey || event.metaKey) || !["Enter", "s"].includes(event.key) || this.busy) return;
    event.preventDefault();
    if (event.key === "s") this.#save();
    else this.#check();
  };
}

customElements.define("hfsm-own-robot", OwnRobotElement);
