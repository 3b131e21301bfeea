/** The data of one automaton: its period, variables, functions, inputs, and where its content comes from. */

import {html} from "lit";
import {store} from "../store.js";
import {LISTS} from "./lists.js";

/** @param {{tab: number, document: import("../store.js").OpenDocument, automaton: import("../store.js").Automaton}} about */
export function automatonData({tab, document, automaton}) {
  const place = {kind: "automaton", automaton: automaton.id};
  const isRoot = automaton.father === 0;
  const {imported} = automaton;
  const readonly = Boolean(imported);
  return html`
    ${readonly ? html`<p class="explain">The content of this automaton comes from ${imported.file}; change it there.</p>` : html`
      <div data-section="period" class="section"><hfsm-text-field kind="number" label="Period" unit="ms" .tab=${tab} .place=${{...place, part: "period"}} .text=${automaton.period} hint="100"></hfsm-text-field>
        <p class="explain">Time from one cycle to the next. ${rate(automaton.period)}</p></div>
      <div class="section"><h3>Variables <span class="faint">run once, before everything</span></h3>
        <hfsm-code-field data-section="variables" class="grow" .tab=${tab} .place=${{...place, part: "variables"}} .text=${automaton.variables} label="Variables" hint="count = 0"></hfsm-code-field></div>
      <div class="section"><h3>Functions <span class="faint">called as self.name() by all automata</span></h3>
        <hfsm-code-field data-section="functions" class="grow tall" .tab=${tab} .place=${{...place, part: "functions"}} .text=${automaton.functions} label="Functions" hint=${"def name(self):\n    ..."}></hfsm-code-field></div>
      ${isRoot ? "" : html`<hfsm-entries data-section="inputs" .tab=${tab} .automaton=${automaton.id} .of=${LISTS.inputs} .entries=${automaton.inputs} .problems=${document.problems}></hfsm-entries>`}`}
    ${isRoot || !document.own.has(automaton.id) ? "" : importSection(tab, automaton, place)}`;
}

/** How often that is, in words. */
function rate(period) {
  const milliseconds = Number(period.trim());
  if (!(milliseconds > 0)) return "";
  const hertz = 1000 / milliseconds;
  return `${hertz >= 10 ? Math.round(hertz) : Number(hertz.toPrecision(2))} Hz.`;
}

function importSection(tab, automaton, place) {
  const {imported} = automaton;
  const isEmpty = !automaton.states.length && !automaton.transitions.length && !automaton.inputs.length;
  if (!imported && !isEmpty) return "";
  const set = (fields) => (to, text) => {
    const former = store.documents.get(to)?.automata.get(automaton.id)?.imported;
    return store.do(to, {command: "setImport", automaton: automaton.id, file: former?.file ?? "", source: former?.automaton ?? 0, ...fields(text)});
  };
  return html`<div class="section" data-section="import"><h3>Import <span class="faint">the content comes from another document</span></h3>
    <hfsm-text-field label="File" mono .tab=${tab} .place=${{...place, part: "import"}} .text=${imported?.file ?? ""} .send=${set((file) => ({file}))} hint="search.xml, relative to this document"></hfsm-text-field>
    ${imported ? html`<hfsm-text-field label="Automaton" kind="number" .tab=${tab} .place=${{...place, part: "import", name: "source"}} .text=${String(imported.automaton)}
      .send=${set((text) => ({source: Math.max(0, Number.parseInt(text, 10) || 0)}))} hint="0 is its root"></hfsm-text-field>` : ""}</div>`;
}
