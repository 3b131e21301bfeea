/** A sound that arrives as blocks of samples, which are played one after the other. */

const RATE = 16000; // samples a second
const LEAD = 0.2; // s from the arrival of the first block until it is heard: later ones may be late
const MOST_AHEAD = 0.7; // s that may wait to be heard
const FADE = 0.05; // s in which it ends early

/** Plays blocks at their places; what is lost is silent. One at a time. */
export class SampledSound {
  /** The sound that plays, or played last. */
  count = 0;
  /** The browser's own rate would take new samples between ours, and click where blocks meet. @type {AudioContext | undefined} */
  #context;
  /** @type {GainNode | undefined} */
  #output;
  /** When its first sample was due, in samples of the context. */
  #begin = 0;

  resume() {
    void this.#sounding().resume();
  }

  /**
   * Play samples. Those of a robot that was paused begin anew, and so do those of one that is faster than its time.
   *
   * @param {number} count of their sound
   * @param {number} place how many samples of it come before
   * @param {Int16Array} samples
   */
  play(count, place, samples) {
    const context = this.#sounding();
    void context.resume();
    const now = context.currentTime * RATE;
    const ahead = this.#begin + place - now;
    if (!this.#output || count !== this.count || ahead < 0 || ahead > MOST_AHEAD * RATE) {
      this.stop();
      this.count = count;
      this.#begin = Math.ceil(now + LEAD * RATE) - place;
      this.#output = context.createGain();
      this.#output.connect(context.destination);
    }
    const buffer = context.createBuffer(1, samples.length, RATE);
    buffer.copyToChannel(
      Float32Array.from(samples, (sample) => sample / 32768),
      0,
    );
    const source = context.createBufferSource();
    source.buffer = buffer;
    source.connect(this.#output);
    source.start((this.#begin + place) / RATE);
  }

  stop() {
    this.#output?.gain.setTargetAtTime(0, this.#sounding().currentTime, FADE / 5);
    this.#output = undefined;
  }

  close() {
    void this.#context?.close();
    this.#context = this.#output = undefined;
  }

  #sounding() {
    return (this.#context ??= new AudioContext({sampleRate: RATE}));
  }
}
