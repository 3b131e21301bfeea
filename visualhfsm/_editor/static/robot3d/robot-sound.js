/**
 * What the robot says and plays, as tones, samples and a voice of the browser, if somebody wants to hear it.
 *
 * @typedef {object} Heard
 * @property {string} says the text that is being said; "" while none is
 * @property {string} sound the name of the sound that is played; "" while none is
 * @property {[number, number][]} tones of that sound, each in Hz (0 for a rest) and s; none of samples
 * @property {number} loudness of that sound, from 0 to 1
 * @property {[number, number]} counts how many texts and how many sounds were begun
 * @property {[number | null, number | null]} ages s since the text and the sound began; null where that is unknown
 */

import {browserStorage} from "../kit/location.js";
import {language} from "../kit/texts.js";
import {SampledSound} from "./sampled-sound.js";

const KEPT = "visualhfsm.sound";
const LOUDEST = 0.25; // of what the browser can play: a tone is loud
const RAMP = 0.008; // s in which a tone begins and ends, so that it does not click
const FADE = 0.05; // s in which a sound ends early
const JUST = 0.25; // s since the begin of a sound that is played from its begin, and not from where it is
const MISSED = 1; // s since the begin of a text that is said; of a later one the rest is unknown

/** A robot that is silent, and has begun nothing. @type {Heard} */
export const SILENT = {says: "", sound: "", tones: [], loudness: 0, counts: [0, 0], ages: [null, null]};

/** What is heard once the robot has fallen silent. @param {Heard} heard @returns {Heard} */
export const silenced = ({counts}) => ({...SILENT, counts});

/** Plays what the robot plays, and says what it says, while it is on. */
export class Loudspeaker {
  /** Whether the user wants to hear it, which the browser keeps. */
  on = browserStorage.getItem(KEPT) === "on";
  #heard = SILENT;
  /** @type {AudioContext | undefined} */
  #context;
  /** What plays now. @type {{gain: GainNode, tones: OscillatorNode[]} | undefined} */
  #playing;
  #sampled = new SampledSound();
  /** Whether the browser says something for it. */
  #speaks = false;

  toggle() {
    this.on = !this.on;
    browserStorage.setItem(KEPT, this.on ? "on" : "off");
    if (this.on) {
      void this.#sounding().resume(); // browsers let a page be heard once somebody clicked
      this.#sampled.resume();
    } else this.#hush();
  }

  /** Play what has begun, and end what has ended. @param {Heard} heard */
  hear(heard) {
    const [texts, sounds] = this.#heard.counts;
    this.#heard = heard;
    if (!this.on) return;
    if (this.#sampled.count <= this.#ended) this.#sampled.stop();
    if (!heard.sound || heard.counts[1] !== sounds) this.#stop();
    if (heard.sound && heard.counts[1] !== sounds) this.#play(heard);
    if (!heard.says || heard.counts[0] !== texts) this.#fallSilent();
    if (heard.says && heard.counts[0] !== texts && (heard.ages[0] ?? Infinity) < MISSED) this.#say(heard.says);
  }

  /** Play samples of a sound, unless it has ended. @param {ArrayBuffer} block its count, the place of the samples, they */
  hearSamples(block) {
    const [count, place] = new Float64Array(block, 0, 2);
    if (this.on && count > this.#ended) this.#sampled.play(count, place, new Int16Array(block, 16));
  }

  close() {
    this.#hush();
    this.#sampled.close();
    void this.#context?.close();
    this.#context = undefined;
  }

  /** The count of the newest sound that has ended. Samples of the next may arrive before what is said of it. */
  get #ended() {
    return this.#heard.counts[1] - (this.#heard.sound ? 1 : 0);
  }

  #sounding() {
    return (this.#context ??= new AudioContext());
  }

  /** Play the tones of a sound, or the rest of those that others have heard so far. @param {Heard} heard */
  #play({tones, loudness, ages: [, age]}) {
    if (age === null || !tones.length) return;
    const context = this.#sounding();
    void context.resume();
    const all = context.createGain();
    all.gain.value = loudness * LOUDEST;
    all.connect(context.destination);
    this.#playing = {gain: all, tones: []};
    const now = context.currentTime;
    let begin = age < JUST ? now : now - age;
    for (const [frequency, seconds] of tones) {
      const end = begin + seconds;
      if (frequency && end > now) this.#playing.tones.push(tone(context, all, frequency, Math.max(begin, now), end));
      begin = end;
    }
  }

  #stop() {
    if (!this.#playing) return;
    const {gain, tones} = this.#playing;
    this.#playing = undefined;
    const now = this.#sounding().currentTime;
    gain.gain.setTargetAtTime(0, now, FADE / 5);
    for (const each of tones) each.stop(now + FADE);
  }

  /** @param {string} text */
  #say(text) {
    if (!globalThis.speechSynthesis) return;
    const words = new SpeechSynthesisUtterance(text);
    words.lang = language;
    this.#speaks = true;
    speechSynthesis.speak(words);
  }

  #fallSilent() {
    if (this.#speaks) speechSynthesis.cancel();
    this.#speaks = false;
  }

  #hush() {
    this.#stop();
    this.#sampled.stop();
    this.#fallSilent();
  }
}

/**
 * Play a tone between two times of a context.
 *
 * @param {AudioContext} context
 * @param {AudioNode} output
 * @param {number} frequency in Hz
 * @param {number} begin
 * @param {number} end
 */
function tone(context, output, frequency, begin, end) {
  const oscillator = context.createOscillator();
  const gain = context.createGain();
  const ramp = Math.min(RAMP, (end - begin) / 2);
  oscillator.frequency.value = frequency;
  gain.gain.setValueAtTime(0, begin);
  gain.gain.linearRampToValueAtTime(1, begin + ramp);
  gain.gain.setValueAtTime(1, end - ramp);
  gain.gain.linearRampToValueAtTime(0, end);
  oscillator.connect(gain).connect(output);
  oscillator.start(begin);
  oscillator.stop(end);
  return oscillator;
}
