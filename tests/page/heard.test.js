import assert from "node:assert/strict";
import {beforeEach, test} from "node:test";

import {STATIC} from "./page.js";

/** What was asked of the browser. @type {[string, ...unknown[]][]} */
const asked = [];
const parameter = {setValueAtTime() {}, linearRampToValueAtTime() {}, setTargetAtTime() {}, value: 1};

class AudioContext {
  currentTime = 2;
  destination = {};

  async resume() {}

  async close() {
    asked.push(["close"]);
  }

  createGain() {
    return {gain: {...parameter}, connect: (/** @type {unknown} */ to) => to};
  }

  createOscillator() {
    const frequency = {value: 0};
    return {
      frequency,
      connect: (/** @type {unknown} */ to) => to,
      start: (/** @type {number} */ at) => asked.push(["start", frequency.value, at]),
      stop: (/** @type {number} */ at) => asked.push(["stop", frequency.value, at]),
    };
  }
}

class SpeechSynthesisUtterance {
  lang = "";

  /** @param {string} text */
  constructor(text) {
    this.text = text;
  }
}

const speechSynthesis = {
  speak: (/** @type {SpeechSynthesisUtterance} */ {text, lang}) => asked.push(["speak", text, lang]),
  cancel: () => asked.push(["cancel"]),
};
Object.assign(globalThis, {AudioContext, SpeechSynthesisUtterance, speechSynthesis});

const {Loudspeaker, SILENT, silenced} = await import(new URL("robot3d/heard.js", STATIC).href);

const BEEP = {
  ...SILENT,
  sound: "beep",
  tones: [
    [440, 0.5],
    [0, 0.25],
    [880, 0.5],
  ],
  loudness: 1,
  counts: [0, 1],
  ages: [null, 0.03],
};
const GOAL = {...SILENT, says: "Goal!", counts: [1, 0], ages: [0.03, null]};

/** @type {import("../../visualhfsm/_editor/static/robot3d/heard.js").Loudspeaker} */
let loudspeaker;

beforeEach(() => {
  localStorage.setItem("visualhfsm.sound", "on");
  loudspeaker = new Loudspeaker();
  asked.length = 0;
});

test("a sound plays its tones one after the other, once, and rests are silent", () => {
  for (let time = 0; time < 3; time++) loudspeaker.hear(BEEP);
  assert.deepEqual(
    asked.filter(([what]) => what === "start"),
    [
      ["start", 440, 2],
      ["start", 880, 2.75],
    ],
  );
});

test("what ends early is stopped, and the next one is played", () => {
  loudspeaker.hear(BEEP);
  asked.length = 0;
  loudspeaker.hear(silenced(BEEP));
  assert.deepEqual(
    asked.map(([what, frequency]) => [what, frequency]),
    [
      ["stop", 440],
      ["stop", 880],
    ],
  );
  asked.length = 0;
  loudspeaker.hear(BEEP); // shown again, such as after looking back: it did not begin again
  assert.deepEqual(asked, []);
  loudspeaker.hear({...BEEP, counts: [0, 2]});
  assert.equal(asked.filter(([what]) => what === "start").length, 2);
});

test("a text is said in the language of the page, and no more once the robot is silent", () => {
  loudspeaker.hear(GOAL);
  loudspeaker.hear(GOAL);
  assert.deepEqual(asked, [["speak", "Goal!", "en"]]);
  loudspeaker.hear(silenced(GOAL));
  assert.deepEqual(asked.at(-1), ["cancel"]);
});

test("it is off at first, and what is chosen is kept", () => {
  localStorage.setItem("visualhfsm.sound", "");
  const another = new Loudspeaker();
  another.hear(BEEP);
  another.hear(GOAL);
  assert.deepEqual(asked, []);
  another.toggle();
  assert.ok(new Loudspeaker().on);
  another.toggle();
  assert.ok(!new Loudspeaker().on);
});

test("when the view closes, everything ends", () => {
  loudspeaker.hear({...BEEP, says: "Goal!", counts: [1, 1], ages: [0, 0]});
  asked.length = 0;
  loudspeaker.close();
  assert.deepEqual(
    asked.map(([what]) => what),
    ["stop", "stop", "cancel", "close"],
  );
});

test("of a sound that has begun before, the rest is played", () => {
  loudspeaker.hear({...BEEP, ages: [null, 0.3]});
  const times = asked.map(([what, frequency, at]) => [what, frequency, Math.round(Number(at) * 100) / 100]);
  assert.deepEqual(times, [
    ["start", 440, 2],
    ["stop", 440, 2.2],
    ["start", 880, 2.45],
    ["stop", 880, 2.95],
  ]);
  asked.length = 0;
  loudspeaker.hear({...BEEP, counts: [0, 2], ages: [null, 1]});
  assert.deepEqual(
    asked.filter(([what]) => what === "start"),
    [["start", 880, 2]],
  );
});

test("what began before anybody listened is not played, and a text is not said from its middle", () => {
  loudspeaker.hear({...BEEP, ages: [null, null]});
  loudspeaker.hear({...GOAL, counts: [1, 1], ages: [null, null]});
  loudspeaker.hear({...GOAL, counts: [2, 1], ages: [3, null]});
  assert.deepEqual(asked, []);
  loudspeaker.hear({...GOAL, counts: [3, 1], ages: [0.1, null]});
  assert.deepEqual(asked, [["speak", "Goal!", "en"]]);
});
