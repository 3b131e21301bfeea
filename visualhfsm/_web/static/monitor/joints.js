/** The angles or places of the joints within their limits, and the health of the robot's server. */

import {html, nothing} from "lit";

import {MonitorElement, whyUnknown} from "./element.js";
import {monitor} from "./monitor.js";
import {spokenAngle, spokenPlace} from "./values.js";

const NEAR = 0.05; // part of the range from a limit

class Joints extends MonitorElement {
  render() {
    const {joints = {}, sliding = [], health} = monitor.snapshot?.robot ?? {};
    const names = Object.keys(joints);
    return html`<div class="live-values">
      ${health ? this.#health(health) : nothing}
      ${
        names.length
          ? html`<table class="joints" aria-label="Joints">
              <tbody>
                ${names.map((name) => this.#row(name, joints[name], sliding.includes(name) ? spokenPlace : spokenAngle))}
              </tbody>
            </table>`
          : html`<p class="empty">
              ${monitor.recording ? "This recording does not contain the joints." : whyUnknown()}
            </p>`
      }
    </div>`;
  }

  /** @param {string} name @param {number} value @param {(value: number) => string} spoken */
  #row(name, value, spoken) {
    // Those of a joint that turns without end, such as a wheel, are null.
    const {lower, upper} = monitor.robot.limits.get(name) ?? {lower: 0, upper: 0};
    const part = upper > lower ? (value - lower) / (upper - lower) : undefined;
    const near = part !== undefined && (part < NEAR || part > 1 - NEAR);
    return html`<tr>
      <th scope="row">${name}</th>
      <td>
        ${
          part === undefined
            ? nothing
            : html`<svg
                class="joint-bar"
                viewBox="0 0 200 12"
                preserveAspectRatio="none"
                role="img"
                aria-label="between ${spoken(lower)} and ${spoken(upper)}"
              >
                <rect class="track" y="4.500" width="200" height="3" rx="1.500"></rect>
                <rect
                  class="place ${near ? "near" : ""}"
                  x=${Math.min(196, Math.max(0, part * 200 - 2))}
                  width="4"
                  height="12"
                  rx="2"
                ></rect>
              </svg>`
        }
      </td>
      <td class="number ${near ? "near" : ""}" title=${near ? "near its limit" : ""}>${spoken(value)}</td>
    </tr>`;
  }

  /** @param {import("../protocol.js").HealthReport} health */
  #health({realTimeFactor, lag, torsoTilt, fallen, cameraRates, limitedCommands, velocityTimeouts}) {
    const rates = Object.entries(cameraRates ?? {}).filter(([, rate]) => rate > 0); // cameras that are in use
    const facts = [
      ["Real time factor", realTimeFactor.toFixed(2)],
      ["Lag", `${(lag * 1000).toFixed(0)} ms`],
      ["Tilt of the torso", spokenAngle(torsoTilt)],
      ["Commands limited", limitedCommands],
      ["Velocities timed out", velocityTimeouts],
      ...rates.map(([name, rate]) => [name, `${rate.toFixed(0)} images/s`]),
    ];
    return html`${fallen ? html`<p class="fallen" role="alert">The robot has fallen.</p>` : nothing}
      <dl class="health">
        ${facts.map(
          ([name, value]) =>
            html`<div>
              <dt>${name}</dt>
              <dd>${value}</dd>
            </div>`,
        )}
      </dl>`;
  }
}

customElements.define("hfsm-joints", Joints);
