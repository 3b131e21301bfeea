/** What the signs on the canvas mean while a component is followed. */

import {html, svg} from "lit";

const circle = (kind) => svg`<g class="state ${kind}" transform="translate(15,12)"><circle class="glow" r="10.5"></circle><circle class="body" r="8"></circle></g>`;
const SIGNS = [
  ["current", circle("active")],
  ["ghost: kept while the state above is left", circle("ghost")],
  ["left just before", circle("trail")],
  ["finished", svg`<g class="state active finished" transform="translate(15,12)"><circle class="body" r="8"></circle><path class="finished-sign" d="M-3.500 0L-1 2.500L3.500-2.500"></path></g>`],
  ["fired last", svg`<g class="transition fired"><path class="glow" d="M2 14Q15 2 28 14"></path><path class="line" d="M2 14Q15 2 28 14"></path></g>`],
  ["time that remains", svg`<g class="transition waiting"><g transform="translate(15,12)"><circle class="knob" r="7"></circle><circle class="timer" r="9" pathLength="1" stroke-dasharray="0.65 1"></circle></g></g>`],
  ["breakpoint", svg`<circle class="legend-break" cx="15" cy="12" r="5.5"></circle>`],
];

export const liveLegend = (open) => html`<details class="live-legend" ?open=${open}><summary>Signs on the canvas</summary><ul>${SIGNS.map(([words, sign]) => html`<li><svg width="30" height="24" viewBox="0 0 30 24" aria-hidden="true">${sign}</svg><span>${words}</span></li>`)}</ul></details>`;
