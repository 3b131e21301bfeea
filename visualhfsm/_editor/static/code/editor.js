/** The code editor. Loaded when the first piece of code is shown, as CodeMirror is larger than the rest of the page. */

import {
  Annotation,
  EditorState,
  EditorView,
  HighlightStyle,
  Prec,
  bracketMatching,
  closeBrackets,
  closeBracketsKeymap,
  closeCompletion,
  completionKeymap,
  completionStatus,
  crosshairCursor,
  currentCompletions,
  defaultKeymap,
  drawSelection,
  dropCursor,
  foldGutter,
  foldKeymap,
  highlightActiveLine,
  highlightActiveLineGutter,
  highlightSelectionMatches,
  highlightSpecialChars,
  indentOnInput,
  indentUnit,
  indentWithTab,
  keymap,
  lineNumbers,
  lintGutter,
  lintKeymap,
  placeholder,
  python,
  rectangularSelection,
  searchKeymap,
  syntaxHighlighting,
  tags,
  tooltips,
} from "codemirror";
import {t} from "../kit/texts.js";
import {assistance, closeHelp, fixAtCursor, recheck} from "./assistance.js";
import {definitions} from "./definitions.js";
import {isTooLong} from "./draft.js";
import {failedLines} from "./failed-lines.js";
import {PHRASES} from "./phrases.js";
import {retest, testedLines} from "./tested-lines.js";

const fromDocument = Annotation.define();

/** Refuse text that exceeds the server's limit here, where nothing is lost. */
const refuseTooLong = EditorState.changeFilter.of(
  (change) =>
    Boolean(change.annotation(fromDocument)) ||
    change.changes.newLength <= change.startState.doc.length ||
    !isTooLong(change.changes.newLength),
);

/**
 * The page handles Alt+L and Ctrl+M; Escape leaves the editor, so that no key to release Tab is needed: of several
 * cursors it leaves one, but it does not merely undo a selection.
 */
const standardKeys = defaultKeymap
  .filter(({key}) => key !== "Alt-l" && key !== "Ctrl-m")
  .map((each) =>
    each.key === "Escape"
      ? {...each, run: (/** @type {EditorView} */ view) => view.state.selection.ranges.length > 1 && !!each.run?.(view)}
      : each,
  );

/**
 * Cancel completion that is not visible yet. Escape then continues, since users would not notice its effect.
 *
 * @param {EditorView} view
 */
function cancelPendingCompletion(view) {
  if (completionStatus(view.state) === "pending" && !currentCompletions(view.state).length) closeCompletion(view);
  return false;
}

const colors = HighlightStyle.define([
  {tag: [tags.keyword, tags.operatorKeyword, tags.controlKeyword], color: "var(--code-keyword)"},
  {tag: [tags.string, tags.special(tags.string)], color: "var(--code-string)"},
  {tag: [tags.number, tags.bool, tags.null], color: "var(--code-number)"},
  {tag: tags.comment, color: "var(--code-comment)", fontStyle: "italic"},
  {tag: [tags.function(tags.variableName), tags.function(tags.propertyName)], color: "var(--code-function)"},
  {tag: [tags.className, tags.definition(tags.className)], color: "var(--code-class)"},
  {tag: tags.self, color: "var(--code-self)"},
  {tag: tags.invalid, color: "var(--code-error)"},
]);

const theme = EditorView.theme({
  "&": {height: "100%", color: "var(--code-text)", backgroundColor: "var(--code-background)", fontSize: "13px"},
  "&.cm-focused": {outline: "none"},
  ".cm-scroller": {fontFamily: "var(--code-font)", lineHeight: "1.5"},
  ".cm-content": {caretColor: "var(--code-caret)", padding: "6px 0"},
  ".cm-cursor": {borderLeftColor: "var(--code-caret)", borderLeftWidth: "2px"},
  // One narrow gutter: marks lie over the numbers, and the sign to fold comes with the mouse.
  ".cm-gutters": {minWidth: "26px", backgroundColor: "var(--code-gutter)", color: "var(--code-faint)", border: "none"},
  "&.cm-short:not(:has(.cm-tested)) .cm-gutters": {display: "none"},
  ".cm-lineNumbers": {flexGrow: "1"},
  ".cm-lineNumbers .cm-gutterElement": {padding: "0 8px 0 4px", fontSize: "11.5px", lineHeight: "20px"},
  ".cm-gutter:not(.cm-lineNumbers)": {position: "absolute", width: "100%"},
  ".cm-gutter-lint, .cm-testedGutter": {pointerEvents: "none"},
  ".cm-gutter-lint .cm-gutterElement": {display: "flex", justifyContent: "end", padding: "3px 2px"},
  ".cm-gutters .cm-gutter:not(.cm-lineNumbers) .cm-gutterElement": {backgroundColor: "transparent"},
  ".cm-gutters .cm-gutter .cm-gutterElement:has(> .cm-lint-marker, > .failed)": {backgroundColor: "var(--code-gutter)"},
  ".cm-lint-marker, .cm-tested": {pointerEvents: "auto"},
  ".cm-foldGutter .cm-gutterElement": {textAlign: "right"},
  ".cm-foldGutter .cm-gutterElement > span": {cursor: "pointer"},
  "@media (hover: hover)": {".cm-gutters:not(:hover) .cm-foldGutter span": {opacity: "0"}},
  ".cm-activeLine, .cm-activeLineGutter": {backgroundColor: "transparent"},
  "&.cm-focused .cm-activeLine": {backgroundColor: "var(--code-line)"},
  "&.cm-focused .cm-activeLineGutter": {backgroundColor: "var(--code-line)", color: "var(--code-text)"},
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {
    background: "var(--code-selection)",
  },
  ".cm-selectionMatch, .cm-searchMatch": {backgroundColor: "var(--code-match)"},
  "&.cm-focused .cm-matchingBracket": {backgroundColor: "var(--code-match)"},
  ".cm-placeholder": {color: "var(--code-faint)", fontStyle: "italic"},
  ".cm-tooltip": {
    backgroundColor: "var(--code-popup)",
    color: "var(--code-text)",
    border: "1px solid var(--code-border)",
    borderRadius: "6px",
    boxShadow: "0 4px 16px #0003",
    maxWidth: "34rem",
  },
  ".cm-tooltip.cm-tooltip-autocomplete > ul": {fontFamily: "var(--code-font)", maxHeight: "16em"},
  ".cm-tooltip-autocomplete ul li[aria-selected]": {
    backgroundColor: "var(--code-chosen)",
    color: "var(--code-chosen-text)",
  },
  // CodeMirror's own sign is missing in many fonts.
  ".cm-completionIcon-keyword::after": {content: "'k'"},
  // On a phone it would cover the next options.
  "@media (max-width: 720px)": {".cm-completionInfo": {display: "none"}},
  ".cm-completionDetail": {color: "inherit", opacity: "0.9", fontStyle: "normal"},
  ".cm-help": {whiteSpace: "pre-wrap", maxHeight: "18em", overflow: "auto"},
  ".cm-completionInfo, .cm-tooltip.cm-help, .cm-tooltip-hover .cm-help": {padding: "6px 10px"},
  // It lies below the line, over nothing but the field, which makes room for it.
  ".cm-signature": {maxHeight: "7.5em", maxWidth: "min(34rem, var(--side))"},
  "&:has(.cm-signature) .cm-content": {paddingBottom: "8.5em"},
  ".cm-help code": {fontFamily: "var(--code-font)", display: "block"},
  ".cm-help .now": {fontWeight: "700", textDecoration: "underline"},
  ".cm-help p": {margin: "4px 0 0"},
  ".cm-failedLine": {backgroundColor: "var(--code-failed)"},
  ".cm-failed": {
    padding: "0 8px 4px 6px",
    backgroundColor: "var(--code-failed)",
    color: "var(--code-error)",
    whiteSpace: "pre-wrap",
    overflowWrap: "anywhere",
  },
  ".cm-diagnostic": {padding: "4px 10px", borderLeftWidth: "3px"},
  ".cm-panels": {backgroundColor: "var(--code-gutter)", color: "var(--code-text)"},
  ".cm-textfield": {
    backgroundColor: "var(--code-background)",
    color: "inherit",
    border: "1px solid var(--code-border)",
    borderRadius: "4px",
  },
  ".cm-button": {
    backgroundImage: "none",
    backgroundColor: "var(--code-popup)",
    color: "inherit",
    border: "1px solid var(--code-border)",
    borderRadius: "4px",
  },
});

/**
 * Replace the selection by typed text without the browser: Chromium would keep the colors of the former text in a style
 * attribute, which the policy of the page refuses.
 */
const typedOverSelection = EditorView.domEventHandlers({
  beforeinput({inputType, data, isComposing}, view) {
    const {state} = view;
    const {from, to, empty} = state.selection.main;
    if (inputType !== "insertText" || data === null || empty || isComposing || state.readOnly) return false;
    const insert = () => state.update(state.replaceSelection(data), {userEvent: "input.type", scrollIntoView: true});
    const isHandled = state.facet(EditorView.inputHandler).some((handle) => handle(view, from, to, data, insert));
    if (!isHandled) view.dispatch(insert());
    return true;
  },
});

const shared = [
  EditorView.lineWrapping,
  lineNumbers(),
  highlightActiveLineGutter(),
  highlightSpecialChars(),
  foldGutter(),
  drawSelection(),
  dropCursor(),
  EditorState.allowMultipleSelections.of(true),
  EditorState.tabSize.of(4),
  EditorState.phrases.of(PHRASES),
  indentUnit.of("    "),
  indentOnInput(),
  bracketMatching(),
  closeBrackets(),
  rectangularSelection(),
  crosshairCursor(),
  highlightActiveLine(),
  highlightSelectionMatches(),
  lintGutter(),
  tooltips({position: "fixed"}),
  typedOverSelection,
  refuseTooLong,
  syntaxHighlighting(colors),
  theme,
  EditorView.cspNonce.of(
    /** @type {HTMLMetaElement | null} */ (document.querySelector('meta[name="style-nonce"]'))?.content ?? "",
  ),
];

/**
 * @typedef {{text: string, cursor: number, place: import("../data/protocol.js").Place, tab: number, label: string, hint:
 *   string, short: boolean, readonly: boolean}} Content `cursor` is its initial position in the text
 * @typedef {{typed: (text: string) => void, undo: () => void, redo: () => void, save: () => void,
 *   problems: () => import("./assistance.js").Known,
 *   tested: (place: import("../data/protocol.js").Place) => import("../data/protocol.js").PassedCode | undefined}} Actions
 *   callbacks of the editor
 */

/** One editor in an element; it shows one piece of code after the other. */
export class Editor {
  #view;
  #actions;
  #label = "";

  /** @param {HTMLElement} parent @param {Content} content @param {Actions} actions */
  constructor(parent, content, actions) {
    this.#actions = actions;
    this.#view = new EditorView({parent, state: this.#stateOf(content)});
  }

  get focused() {
    return this.#view.hasFocus;
  }

  /** The position of the cursor in the text. */
  get cursor() {
    return this.#view.state.selection.main.head;
  }

  /** Show another piece of code. @param {Content} content */
  open(content) {
    const hadFocus = this.focused;
    this.#view.setState(this.#stateOf(content));
    if (hadFocus) this.#view.focus();
  }

  /** Show the same piece after a change; cursor and scrolling stay where they are. @param {string} text */
  replace(text) {
    const {state} = this.#view;
    const former = state.doc.toString();
    const change = difference(former, text);
    if (change) this.#view.dispatch({changes: change, annotations: fromDocument.of(true)});
  }

  /** Change the label, as after renaming. @param {string} label */
  rename(label) {
    if (label === this.#label) return;
    this.#label = label;
    this.#view.dispatch({}); // attributes are evaluated with each transaction
  }

  /** Update the marks after a check. */
  recheck() {
    this.#view.dispatch({effects: recheck.of(null)});
  }

  /** Close what is offered and explained at the cursor. */
  closeHelp() {
    closeHelp(this.#view);
  }

  /** Update the marks after tests. */
  retest() {
    this.#view.dispatch({effects: retest.of(null)});
  }

  /** Place the cursor, and select a number of characters; line and column from 1. @param {number} line */
  goTo(line, column = 1, length = 0) {
    const {doc} = this.#view.state;
    const at = doc.line(Math.min(Math.max(line, 1), doc.lines));
    const anchor = Math.min(at.from + Math.max(column - 1, 0), at.to);
    const head = Math.min(anchor + length, at.to);
    this.#view.dispatch({selection: {anchor, head}, effects: EditorView.scrollIntoView(anchor, {y: "center"})});
  }

  /** Select everything, of a quoted text what is between the quotes. */
  selectValue() {
    const text = this.#view.state.doc.toString();
    const inner = /^(["'])[^"'\\\n]*\1$/.test(text) ? 1 : 0;
    this.#view.dispatch({selection: {anchor: inner, head: text.length - inner}});
  }

  focus() {
    this.#view.focus();
  }

  /** Type a text at the cursor. @param {string} text */
  insert(text) {
    const {state} = this.#view;
    if (!state.readOnly)
      this.#view.dispatch({...state.replaceSelection(text), userEvent: "input.type", scrollIntoView: true});
  }

  /** Press a key at the cursor. @param {import("../kit/waiting-keys.js").Key} pressed */
  press(pressed) {
    const {key, ctrlKey, altKey, metaKey} = pressed;
    const more = {bubbles: true, cancelable: true, composed: true};
    if (key.length === 1 && !(ctrlKey || altKey || metaKey)) this.insert(key);
    else this.#view.contentDOM.dispatchEvent(new KeyboardEvent("keydown", {...pressed, ...more}));
  }

  /** Release everything. */
  destroy() {
    this.#view.destroy();
  }

  /** @param {Content} content */
  #stateOf({text, cursor, place, tab, label, hint, short, readonly}) {
    const {typed, undo, redo, save, problems, tested} = this.#actions;
    const lines = testedLines(() => tested(place));
    this.#label = label;
    /** @param {() => void} action */
    const run = (action) => () => {
      action();
      return true;
    };
    return EditorState.create({
      doc: text,
      selection: {anchor: Math.min(cursor, text.length)},
      extensions: [
        // The whole document has one undo list: the editor keeps none.
        Prec.highest(
          keymap.of([
            {key: "Mod-s", run: run(save), preventDefault: true},
            {key: "Mod-z", run: run(undo), preventDefault: true},
            {key: "Mod-y", run: run(redo), preventDefault: true},
            {key: "Mod-Shift-z", run: run(redo), preventDefault: true},
            {key: "Mod-.", run: fixAtCursor},
            {key: "Escape", run: cancelPendingCompletion},
          ]),
        ),
        definitions({tab, place}),
        keymap.of([
          ...completionKeymap,
          ...closeBracketsKeymap,
          ...searchKeymap,
          ...foldKeymap,
          ...lintKeymap,
          indentWithTab,
          ...standardKeys,
        ]),
        shared,
        python(),
        assistance({tab, place, problems}),
        failedLines(place, problems),
        lines.extension,
        EditorView.contentAttributes.of((view) => ({
          tabindex: "0",
          "aria-label": this.#label,
          "aria-description": [lines.words(view.state), t("Escape returns to the canvas")].filter(Boolean).join(". "),
        })),
        placeholder(hint),
        short ? EditorView.editorAttributes.of(({state}) => (state.doc.lines === 1 ? {class: "cm-short"} : null)) : [],
        EditorState.readOnly.of(readonly),
        EditorView.updateListener.of((update) => {
          if (!update.docChanged || update.transactions.some((each) => each.annotation(fromDocument))) return;
          typed(update.state.doc.toString());
        }),
      ],
    });
  }
}

/**
 * The one piece in which two texts differ, as a change of the first; undefined when they do not.
 *
 * @param {string} former @param {string} text
 */
export function difference(former, text) {
  if (former === text) return undefined;
  const shorter = Math.min(former.length, text.length);
  let from = 0;
  while (from < shorter && former[from] === text[from]) from += 1;
  let end = 0;
  while (end < shorter - from && former[former.length - 1 - end] === text[text.length - 1 - end]) end += 1;
  return {from, to: former.length - end, insert: text.slice(from, text.length - end)};
}
