/**
 * What tests passed of a piece of code: a mark beside each of its lines, and a sentence for screen readers.
 *
 * @import {EditorState, Text} from "codemirror"
 * @import {PassedCode} from "../data/protocol.js"
 */

import {EditorView, GutterMarker, RangeSet, StateEffect, StateField, gutter} from "codemirror";
import {t} from "../kit/texts.js";
import {linesInWords, versionOf} from "../data/covered.js";

/** Look again what tests passed. */
export const retest = StateEffect.define();

/** @type {Record<string, string>} */
const TITLES = {
  passed: t("Tests passed this line"),
  missed: t("No test passed this line"),
  failed: t("A test failed here"),
};

class Mark extends GutterMarker {
  /** @param {"passed" | "missed" | "failed"} kind */
  constructor(kind) {
    super();
    this.kind = kind;
  }

  /** @param {Mark} other @override */
  eq(other) {
    return this.kind === other.kind;
  }

  /** @override */
  toDOM() {
    const dom = document.createElement("span");
    dom.className = `cm-tested ${this.kind}`;
    dom.title = TITLES[this.kind];
    return dom;
  }
}

const MARKS = {passed: new Mark("passed"), missed: new Mark("missed"), failed: new Mark("failed")};

/** Bars, one for each line: error marks are discs and triangles. */
const theme = EditorView.theme({
  ".cm-testedGutter .cm-gutterElement": {display: "flex"},
  ".cm-tested": {boxSizing: "border-box", width: "4px", background: "var(--code-passed)"},
  ".cm-tested.missed": {
    width: "5px",
    margin: "2px 0",
    border: "1px solid var(--code-missed)",
    borderRadius: "2px",
    background: "none",
  },
  ".cm-tested.failed": {
    width: "11px",
    margin: "1px 0",
    borderRadius: "2px",
    background: "var(--code-error)",
    display: "grid",
    placeContent: "center",
  },
  ".cm-tested.failed::before": {content: '"×"', color: "var(--code-background)", font: "700 12px/1 var(--code-font)"},
  "@media (forced-colors: active)": {
    ".cm-tested": {forcedColorAdjust: "none", background: "CanvasText"},
    ".cm-tested.missed": {borderColor: "CanvasText", background: "Canvas"},
    ".cm-tested.failed": {background: "Highlight"},
    ".cm-tested.failed::before": {color: "HighlightText"},
  },
});

/**
 * The extension that shows it, and a function that returns the sentence.
 *
 * @param {() => PassedCode | undefined} tested what tests passed
 */
export function testedLines(tested) {
  /** @type {StateField<{code?: PassedCode, marks: RangeSet<Mark>}>} */
  const field = StateField.define({
    create: ({doc}) => marked(doc, tested()),
    update: (value, {docChanged, effects, state}) =>
      docChanged || effects.some((each) => each.is(retest)) ? marked(state.doc, tested()) : value,
  });
  return {
    extension: [field, gutter({class: "cm-testedGutter", markers: (view) => view.state.field(field).marks}), theme],
    /** @param {EditorState} state */
    words(state) {
      const {code} = state.field(field);
      return code ? linesInWords(code) : "";
    },
  };
}

/** The marks, while the text is the one that was tested. @param {Text} doc @param {PassedCode | undefined} code */
function marked(doc, code) {
  if (!code || versionOf(doc.toString()) !== code.version) return {marks: RangeSet.empty};
  const {failed} = code;
  const kinds = new Map([
    ...code.passed.map((line) => /** @type {const} */ ([line, "passed"])),
    ...code.missed.map((line) => /** @type {const} */ ([line, "missed"])),
    ...failed.map((line) => /** @type {const} */ ([line, "failed"])),
  ]);
  const ranges = [...kinds]
    .filter(([line]) => line <= doc.lines)
    .map(([line, kind]) => MARKS[kind].range(doc.line(line).from));
  return {code, marks: RangeSet.of(ranges, true)};
}
