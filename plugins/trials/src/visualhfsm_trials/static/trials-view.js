/**
 * A series of trials: how often it succeeds, what that depends on, and how it fails.
 *
 * @import {Dependence, Histogram, Origin, Rate, Trial, PlaceMap, TrialsView, TrialTimeline} from "./messages.js"
 * @import {FailureView} from "./messages.js"
 */

import {LitElement, html, nothing, repeat, svg} from "lit";
import {decimal, n, rich, t} from "visualhfsm/kit/texts.js";
import {percent, short} from "./figures.js";

const WIDTH = 300; // of a plot, in its own units
const HEIGHT = 84;
const MARGIN = 0.3; // m around the places of a map
const MOST_COLORS = 8; // of states in a timeline
const MOST_STEPS = 4; // between the counts on the axis of a histogram

/** How many trials were asked for, one time after the other. @param {readonly number[]} looks */
const sequence = (looks) => looks.join(", ");

/** @param {Rate} share */
const rate = ({successes, trials}) => (trials ? successes / trials : 0);

/**
 * The event `trial` has the number of a trial whose run somebody wants to see; there is one only where trials `open`.
 */
export class HfsmTrials extends LitElement {
  static properties = {view: {attribute: false}, opens: {attribute: false}, busy: {attribute: false}};

  constructor() {
    super();
    /** @type {TrialsView | null} */
    this.view = null;
    /** Whether the run of a trial can be shown. */
    this.opens = false;
    /** Whether one is about to be shown. */
    this.busy = false;
  }

  createRenderRoot() {
    return this;
  }

  render() {
    const {view} = this;
    if (!view) return html`<p class="empty">${t("There are no trials yet.")}</p>`;
    const {share, planned, looks, histograms, dependences, maps, ways, worst, origin, equal, fromStart} = view;
    if (!share.trials)
      return html`<p class="empty" role="status">${t("None of {planned} trials has ended yet.", {planned})}</p>`;
    return html`
      <section class="trials-rate" aria-label=${t("Success")}>
        <p class="rate-figure">${percent(rate(share))}</p>
        <div>
          <p>
            ${rich("{share} trials succeed", {
              share: html`<b>${t("{successes} of {trials}", {successes: share.successes, trials: share.trials})}</b>`,
            })}${
              planned > share.trials
                ? n("; {count} is still to come", "; {count} are still to come", planned - share.trials)
                : ""
            }
          </p>
          <p class="muted">
            ${t("The true rate is between {lowest} and {highest}, with a confidence of 95 %.", {
              lowest: percent(share.lowest),
              highest: percent(share.highest),
            })}
          </p>
          ${fromStart ? html`<p><b>${t("Success is true from the start in {count} of {trials}: that says nothing.", {count: fromStart, trials: share.trials})}</b></p>` : nothing}
          ${equal ? html`<p><b>${t("The {count} trials are equal: they say as much as one.", {count: share.trials})}</b></p>` : nothing}
          ${share.trials < SMALL ? html`<p class="muted">${t("Fewer than {count} trials say little.", {count: SMALL})}</p>` : nothing}
          ${
            looks.length > 1
              ? html`<p class="muted">
                  ${t("Trials were added after a look ({looks}): the interval is that of a single look.", {looks: sequence(looks)})}
                </p>`
              : nothing
          }
        </div>
        <p class="trials-legend">${sign("good", t("succeed"))} ${sign("bad", t("fail"))}</p>
        ${shareBar(share)}
      </section>
      ${ways.length ? this.#section(t("How it fails"), [this.#ways(ways), otherWays(share, ways)]) : nothing}
      ${maps.length ? this.#section(t("Where"), html`<div class="trials-plots">${maps.map((map) => this.#map(map))}</div>`) : nothing}
      ${dependences.length ? this.#section(t("What success depends on"), [html`<div class="trials-plots">${dependences.map(dependencePlot)}</div>`, chance(dependences)]) : nothing}
      ${histograms.length ? this.#section(t("Numbers"), [html`<div class="trials-plots">${histograms.map(histogramPlot)}</div>`, ofSuccess(share)]) : nothing}
      ${worst.length ? this.#section(equal ? t("Each of them") : t("The worst trials"), this.#worst(worst)) : nothing}
      ${origin ? this.#section(t("How it was measured"), originTable(origin, looks)) : nothing}
    `;
  }

  /** The rows keep their identity while trials run, so that an open one stays open. @param {FailureView[]} ways */
  #ways(ways) {
    return repeat(
      ways,
      ({reason, states}) => `${states} ${reason}`,
      ({reason, states, count, numbers, timeline}) =>
        html`<details class="way">
          <summary>
            <b>${count}</b>
            ${reason}${states ? html` <span class="muted">${t("in {states}", {states})}</span>` : nothing}
          </summary>
          <p class="muted">
            ${rich("Trials {numbers}. Trial {number}:", {
              numbers: [
                numbers.map((number, index) => [index ? ", " : "", this.#link(number)]),
                count > numbers.length ? ", …" : "",
              ],
              number: timeline.number,
            })}
          </p>
          ${timelineOf(timeline)}
        </details>`,
    );
  }

  /** @param {Trial[]} trials */
  #worst(trials) {
    return repeat(
      trials,
      ({number}) => number,
      ({number, success, reason, time, values, timeline, page}) =>
        html`<div class="way-row">
          <details class="way ${success ? "good" : "bad"}">
            <summary>
              <b>${number}</b>
              ${success ? t("succeeds after {seconds} s", {seconds: short(time)}) : t("{reason} at {seconds} s", {reason, seconds: short(time)})}
            </summary>
            <dl>
              ${values.map(
                ([name, value]) =>
                  html`<div>
                    <dt>${name}</dt>
                    <dd>${value}</dd>
                  </div>`,
              )}
            </dl>
            ${timelineOf(timeline)}
          </details>
          ${page ? html`<a href=${page}>${t("open its recording")}</a>` : this.opens ? this.#link(number, t("look back")) : nothing}
        </div>`,
    );
  }

  /** @param {number} number */
  #link(number, words = String(number)) {
    if (!this.opens) return words;
    return html`<button
      type="button"
      class="link"
      title=${t("Run trial {number} again, and look back at it", {number})}
      ?disabled=${this.busy}
      @click=${() => this.#open(number)}
    >
      ${words}
    </button>`;
  }

  /** @param {number} number */
  #open(number) {
    if (!this.busy) this.dispatchEvent(new CustomEvent("trial", {detail: number}));
  }

  /** Places on the floor, seen from above: x to the right, y up. @param {PlaceMap} map */
  #map({thing, places, trials, lines}) {
    const xs = [...places.map(([x]) => x), ...lines.flatMap(([x, , end]) => [x, end])];
    const ys = [...places.map(([, y]) => y), ...lines.flatMap(([, y, , end]) => [y, end])];
    if (!xs.length) return nothing;
    const [left, right] = [Math.min(...xs) - MARGIN, Math.max(...xs) + MARGIN];
    const [low, high] = [Math.min(...ys) - MARGIN, Math.max(...ys) + MARGIN];
    const size = Math.max(right - left, high - low) / 110;
    const failed = places.filter(([, , success]) => !success).length;
    const counts = {succeeded: places.length - failed, failed, shown: places.length, trials};
    return html`<figure>
      <figcaption>
        <b>${thing}</b>
        <span class="muted"
          >${
            places.length < trials
              ? t("{succeeded} succeed, {failed} fail, {shown} of {trials} are shown", counts)
              : t("{succeeded} succeed, {failed} fail", counts)
          }</span
        >
      </figcaption>
      <svg
        class="trials-map ${this.opens ? "opens" : ""}"
        viewBox="${left} ${-high} ${right - left} ${high - low}"
        role="img"
        aria-label=${t("Places of {thing}", {thing})}
        @click=${this.opens ? this.#clickPlace : nothing}
      >
        <path class="floor-line" d=${lines.map(([x, y, endX, endY]) => `M${x} ${-y}L${endX} ${-endY}`).join("")}></path>
        ${places.map(
          ([x, y, success, number]) =>
            svg`<g transform="translate(${x} ${-y})" data-number=${number}><title>${success ? t("trial {number} succeeds from {x}, {y} m", {number, x: short(x), y: short(y)}) : t("trial {number} fails from {x}, {y} m", {number, x: short(x), y: short(y)})}</title>
            ${success ? svg`<circle class="good" r=${size}></circle>` : svg`<path class="bad-cross" d="M${-size} ${-size}L${size} ${size}M${size} ${-size}L${-size} ${size}"></path>`}</g>`,
        )}
      </svg>
    </figure>`;
  }

  /** @param {Event & {target: Element}} event */
  #clickPlace = ({target}) => {
    const place = target.closest("[data-number]");
    if (place instanceof SVGElement) this.#open(Number(place.dataset.number));
  };

  /** @param {string} title @param {unknown} content */
  #section(title, content) {
    return html`<section class="trials-part" aria-label=${title}>
      <h2>${title}</h2>
      ${content}
    </section>`;
  }
}

customElements.define("hfsm-trials", HfsmTrials);

/** @param {string} kind @param {string} meaning */
const sign = (kind, meaning) =>
  html`<span
    ><svg viewBox="0 0 12 12" aria-hidden="true"><rect class=${kind} width="12" height="12" rx="2"></rect></svg>
    ${meaning}</span
  >`;

/** How many trials fail in ways that are not listed. @param {Rate} share @param {FailureView[]} ways */
function otherWays(share, ways) {
  const others = share.trials - share.successes - ways.reduce((all, {count}) => all + count, 0);
  return others > 0
    ? html`<p class="muted">${n("{count} fails otherwise.", "{count} fail otherwise.", others)}</p>`
    : nothing;
}

/** A rate as a bar, with the interval as a whisker. @param {Rate} share */
function shareBar(share) {
  const label = t("{rate}, between {lowest} and {highest}", {
    rate: percent(rate(share)),
    lowest: percent(share.lowest),
    highest: percent(share.highest),
  });
  return html`<svg class="share-bar" viewBox="0 0 100 10" preserveAspectRatio="none" role="img" aria-label=${label}>
    <rect class="bad" width="100" height="10"></rect>
    <rect class="good" width=${100 * rate(share)} height="10"></rect>
    <path
      class="whisker"
      d="M${100 * share.lowest} 5H${100 * share.highest}M${100 * share.lowest} 2v6M${100 * share.highest} 2v6"
    ></path>
  </svg>`;
}

/** The states of a trial over time, a color each. @param {TrialTimeline} timeline */
function timelineOf({changes, end}) {
  const names = [...new Set(changes.map(([, states]) => states))];
  const length = Math.max(end, 1e-3);
  const spans = changes.map(([start, states], index) => ({start, states, stop: changes[index + 1]?.[0] ?? end}));
  return html`<div class="states-over-time" role="list">
      ${spans.map(
        ({start, stop, states}) =>
          html`<span
            role="listitem"
            class="state-span"
            .style=${`width: ${(100 * (stop - start)) / length}%; --color: var(--line-${names.indexOf(states) % MOST_COLORS})`}
            title=${t("{states}, from {start} s to {stop} s", {
              states,
              start: decimal(start, 2),
              stop: decimal(stop, 2),
            })}
            >${states}</span
          >`,
      )}
    </div>
    <p class="muted between"><span>0 s</span><span>${short(end)} s</span></p>`;
}

/** @param {Histogram} histogram */
function histogramPlot({name, median, lower, upper, edges, good, bad}) {
  const counts = countTicks(Math.max(...good.map((count, index) => count + bad[index])));
  const most = counts[counts.length - 1];
  /** @param {number} count */
  const tall = (count) => (count / most) * HEIGHT;
  const step = WIDTH / good.length;
  const bars = good.map((count, index) => {
    const [high, low] = [tall(count), tall(bad[index])];
    const title = t("{lower} to {upper}: {succeeded} succeed, {failed} fail", {
      lower: short(edges[index]),
      upper: short(edges[index + 1]),
      succeeded: count,
      failed: bad[index],
    });
    return svg`<g><title>${title}</title>
      <rect class="good" x=${index * step + 1} y=${HEIGHT - high} width=${step - 2} height=${high}></rect>
      <rect class="bad" x=${index * step + 1} y=${HEIGHT - high - low} width=${step - 2} height=${low}></rect></g>`;
  });
  return html`<figure>
    <figcaption>
      <b>${name}</b>
      <span class="muted"
        >${t("median {median}, half of them {lower} to {upper}", {
          median: short(median),
          lower: short(lower),
          upper: short(upper),
        })}</span
      >
    </figcaption>
    <div class="histogram">
      <p class="muted counts-of">${t("Trials")}</p>
      <div class="muted counts">${[...counts].reverse().map((count) => html`<span>${count}</span>`)}</div>
      <svg
        viewBox="0 0 ${WIDTH} ${HEIGHT}"
        preserveAspectRatio="none"
        role="img"
        aria-label=${t("Distribution of {name}", {name})}
      >
        <path class="count-line" d=${counts.map((count) => `M0 ${HEIGHT - tall(count)}H${WIDTH}`).join("")}></path>
        ${bars}
        <path class="axis" d="M0 ${HEIGHT}H${WIDTH}"></path>
      </svg>
      <p class="muted between"><span>${short(edges[0])}</span><span>${short(edges[edges.length - 1])}</span></p>
    </div>
  </figure>`;
}

/** Which trials the figures beside the bars are of. @param {Rate} share */
const ofSuccess = ({successes}) =>
  successes
    ? html`<p class="muted">${t("Medians and halves are of the trials that succeed, bars of all.")}</p>`
    : nothing;

/**
 * The counts on the axis of a histogram, evenly from 0 to the first one that no bar is above.
 *
 * @param {number} most trials of a bar
 */
export function countTicks(most) {
  const steps = [1, 2, 5].flatMap((step) => Array.from({length: 7}, (_, power) => step * 10 ** power));
  const step = Math.min(...steps.filter((each) => most <= MOST_STEPS * each));
  return Array.from({length: Math.ceil(most / step) + 1}, (_, index) => index * step);
}

const SMALL = 20; // trials, as in plugins/trials/src/visualhfsm_trials/_statistics.py
const MANY = 10; // parts, as in plugins/trials/src/visualhfsm_trials/_terminal.py

/** What chance does to the parts of the quantities. @param {readonly Dependence[]} dependences */
function chance(dependences) {
  const shares = dependences.flatMap(({parts}) => parts.map(({share}) => share));
  const means = dependences.some(({parts}) => parts.some((part) => part.means.length));
  const words = [
    means ? t("Means are of all trials of a part, failed ones, too.") : "",
    shares.some(({trials}) => trials < SMALL)
      ? t("Parts with fewer than {count} trials may differ by chance.", {count: SMALL})
      : "",
    shares.length >= MANY ? t("Of {count} parts, some differ by chance alone.", {count: shares.length}) : "",
  ].filter(Boolean);
  return words.length ? html`<p class="muted">${words.join(" ")}</p>` : nothing;
}

/** What those need who print the figures. @param {Origin} origin @param {readonly number[]} looks */
function originTable({document, seed, digest, versions, date, commit}, looks) {
  const rows = [
    [t("Document"), document],
    [t("Trials"), sequence(looks)],
    [t("Seed"), seed],
    [t("Digest of plan and files"), digest],
    [t("Commit"), commit],
    [t("Last trial"), date],
    [
      t("Versions"),
      Object.entries(versions)
        .map(([name, version]) => `${name} ${version}`)
        .join(", "),
    ],
    [t("Intervals"), t("Wilson’s, with a confidence of 95 %")],
  ];
  return html`<dl class="trials-origin">
    ${rows.map(([name, value]) =>
      value === ""
        ? nothing
        : html`<dt>${name}</dt>
            <dd>${value}</dd>`,
    )}
  </dl>`;
}

/** Success by the parts of a quantity, and the means of the plan's numbers. @param {Dependence} dependence */
function dependencePlot({name, parts}) {
  const numbers = [...new Set(parts.flatMap(({means}) => means.map(([number]) => number)))];
  const head = html`<thead>
    <tr>
      <td colspan="3"></td>
      ${numbers.map((number) => html`<th scope="col" title=${t("Mean of {number}", {number})}>${number}</th>`)}
    </tr>
  </thead>`;
  return html`<figure>
    <figcaption><b>${name}</b></figcaption>
    <table class="dependence">
      ${numbers.length ? head : nothing}
      <tbody>
        ${parts.map(({label, share, means}) => {
          const mean = new Map(means);
          return html`<tr>
            <th scope="row">${label}</th>
            <td class="rate">${shareBar(share)}</td>
            <td class="muted">${t("{successes} of {trials}", {successes: share.successes, trials: share.trials})}</td>
            ${numbers.map((number) => html`<td>${meanText(mean.get(number))}</td>`)}
          </tr>`;
        })}
      </tbody>
    </table>
  </figure>`;
}

/** @param {number | undefined} mean */
const meanText = (mean) => (mean === undefined ? "" : short(mean));
