/** Tabs inside a panel, as the pattern of the WAI has them. */

import {html, nothing} from "lit";

/**
 * @param {{label: string, tabs: {id: string, label: string, filled?: boolean, problems?: import("../store.js").Problem[]}[],
 *   chosen: string, choose: (id: string) => void, prefix: string}} options `prefix` begins the ids of tabs and their panels
 */
export function tabStrip({label, tabs, chosen, choose, prefix}) {
  const press = (event) => {
    const step = {ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity}[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const index = tabs.findIndex((each) => each.id === chosen);
    const next = Number.isFinite(step) ? (index + step + tabs.length) % tabs.length : step < 0 ? 0 : tabs.length - 1;
    choose(tabs[next].id);
    event.currentTarget.children[next].focus();
  };
  return html`<div class="inner-tabs" role="tablist" aria-label=${label} @keydown=${press}>${tabs.map((each) => html`
    <button type="button" role="tab" id="${prefix}-tab-${each.id}" aria-controls="${prefix}-panel" aria-selected=${each.id === chosen} tabindex=${each.id === chosen ? 0 : -1}
      @click=${() => choose(each.id)}>${each.label}${each.filled ? html`<span class="filled" title="not empty" role="img" aria-label=", not empty"></span>` : nothing}${badge(each.problems ?? [])}</button>`)}</div>`;
}

/** How many problems there are, colored by the gravest. */
export function badge(problems) {
  if (!problems.length) return nothing;
  const gravest = ["error", "warning", "note"].find((severity) => problems.some((each) => each.severity === severity));
  const noun = `problem${problems.length === 1 ? "" : "s"}`;
  return html`<span class="badge ${gravest}" role="img" aria-label=", ${problems.length} ${noun}" title="${problems.length} ${noun}">${problems.length}</span>`;
}
