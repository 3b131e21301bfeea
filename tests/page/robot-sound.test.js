import assert from "node:assert/strict";
import {beforeEach, test} from "node:test";

import {STATIC} from "./page.js";

/** What was asked of the browser. @type {[string, ...unknown[]][]} */
const asked = [];
const parameter = {setValueAtTime() {}, linearRampToValueAtTime() {}, setTargetAtTime() {}, value: 1};
let time = 2;

class AudioContext {
  destination = {};

  /** @param {{sampleRate?: number}} [options] */
  constructor({sampleRate = 48000} = {}) {
    this.sampleRate = sampleRate;
  }

  get currentTime() {
    return time;
  }

  async resume() {}

  async close() {
    asked.push(["close"]);
  }

  createGain() {
    const setTargetAtTime = (/** @type {number} */ value) => this.sampleRate < 48000 && asked.push(["fade", value]);
    return {gain: {...parameter, setTargetAtTime}, connect: (/** @type {unknown} */ to) => to};
  }

  createBuffer(/** @type {number} */ channels, /** @type {number} */ length, /** @type {number} */ rate) {
    assert.deepEqual([channels, rate], [1, this.sampleRate]);
    return {
      samples: new Float32Array(length),
      copyToChannel(/** @type {Float32Array} */ all) {
        this.samples.set(all);
      },
    };
  }

  createBufferSource() {
    return {
      buffer: {samples: new Float32Array()},
      connect() {},
      start(/** @type {number} */ at) {
        asked.push(["samples", [...this.buffer.samples], at]);
      },
    };
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

/** The samples of a sound that stand at a place of it. */
function block(/** @type {number} */ count, /** @type {number} */ place, samples = [0, 16384, -32768]) {
  const bytes = new Uint8Array(16 + 2 * samples.length);
  bytes.set(new Uint8Array(Float64Array.of(count, place).buffer));
  bytes.set(new Uint8Array(Int16Array.from(samples).buffer), 16);
  return bytes.buffer;
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

const {Loudspeaker, SILENT, silenced} = await import(new URL("robot3d/robot-sound.js", STATIC).href);

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

/** @type {import("../../visualhfsm/_editor/static/robot3d/robot-sound.js").Loudspeaker} */
let loudspeaker;

beforeEach(() => {
  localStorage.setItem("visualhfsm.sound", "on");
  loudspeaker = new Loudspeaker();
  asked.length = 0;
  time = 2;
});

/** When samples were to be heard, to the hundredth of a second. */
const played = () => asked.filter(([what]) => what === "samples").map(([, , at]) => Math.round(100 * Number(at)) / 100);
const SONG = {...SILENT, sound: "song", loudness: 1, counts: [0, 1], ages: [null, 0.3]};

test("blocks of samples are heard at their places, and what is lost is silent", () => {
  loudspeaker.hear(SONG);
  for (const [at, place] of [
    [2, 0],
    [2.3, 4000],
    [2.75, 12000],
  ]) {
    time = at;
    loudspeaker.hearSamples(block(1, place));
  }
  assert.deepEqual(played(), [2.2, 2.45, 2.95]);
  assert.deepEqual(asked[0][1], [0, 0.5, -1]);
});

test("what was paused is heard on, and of what comes too fast the newest", () => {
  loudspeaker.hear(SONG);
  loudspeaker.hearSamples(block(1, 4000));
  time = 9;
  loudspeaker.hearSamples(block(1, 8000));
  assert.deepEqual(played(), [2.2, 9.2]);
  for (const place of [12000, 16000, 20000]) loudspeaker.hearSamples(block(1, place));
  assert.deepEqual(played(), [2.2, 9.2, 9.45, 9.7, 9.2]);
});

test("samples are silent once their sound has ended, and those of the next come before it is known", () => {
  loudspeaker.hear(SONG);
  loudspeaker.hearSamples(block(1, 0));
  loudspeaker.hear(silenced(SONG));
  assert.deepEqual(asked.at(-1), ["fade", 0]);
  asked.length = 0;
  loudspeaker.hearSamples(block(1, 4000)); // it was on its way
  assert.deepEqual(asked, []);
  loudspeaker.hearSamples(block(2, 0));
  assert.deepEqual(played(), [2.2]);
  loudspeaker.hear({...SONG, counts: [0, 2]});
  assert.equal(asked.length, 1);
  loudspeaker.hear({...BEEP, counts: [0, 3]});
  assert.ok(asked.some(([what]) => what === "fade"));
});

test("samples are silent when it is switched off, or closed", () => {
  loudspeaker.hear(SONG);
  loudspeaker.hearSamples(block(1, 0));
  loudspeaker.toggle();
  assert.deepEqual(asked.at(-1), ["fade", 0]);
  asked.length = 0;
  loudspeaker.hearSamples(block(1, 4000));
  assert.deepEqual(asked, []);
  loudspeaker.toggle();
  loudspeaker.hearSamples(block(1, 8000));
  loudspeaker.close();
  assert.deepEqual(
    asked.map(([what]) => what),
    ["samples", "fade", "close", "close"],
  );
});

test("a sound plays its tones one after the other, once, and rests are silent", () => {
  for (let again = 0; again < 3; again++) loudspeaker.hear(BEEP);
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
