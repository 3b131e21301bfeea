/** The angles or places of the joints within their limits, and the health of the robot's server. */

import {html, nothing} from "lit";

import {decimal, n, t} from "../kit/texts.js";
import {MonitorElement, whyUnknown} from "../run/element.js";
import {monitor} from "../run/monitor.js";
import {spokenAngle, spokenPlace} from "../run/values.js";

const NEAR = 0.05; // part of the range from a limit

class Joints extends MonitorElement {
  render() {
    const {joints = {}, sliding = [], health} = monitor.snapshot?.robot ?? {};
    const names = Object.keys(joints);
    return html`<div class="live-values">
      ${health ? this.#health(health) : nothing}
      ${
        names.length
          ? html`<table class="joints" aria-label=${t("Joints of the robot")}>
              <tbody>
                ${names.map((name) => this.#row(name, joints[name], sliding.includes(name) ? spokenPlace : spokenAngle))}
              </tbody>
            </table>`
          : html`<p class="empty">
              ${monitor.recording ? t("This recording does not contain the joints.") : whyUnknown()}
            </p>`
      }
    </div>`;
  }

  /** @param {string} name @param {number} value @param {(value: number) => string} spoken */
  #row(name, value, spoken) {
    // Those of a joint that turns without end, such as a wheel, are null.
    const {lower, upper, maxTorque} = monitor.robot.limits.get(name) ?? {lower: 0, upper: 0, maxTorque: 1};
    const part = upper > lower ? (value - lower) / (upper - lower) : undefined;
    const near = part !== undefined && (part < NEAR || part > 1 - NEAR);
    return html`<tr>
      <th scope="row">${name}${maxTorque === 0 ? html` <small>${t("no motor")}</small>` : nothing}</th>
      <td>
        ${
          part === undefined
            ? nothing
            : html`<svg
                class="joint-bar"
                viewBox="0 0 200 12"
                preserveAspectRatio="none"
                role="img"
                aria-label=${t("between {lower} and {upper}", {lower: spoken(lower), upper: spoken(upper)})}
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
      <td class="number ${near ? "near" : ""}" title=${near ? t("near its limit") : ""}>${spoken(value)}</td>
    </tr>`;
  }

  /** @param {import("../data/protocol.js").HealthReport} health */
  #health({realTimeFactor, lag, torsoTilt, fallen, cameraRates, limitedCommands, velocityTimeouts}) {
    const rates = Object.entries(cameraRates ?? {}).filter(([, rate]) => rate > 0); // cameras that are in use
    const facts = [
      [t("Real time factor"), decimal(realTimeFactor, 2)],
      [t("Lag"), `${decimal(lag * 1000, 0)} ms`],
      [t("Tilt of the torso"), spokenAngle(torsoTilt)],
      [t("Commands limited"), limitedCommands],
      [t("Velocities timed out"), velocityTimeouts],
      ...rates.map(([name, rate]) => [name, n("{count} image/s", "{count} images/s", Math.round(rate))]),
    ];
    return html`${fallen ? html`<p class="fallen" role="alert">${t("The robot has fallen.")}</p>` : nothing}
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
