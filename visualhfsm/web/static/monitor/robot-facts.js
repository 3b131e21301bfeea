/** What does not change of a robot: the limits of its joints, and its cameras. */

const AGAIN = 2000; // ms after which what is missing is asked for anew

export class RobotFacts {
  /** Limits of the joints by name. @type {Map<string, {name: string, lower: number, upper: number}>} */
  limits = new Map();
  /** @type {string[]} */
  cameras = [];

  #asked = -Infinity;

  /** @param {{limits: object[], cameras: string[]}} [facts] as the server tells them */
  take(facts) {
    this.limits = new Map((facts?.limits ?? []).map((each) => [each.name, each]));
    this.cameras = facts?.cameras ?? [];
  }

  /** Ask for what is missing of a robot that is there, now and then. @param {() => Promise<object>} ask @returns {Promise<boolean>} whether it came */
  async complete(ask) {
    if (this.limits.size || performance.now() - this.#asked < AGAIN) return false;
    this.#asked = performance.now();
    try {
      this.take(await ask());
      return true;
    } catch {
      return false; // a later moment asks again
    }
  }
}
