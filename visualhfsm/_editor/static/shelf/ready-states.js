/**
 * The ready states of the shelf: which of them are meant by a text, what the robot lacks for them, and how one is drawn.
 *
 * @import {HfsmCanvas} from "../canvas/canvas.js"
 * @import {Point} from "../measures/geometry.js"
 * @import {ReadyState, State} from "../data/protocol.js"
 * @typedef {{point?: Point, after?: State}} Where `after` is a state from which a transition leads to it
 */

import {freePlace} from "../canvas/tools.js";
import * as commands from "../data/commands.js";
import {holdKeys} from "../kit/waiting-keys.js";
import {notifyError} from "../kit/notices.js";
import {triggerFrom} from "../data/outline.js";
import {page} from "../data/page.js";
import {lackingOf} from "../data/robot.js";
import {store} from "../data/store.js";
import {containsWords, folded, language, t, translated} from "../kit/texts.js";

const SENTENCE = /(?<=[.!?]) /; // ends before its space
const BESIDE = 190; // pixels from a state to one that is drawn after it

/** The names for people of the parts that a robot needs for a servant. @type {Record<string, string>} */
const PARTS = {
  Camera: t("camera"),
  Head: t("head that turns"),
  Hearing: t("ears"),
  Leds: t("lights"),
  Motions: t("motions"),
  Postures: t("postures"),
  Sight: t("eyes"),
  Sounds: t("loudspeaker"),
  Speech: t("voice"),
  Touch: t("touch sensors"),
  Walk: t("legs or wheels"),
};

/** What the robot lacks for a ready state, in words; nothing while there is no robot. @param {ReadyState} ready */
export function lacking({needs, postures}) {
  const missing = lackingOf(needs).map((identity) => PARTS[identity] ?? identity);
  const known = store.robot.serves.includes("Postures") ? store.robot.postures : [];
  if (known.length)
    missing.push(...postures.filter((name) => !known.includes(name)).map((name) => t("posture {name}", {name})));
  return missing.length ? t("this robot has no {parts}", {parts: missing.join(t(" and no "))}) : "";
}

/** What the server has, and the same in the language of the page. @type {{of: ReadyState[], all: ReadyState[]}} */
let known = {of: [], all: []};

/** All ready states, in the language of the page. */
export function readyStates() {
  if (known.of !== store.shelf) known = {of: store.shelf, all: store.shelf.map(inLanguage)};
  return known.all;
}

/** A ready state in the language of the page; it is found by its English words, too. @param {ReadyState} ready */
function inLanguage(ready) {
  if (language === "en") return ready;
  const text = translated(ready.text);
  return {
    ...ready,
    text,
    title: translated(ready.title),
    category: translated(ready.category),
    summary: text.split(SENTENCE, 1)[0],
    words: `${translated(ready.words)} ${ready.words} ${ready.title}`,
    inputs: ready.inputs.map((each) => ({...each, description: translated(each.description)})),
    outputs: ready.outputs.map((each) => ({...each, description: translated(each.description)})),
  };
}

/** The ready states that contain all words of a text, the best first. @param {string} text */
export function findReady(text) {
  const sought = folded(text);
  /** @param {ReadyState} ready */
  const rank = ({title, words: others}) => {
    const name = folded(title);
    return [name.startsWith(sought), name.includes(sought), folded(others).includes(sought), true].indexOf(true);
  };
  const found = readyStates().filter(({title, category, summary, words}) =>
    containsWords(`${title} ${category} ${summary} ${words}`, text),
  );
  return sought ? found.sort((one, other) => rank(one) - rank(other)) : found;
}

/** Whether a ready state can be drawn into what is shown. @param {HfsmCanvas} canvas */
export const canDraw = (canvas) => Boolean(page.document) && !canvas.readOnly;

/**
 * Draw a ready state, and let its first parameter be typed; at a free place in the middle, if none is given.
 *
 * @param {HfsmCanvas} canvas @param {ReadyState} ready @param {Where} [where]
 */
export async function drawReady(canvas, ready, {point, after} = {}) {
  if (!canDraw(canvas)) {
    notifyError(new Error(t("Nothing can be drawn here: open a document of your own.")));
    return;
  }
  if (!page.automaton) await commands.apply("addRoot");
  const place = point ?? freePlace(canvas, after && {x: after.x + BESIDE, y: after.y});
  const [x, y] = [Math.round(place.x), Math.round(place.y)];
  const led = after && {origin: after.id, trigger: triggerFrom(page.shownDocument, page.shownAutomaton, after.id)};
  const where = {automaton: page.shownAutomaton.id, x, y, ...led};
  const asked = commands.askTab("addReady", {...where, state: ready.id, name: ready.title});
  await holdKeys(async () => {
    const done = await asked;
    const id = commands.selectAdded(done, "states");
    if (id === undefined) return undefined;
    page.dispatchEvent(new Event("reveal"));
    canvas.announce(t("{title} is drawn", {title: ready.title}));
    const [first] = ready.inputs;
    const edit = {kind: /** @type {const} */ ("state"), automaton: page.shownAutomaton.id, id, part: "argument"};
    if (first) page.edit({...edit, name: first.name, selects: true});
    else page.dispatchEvent(new Event("focus-canvas"));
    return id;
  });
}
