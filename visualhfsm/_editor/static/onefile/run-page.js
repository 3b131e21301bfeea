/**
 * A run in one file, without a server: the views of the editor show the content from visualhfsm/_monitor/run_page.py.
 *
 * @import {Automaton, Fields, LiveStructure, Timeline} from "../data/protocol.js"
 * @import {WorldShape} from "../robot3d/world-drawing.js"
 * @typedef {{name: string, began: number, shortened: string, structure: LiveStructure, timeline: Timeline,
 *   document: (Fields & {automata: Automaton[]}) | null, imported: Automaton[], world: WorldShape[], body: object,
 *   pictures: Record<string, [at: number, jpeg: string][]>, times: number[]}} Content the moments
 *   follow it, as JSON, at the component times `times`; pictures have wall times in s
 */

import {html, nothing, render} from "lit";

import "../shell/actions.js";
import {HfsmCanvas} from "../canvas/canvas.js";
import "../shell/tree.js";
import "../robot3d/cameras.js";
import "../run/errors.js";
import "../run/plots.js";
import "../robot3d/robot-view.js";
import "../run/timeline.js";
import "../run/variables.js";
import {icon} from "../kit/icons.js";
import {monitor} from "../run/monitor.js";
import {showOn} from "../run/overlay.js";
import {numbersOf} from "../run/values.js";
import {page} from "../data/page.js";
import "./selected-code.js";
import {store} from "../data/store.js";
import {decimal, language, t} from "../kit/texts.js";
import {begin, pushes, TAB, themeButton} from "./frame.js";
import {unpacked, unpackedData} from "./unpacked.js";

const BODY = "recorded"; // the name of its robot
const OLDEST = 2; // s for which a picture counts as that of a later moment, or twice the usual time between two
const MOST_POINTS = 600; // points of a line in a plot

/** The content of the page. @returns {Promise<{content: Content, moments: string[]}>} */
async function run() {
  const [first, ...moments] = (await unpackedData()).split("\n");
  return {content: unpacked(first), moments};
}

/**
 * Answer requests as the server would.
 *
 * @typedef {{time?: number, camera?: string, at?: number, names?: string[], start?: number, end?: number}} Wanted
 * @param {Content} content @param {string[]} moments
 * @returns {(op: string, fields?: Wanted) => any}
 */
const answers = ({times, pictures, body}, moments) => {
  /** @param {string} camera @param {number} at */
  const picture = (camera, at) => {
    const taken = Object.hasOwn(pictures, camera) ? pictures[camera] : [];
    const apart = taken.length > 1 ? ((taken.at(-1)?.[0] ?? 0) - taken[0][0]) / (taken.length - 1) : 0;
    const found = taken.findLast(([time]) => time <= at);
    return found && at - found[0] <= Math.max(OLDEST, 2 * apart) ? found[1] : null;
  };
  /** @param {string[]} names @param {number} start @param {number} end */
  const series = (names, start, end) => {
    const inside = [...times.keys()].filter((index) => times[index] >= start && times[index] <= end);
    const step = Math.ceil(inside.length / MOST_POINTS);
    const shown = inside.filter((_, place) => place % step === 0);
    const numbers = shown.map((index) => numbersOf(JSON.parse(moments[index])));
    return {
      times: shown.map((index) => times[index]),
      values: Object.fromEntries(names.map((name) => [name, numbers.map((each) => each.get(name) ?? null)])),
    };
  };
  return (op, {time = 0, camera = "", at = 0, names = [], start = 0, end = Infinity} = {}) => {
    if (op === "moment") return unpacked(moments[times.findLastIndex((each) => each <= time)] ?? moments[0]);
    if (op === "body") return body;
    if (op === "series") return series(names, start, end);
    return op === "picture" ? picture(camera, at) : null;
  };
};

/**
 * The moment that is shown first: the first one of which all cameras have a picture.
 *
 * @param {string[]} moments @param {Content["pictures"]} pictures
 */
function beginning(moments, pictures) {
  const seenFrom = Math.max(...Object.values(pictures).map(([first]) => first?.[0] ?? -Infinity));
  const found = moments.find((moment) => JSON.parse(moment).at >= seenFrom);
  return unpacked(found ?? moments[0]);
}

async function show() {
  const {content, moments} = await run();
  const {name, shortened, structure, timeline, world, pictures, imported} = content;
  const frame = new TextEncoder().encode(JSON.stringify({body: BODY, why: ""})).buffer;
  store.show(
    {answer: answers(content, moments), frames: {poses: frame}},
    pushes(name, `${name}.xml`, content.document),
  );
  const tab = content.document ? TAB : 0;
  if (imported.length) store.showContent(TAB, imported);
  page.show(tab);
  const cameras = Object.keys(pictures);
  const snapshot = beginning(moments, pictures);
  const found = {component: name, file: "", document: "", structure, timeline, snapshot, since: 0};
  await monitor.lookAtRecording(name, {...found, shortened, tab, world, cameras, body: BODY});
  const canvas = new HfsmCanvas();
  const draw = () => render(layout(content, canvas), document.body);
  draw();
  showOn(canvas);
  monitor.addEventListener("mode", draw);
}

/** @param {Content} content @param {HfsmCanvas} canvas */
function layout({name, began, shortened, document, timeline}, canvas) {
  const marked = timeline.numbers.some((each) => each.startsWith("mark."));
  const facts = {
    seconds: decimal(timeline.end - timeline.start, 1),
    date: new Date(began * 1000).toLocaleString(language, {dateStyle: "long", timeStyle: "short"}),
  };
  return html`<div class="run-page">
    <header>
      <h1>${name}</h1>
      <p>${t("A run of {seconds} s on {date}", facts)} ${shortened}</p>
      <button
        type="button"
        class="action bare"
        aria-pressed=${monitor.follows}
        aria-label=${t("Keep what is active in view")}
        title=${t("Keep what is active in view")}
        @click=${() => monitor.setFollows(!monitor.follows)}
      >
        ${icon("target")}
      </button>
      ${themeButton()}
    </header>
    <nav class="left" aria-label=${t("Tree of automata")}><hfsm-tree></hfsm-tree></nav>
    <main>
      ${document ? canvas : html`<p class="empty">${t("The document of this run is not known: its states are not drawn.")}</p>`}
    </main>
    <aside aria-label=${t("Values")}>
      <hfsm-robot-view></hfsm-robot-view>
      ${marked || monitor.recording?.cameras.length ? html`<hfsm-cameras></hfsm-cameras>` : nothing}
      <hfsm-live-variables></hfsm-live-variables>
      <hfsm-plots></hfsm-plots>
      <hfsm-live-errors></hfsm-live-errors>
      ${document ? html`<hfsm-selected-code></hfsm-selected-code>` : nothing}
    </aside>
    <footer><hfsm-monitor-timeline></hfsm-monitor-timeline></footer>
  </div>`;
}

begin(show);
