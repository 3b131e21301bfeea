/**
 * One plot over component time.
 *
 * @import {AlignedData} from "uplot"
 */

import uPlot from "uplot";

import {language} from "../kit/texts.js";
import {monitor} from "./monitor.js";

const HEIGHT = 150; // px
const POINTS = 1500; // points requested from the server
const EVERY = 100; // ms between two drawings

// An exported page contains its modules and also their styles.
if (!import.meta.url.startsWith("data:")) {
  const sheet = document.createElement("link");
  sheet.rel = "stylesheet";
  sheet.href = new URL("../vendor/uplot.css", import.meta.url).href;
  document.head.append(sheet);
}

export class Plot {
  /** Numbers by their names. @type {string[]} */
  names = [];

  /** @type {uPlot | undefined} */
  #chart;
  /** Component times, then the values of each number at them. @type {(number | null)[][]} */
  #data = [[]];
  /** The theme in which it is drawn. @type {string | undefined} */
  #theme = "";
  #drawn = 0;
  #timer = 0;
  #filling = 0;
  #past = monitor.past; // the past to which the data belongs

  /** @param {number} span seconds that are shown @param {(name: string) => string} titleOf */
  constructor(span, titleOf) {
    this.span = span;
    this.titleOf = titleOf;
    this.element = document.createElement("div");
    this.element.className = "plot-chart";
    this.#sizes.observe(this.element);
  }

  #sizes = new ResizeObserver(
    () =>
      this.#chart && this.element.clientWidth && this.#chart.setSize({width: this.element.clientWidth, height: HEIGHT}),
  );

  /** @param {string[]} names */
  choose(names) {
    this.names = names;
    this.#chart?.destroy();
    this.#chart = undefined;
    this.#data = [[], ...names.map(() => [])];
    this.refill();
  }

  /** Request earlier values from the server. */
  async refill() {
    if (!monitor.component || !this.names.length) return this.draw();
    const number = (this.#filling += 1);
    const {names, span} = this;
    const end = monitor.past.end + 1e6;
    const start = monitor.recording ? 0 : Math.max(0, monitor.past.end - span);
    let found;
    try {
      found = await monitor.ask("series", {names, start, end, points: POINTS});
    } catch {
      return undefined; // the component was lost; the next one begins a new plot
    }
    if (number !== this.#filling) return undefined;
    this.#past = monitor.past;
    this.#data = [found.times, ...names.map((name) => found.values[name] ?? found.times.map(() => null))];
    return this.draw();
  }

  /** Add the newest values. @param {Map<string, number>} numbers */
  append(numbers) {
    const time = monitor.newest?.component.time;
    if (time === undefined || !this.names.length) return;
    if (this.#past !== monitor.past) {
      this.#past = monitor.past; // the component was restarted
      this.#data = [[], ...this.names.map(() => [])];
    }
    if ((this.#data[0].at(-1) ?? -Infinity) >= time) return; // already sent by the server
    this.#data[0].push(time);
    this.names.forEach((name, index) => this.#data[index + 1].push(numbers.get(name) ?? null));
    const old = this.#data[0].findIndex((each) => (each ?? 0) >= time - this.span - 1);
    if (old > 200) for (const column of this.#data) column.splice(0, old);
    this.draw();
  }

  /** Draw soon. */
  draw() {
    if (this.#timer) return;
    this.#timer = setTimeout(
      () => {
        this.#timer = 0;
        this.#drawn = performance.now();
        this.#drawNow();
      },
      Math.max(0, this.#drawn + EVERY - performance.now()),
    );
  }

  close() {
    clearTimeout(this.#timer);
    this.#sizes.disconnect();
    this.#chart?.destroy();
  }

  #drawNow() {
    const width = this.element.clientWidth;
    if (!width || !this.names.length) return;
    const theme = document.documentElement.dataset.theme;
    if (this.#theme !== theme) {
      this.#chart?.destroy();
      this.#chart = undefined;
    }
    this.#theme = theme;
    const chart = (this.#chart ??= this.#make(width));
    const at = monitor.snapshot?.component.time ?? 0;
    const end =
      monitor.looking && !monitor.recording
        ? Math.max(at, Math.min(monitor.past.end, at + this.span / 2))
        : monitor.past.end;
    chart.setData(/** @type {AlignedData} */ (this.#data), false);
    chart.batch(() => {
      const start = monitor.recording
        ? monitor.past.start
        : Math.max(Math.min(this.#data[0][0] ?? 0, end), end - this.span);
      chart.setScale("x", {min: start, max: Math.max(end, start + 1)});
    });
  }

  /** @param {number} width */
  #make(width) {
    const style = getComputedStyle(document.documentElement);
    /** @param {string} name */
    const color = (name) => style.getPropertyValue(name).trim();
    const axis = {
      stroke: color("--muted"),
      grid: {stroke: color("--line"), width: 1},
      ticks: {stroke: color("--line"), width: 1},
      font: "11px Inter, system-ui, 'DejaVu Sans', sans-serif",
    };
    const dashes = [[], [7, 4], [2, 3], [10, 3, 2, 3]];
    return new uPlot(
      {
        width,
        height: HEIGHT,
        legend: {show: false},
        cursor: {y: false, points: {size: 5}},
        scales: {x: {time: false}},
        axes: [
          {
            ...axis,
            size: 26,
            values: (_chart, all, _axis, _space, step) =>
              all.map((each) => `${(+each.toFixed(step < 1 ? 2 : 1)).toLocaleString(language)} s`),
          },
          {...axis, size: 52},
        ],
        series: [
          {},
          ...this.names.map((name, index) => ({
            label: this.titleOf(name),
            stroke: color(`--line-${index % 8}`),
            width: 1.6,
            dash: dashes[Math.floor(index / 2) % 4],
            points: {show: false},
            spanGaps: false,
            paths: uPlot.paths.stepped?.({align: 1}),
          })),
        ],
        hooks: {draw: [(chart) => this.#drawMoment(chart, color("--select"))]},
      },
      /** @type {AlignedData} */ (this.#data),
      this.element,
    );
  }

  /** Mark the shown moment of the past, if any. @param {uPlot} chart @param {string} color */
  #drawMoment(chart, color) {
    if (!monitor.looking) return;
    const x = chart.valToPos(monitor.looking.component.time, "x", true);
    const {ctx, bbox} = chart;
    ctx.save();
    ctx.strokeStyle = color;
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }
}
