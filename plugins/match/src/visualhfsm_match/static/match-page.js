/**
 * A match in one file, without a server: all robots in 3D, from anywhere, and the events in their order.
 *
 * @import {Body} from "visualhfsm/robot3d/body.js"
 * @import {Described} from "visualhfsm/robot3d/robot-drawing.js"
 * @import {View} from "visualhfsm/robot3d/viewpoints.js"
 * @import {Placement, WorldShape} from "visualhfsm/robot3d/world-drawing.js"
 * @typedef {{name: string, shirt: [number, number, number], body: number, joints: string[]}} Robot
 * @typedef {{time: number, kind: string, text: string, team: string, robot: string}} MatchEvent
 * @typedef {{title: string, teams: string[], shirts: [number, number, number][], score: number[], outcome: string, seed: number, rules: string,
 *   live?: boolean, events: MatchEvent[], ball: string, bodies: Described[],
 *   robots: Robot[], world: WorldShape[], frames: number[][]}} Content frames have
 *   the time in s, the place of the ball, and for each robot that of its torso and the angles of its joints; from
 *   plugins/match/src/visualhfsm_match/_page.py
 */

import {html, render} from "lit";
import {AmbientLight, Box3, HemisphereLight, Scene, Vector3, WebGLRenderer} from "three";

import {figureOf} from "visualhfsm/robot3d/figure.js";
import {Viewpoints} from "visualhfsm/robot3d/viewpoints.js";
import {WorldDrawing} from "visualhfsm/robot3d/world-drawing.js";
import {begin, themeButton} from "visualhfsm/onefile/frame.js";
import {unpacked, unpackedData} from "visualhfsm/onefile/unpacked.js";
import {messageOf} from "visualhfsm/kit/notices.js";
import {decimal, t} from "visualhfsm/kit/texts.js";

const BALL_PLACE = 4; // numbers of a frame before those of the robots
const TORSO = 7;
const SPEEDS = [0.5, 1, 2, 4, 8];
const LIVE = 0; // the speed at which the newest frame is shown
const AGAIN = 300; // ms until the server is asked again when it had nothing
const [CLOSE, FAR] = [4, 55]; // m of the camera from the middle of the field
const SEEN = 3; // s before an event from which it is shown
const JUMP = 0.5; // s between two frames that do not follow each other
const AROUND_BALL = {height: 1, middle: 0.5, reach: 1, breadth: 1}; // m of what is seen of the play
const VIEWS = {around: t("Around"), top: t("Top"), follow: t("Behind"), head: t("Head")};

/** The robots and the field as three.js draws them. */
class MatchDrawing {
  /** @param {Content} content @param {HTMLElement} stage */
  constructor(content, stage) {
    this.content = content;
    this.renderer = new WebGLRenderer({antialias: true, alpha: true});
    this.scene = new Scene();
    this.viewpoints = new Viewpoints(this.renderer.domElement, () => this.draw());
    this.viewpoints.camera.near = 0.05;
    this.viewpoints.controls.maxDistance = FAR;
    this.time = 0;
    this.world = new WorldDrawing();
    this.world.build(content.world);
    this.scene.add(new HemisphereLight(0xffffff, 0x8a929c, 2.4), new AmbientLight(0xffffff, 0.4), this.world);
    this.bodies = content.robots.map(({body, shirt}) => figureOf(content.bodies[body], undefined, shirt));
    for (const {torso} of this.bodies) this.scene.add(torso);
    /** What the view follows; nothing if the whole field is seen. @type {Body | undefined} */
    this.followed = undefined;
    stage.append(Object.assign(this.renderer.domElement, {role: "img", ariaLabel: t("The match in 3D")}));
    new ResizeObserver(() => this.#resize(stage)).observe(stage);
  }

  /** Show a frame. @param {number[]} frame */
  show(frame) {
    let place = BALL_PLACE;
    for (const [index, {joints}] of this.content.robots.entries()) {
      const angles = frame.slice(place + TORSO, place + TORSO + joints.length);
      this.bodies[index].pose({
        torso: frame.slice(place, place + TORSO),
        joints: Object.fromEntries(joints.map((name, at) => [name, angles[at]])),
        tilt: null,
      });
      place += TORSO + joints.length;
    }
    const turned = [0, 0, Math.SQRT1_2, Math.SQRT1_2]; // by 90 degrees, so that it is seen from the side of the field's view
    this.world.pose({[this.content.ball]: /** @type {Placement} */ ([...frame.slice(1, BALL_PLACE), ...turned])});
    const swing = Math.abs(frame[0] - this.time) > JUMP ? 1 : undefined;
    this.time = frame[0];
    if (this.followed) this.viewpoints.keep(this.followed, [], swing);
    this.draw();
  }

  /** Follow the ball, or the robot of an index, from a viewpoint; without one see the whole field. @param {string} wanted */
  look(wanted) {
    const [view, index] = wanted.split(" ");
    for (const {headParts} of this.bodies) for (const each of headParts) each.visible = true;
    const ball = {torso: this.world.objects.get(this.content.ball), headParts: [], size: AROUND_BALL};
    this.followed = view ? (this.bodies[Number(index)] ?? ball) : undefined;
    this.viewpoints.fit(this.followed?.size);
    this.viewpoints.choose(/** @type {View} */ (view || "home"), this.followed, []);
    if (view) return;
    this.#seeAll();
    this.draw();
  }

  draw() {
    this.renderer.render(this.scene, this.viewpoints.camera);
  }

  /** Go so far away that the whole field is seen. */
  #seeAll() {
    const {min, max} = new Box3().setFromObject(this.world);
    const corners = [min.x, max.x].flatMap((x) => [min.y, max.y].map((y) => new Vector3(x, y, 0)));
    const {camera, controls} = this.viewpoints;
    const {position} = camera;
    position.set(0, -8.5, 6 * Math.max(1, 1.9 / camera.aspect)); // from higher up where the stage is high
    controls.target.set(0, 0, 0);
    controls.update();
    for (position.setLength(CLOSE); position.length() < FAR; position.multiplyScalar(1.02)) {
      camera.updateMatrixWorld();
      const seen = corners.map((corner) => corner.clone().project(camera));
      if (seen.every(({x, y}) => Math.max(Math.abs(x), Math.abs(y)) < 0.98)) break;
    }
  }

  /** @param {HTMLElement} stage */
  #resize({clientWidth: width, clientHeight: height}) {
    if (!width || !height) return;
    this.viewpoints.resize(width, height);
    if (this.followed) this.viewpoints.keep(this.followed, [], 1);
    else if (this.viewpoints.view) this.#seeAll();
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.draw();
  }
}

/**
 * Ask for what follows what is known of a match that is being played, until it is over.
 *
 * @param {Content} content to which it is added @param {() => void} changed
 */
async function follow(content, changed) {
  const decoder = new TextDecoder();
  let [known, rest] = [0, ""];
  while (!content.outcome) {
    const answer = await fetch(`film?from=${known}`);
    if (!answer.ok) throw new Error(await answer.text());
    const bytes = await answer.arrayBuffer();
    known += bytes.byteLength;
    const lines = (rest + decoder.decode(bytes, {stream: true})).split("\n");
    rest = lines.pop() ?? "";
    for (const line of lines.filter((each) => each.endsWith("}"))) {
      // another one was being written when its process was ended
      const {frame, news = [], ...others} = unpacked(line);
      if (frame) content.frames.push(frame);
      content.events.push(...news);
      Object.assign(content, others);
    }
    if (lines.length) changed();
    await new Promise((resolve) => setTimeout(resolve, bytes.byteLength ? 50 : AGAIN));
  }
}

/** Views of the ball or a robot. @param {string} name @param {(keyof typeof VIEWS)[]} offered @param {string | number} index */
const views = (name, offered, index) =>
  offered.map((view) => html`<option value=${`${view} ${index}`}>${name}: ${VIEWS[view]}</option>`);

async function show() {
  /** @type {Content} */
  const content = unpacked(await unpackedData());
  let [time, speed, playing, last, trouble] = [0, content.live ? LIVE : 1, false, 0, ""];
  /** @type {number[] | undefined} */
  let shown = undefined;
  const end = () => content.frames.at(-1)?.[0] ?? 0;
  const isOver = () => !content.live || Boolean(content.outcome);
  let drawing = /** @type {MatchDrawing | undefined} */ (undefined);
  const at = () => content.frames[Math.max(0, content.frames.findLastIndex(([each]) => each <= time + 1e-6))];
  const score = () => {
    const goals = content.events.filter(({kind, time: when}) => kind === "goal" && when <= time);
    return content.teams.map((team) => goals.filter((goal) => goal.team === team).length).join(" : ");
  };
  /** A team, and the color of its shirts. @param {number} index */
  const team = (index) => {
    const color = `rgb(${content.shirts[index].map((part) => 255 * part).join(" ")})`;
    return html`<span class="team" .style=${`--shirt: ${color}`}>${content.teams[index]}</span>`;
  };
  /** @param {number} when */
  const go = (when) => {
    time = Math.min(end(), Math.max(0, when));
    const frame = at();
    if (frame && frame !== shown) drawing?.show(frame);
    if (drawing) shown = frame;
    draw();
  };
  /** @param {number} now in ms */
  const step = (now) => {
    if (!playing) return;
    const next = speed === LIVE ? end() : time + ((now - last) / 1000) * speed;
    last = now;
    playing = next < end() || !isOver();
    go(next);
    if (playing) requestAnimationFrame(step);
  };
  const toggle = () => {
    playing = !playing;
    if (playing && time >= end() && isOver()) time = 0;
    last = performance.now();
    if (playing) requestAnimationFrame(step);
    draw();
  };
  const draw = () => {
    const known = content.events.findLastIndex(({time: when}) => when <= time);
    render(
      html`<div class="match-page">
        <header>
          <h1>${team(0)} <span class="score" aria-live="polite">${score()}</span> ${team(1)}</h1>
          <p role="status">${content.outcome || trouble || t("It is being played.")}</p>
          ${themeButton(draw)}
        </header>
        <main>
          <div class="stage"></div>
          <div class="controls">
            <button type="button" class="action primary" @click=${toggle}>${playing ? t("Pause") : t("Play")}</button>
            <input
              type="range"
              min="0"
              max=${end()}
              step="0.1"
              .value=${String(time)}
              aria-label=${t("Time")}
              @input=${(/** @type {any} */ event) => go(Number(event.target.value))}
            />
            <output>${decimal(time, 1)} s</output>
            <select
              aria-label=${t("View of the match")}
              @change=${(/** @type {any} */ event) => drawing?.look(event.target.value)}
            >
              <option value="">${t("Whole field")}</option>
              ${drawing ? views(t("Ball"), ["around", "top"], "ball") : ""}
              ${drawing ? content.robots.map(({name}, index) => views(name, ["follow", "head"], index)) : ""}
            </select>
            <select
              aria-label=${t("Speed")}
              @change=${(/** @type {any} */ event) => (speed = Number(event.target.value))}
            >
              ${!isOver() ? html`<option value=${LIVE} ?selected=${speed === LIVE}>${t("as it comes")}</option>` : ""}
              ${SPEEDS.map((each) => html`<option value=${each} ?selected=${each === speed}>× ${decimal(each, 1)}</option>`)}
            </select>
          </div>
        </main>
        <aside aria-label=${t("Events")}>
          <ol>
            ${content.events.map(
              (event, index) =>
                html`<li class=${event.kind} aria-current=${index === known ? "step" : "false"}>
                  <button type="button" @click=${() => go(event.time - SEEN)}>
                    <span>${decimal(event.time, 1)} s</span> ${event.text}
                  </button>
                </li>`,
            )}
          </ol>
          <p class="faint">${content.rules}</p>
        </aside>
      </div>`,
      document.body,
    );
  };
  const changed = () => {
    draw();
    if (drawing || !content.frames.length) return;
    drawing = new MatchDrawing(content, /** @type {HTMLElement} */ (document.querySelector(".stage")));
    go(0);
    if (content.live) toggle();
  };
  changed();
  if (!content.live) return;
  await follow(content, changed).catch((error) => (trouble = t("The match has ended here: {reason}", {reason: messageOf(error)})));
  if (speed === LIVE) {
    go(end());
    speed = 1;
    playing = false;
  }
  draw();
}

begin(show);
