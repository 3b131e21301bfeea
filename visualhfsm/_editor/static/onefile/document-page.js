/**
 * The documentation of a project in one file: the content is from visualhfsm/_commands/documentation.py.
 *
 * @import {Automaton, Fields, Passed, PassedCode, Problem, TestView} from "../data/protocol.js"
 * @typedef {{name: string, path: string, failures: string[], document: (Fields & {automata: Automaton[]}) | null,
 *   problems: Problem[], counts: Record<string, number>, proved: boolean, seconds: number, tests: TestView[],
 *   passed: Passed[], code: PassedCode[], unmeasured: string}} Chapter
 */

import {html, nothing, render} from "lit";

import {placeOf, wordsFor} from "../data/places.js";
import {ASSUMPTIONS} from "../code/verdicts.js";
import {covered, gapsIn, summary} from "../data/covered.js";
import {page} from "../data/page.js";
import {SEVERITIES} from "../data/problems.js";
import {store} from "../data/store.js";
import {decimal, t} from "../kit/texts.js";
import {begin, pushes, TAB, themeButton} from "./frame.js";
import {anchor, content, numbered} from "./print.js";
import {unpacked, unpackedData} from "./unpacked.js";

/** @type {Record<string, string>} */
const OUTCOMES = {passed: t("passed"), failed: t("failed"), skipped: t("skipped")};

/** A document, and its lines in the contents. @param {Chapter} chapter @param {number} index */
function chapterOf(chapter, index) {
  const prefix = `d${index}`;
  const {name, path, failures, document} = chapter;
  const failed = failures.length
    ? html`<ul class="failures">
        ${failures.map((each) => html`<li>${each}</li>`)}
      </ul>`
    : nothing;
  const file = html`<p class="muted">${path}</p>`;
  if (!document)
    return {
      text: html`<article id=${prefix}>
        ${file}
        <h1>${name}</h1>
        ${failed}
      </article>`,
      link: link(prefix, name),
    };
  const {problems: items, counts, proved: complete} = chapter;
  store.show({answer: () => null, frames: {}}, [
    ...pushes(name, name, {...document, name}),
    {push: "problems", tab: TAB, revision: 0, imports: 0, items, counts, complete},
  ]);
  page.show(TAB);
  const automata = [...page.shownDocument.automata.values()];
  const below = automata.map((each) => link(anchor(prefix, each.id), numbered(each)));
  return {
    text: html`<article id=${prefix}>${file}${content(prefix, html`${failed}${found(chapter)}`)}</article>`,
    link: html`${link(prefix, name)}${
      below.length > 1
        ? html`<ul>
            ${below.map((each) => html`<li>${each}</li>`)}
          </ul>`
        : nothing
    }`,
  };
}

/** @param {string} id @param {string} words */
const link = (id, words) => html`<a href="#${id}">${words}</a>`;

/** What checks, proofs, a run and tests found in the shown document. @param {Chapter} chapter */
function found({problems, proved, seconds, tests, passed, code, unmeasured}) {
  const document = page.shownDocument;
  const gaps = passed.length ? gapsIn(document, passed, code) : [];
  return html`${document.fields.properties.length && proved ? html`<p class="muted">${ASSUMPTIONS}</p>` : nothing}
    <h2>${t("Problems")}</h2>
    ${
      problems.length
        ? html`<ul>
            ${problems.map(problemPart)}
          </ul>`
        : html`<p>${t("The checks found nothing wrong.")}</p>`
    }
    <h2>${t("Tests")}</h2>
    <p>
      ${seconds ? t("It ran for {seconds} s of virtual time.", {seconds}) : t("It was not run.")}
      ${[summary(tests), ...(passed.length ? [covered(document, passed, code)] : [])].join("; ")}.
      ${unmeasured ? t("Lines were not measured: {unmeasured}.", {unmeasured}) : nothing}
    </p>
    <ul>
      ${tests.map(
        ({name, file, outcome, seconds: lasted, reason, timeline}) =>
          html`<li class=${outcome}>
            <strong>${OUTCOMES[outcome]}</strong>: ${name} <span class="muted">${file}, ${decimal(lasted, 1)} s</span>
            ${
              reason || timeline
                ? html`<pre tabindex="0">
${reason}
${timeline}</pre>`
                : nothing
            }
          </li>`,
      )}
    </ul>
    ${
      gaps.length
        ? html`<h2>${t("Not passed yet")}</h2>
            <ul>
              ${gaps.map(({place, what}) => html`<li><strong>${wordsFor(document, place).join(" / ")}</strong>: ${what}</li>`)}
            </ul>`
        : nothing
    }`;
}

/** @param {Problem} problem */
function problemPart(problem) {
  const {severity, message, notes = [], file, where = "", line} = problem;
  const words = file ? [file, where] : wordsFor(page.shownDocument, placeOf(problem));
  const at = [...words, line ? t("line {line}", {line}) : ""].filter(Boolean).join(" / ");
  return html`<li class=${severity}>
    <strong>${SEVERITIES[severity]}</strong>: ${message} <span class="muted">${at}</span>
    ${
      notes.length
        ? html`<ul>
            ${notes.map((each) => html`<li class="note-text">${each}</li>`)}
          </ul>`
        : nothing
    }
  </li>`;
}

async function show() {
  const {name, chapters} = unpacked(await unpackedData());
  /** @type {ReturnType<typeof chapterOf>[]} */
  const shown = chapters.map(chapterOf);
  const draw = () =>
    render(
      html`<div class="document-page">
        <header><strong>${name}</strong>${themeButton(draw)}</header>
        <nav aria-label=${t("Contents")}>
          <ul>
            ${shown.map((each) => html`<li>${each.link}</li>`)}
          </ul>
        </nav>
        <main>${shown.map((each) => each.text)}</main>
      </div>`,
      document.body,
    );
  draw();
  if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
}

begin(show);
