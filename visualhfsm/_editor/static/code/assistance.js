/**
 * Help from the server while typing Python: completion, parameters of calls, explanations of names, and marks.
 *
 * @import {CompletionContext, Diagnostic, Text, Tooltip, Transaction} from "codemirror"
 * @import {Completions, NameExplanation, Place, Problem, Signature} from "../data/protocol.js"
 * @typedef {{complete: Completions, explain: NameExplanation, signature: Signature}} Wanted
 */

import {
  EditorState,
  EditorView,
  StateEffect,
  StateField,
  ViewPlugin,
  autocompletion,
  closeCompletion,
  forEachDiagnostic,
  hoverTooltip,
  linter,
  setDiagnostics,
  setDiagnosticsEffect,
  showTooltip,
} from "codemirror";
import {store} from "../data/store.js";
import {coded, t} from "../kit/texts.js";
import {fixesFor, learnFixes} from "./fixes.js";
import {declare, loadIdentities, served} from "./known-interfaces.js";
import {problemsAt} from "../data/places.js";

/**
 * @typedef {{items: Problem[], current: boolean}} Known the problems of the document, and whether
 *   they are those of the text that is shown
 */

const LARGEST = 200_000; // characters; larger texts are edited without help

/** There are other problems of the document. */
export const recheck = StateEffect.define();
/** Hide the parameters of the call. */
const hideCall = StateEffect.define();

/** Close what is offered and explained at the cursor. @param {EditorView} view */
export function closeHelp(view) {
  closeCompletion(view);
  view.dispatch({effects: hideCall.of(null)});
}

/**
 * Extensions that ask the server about one piece of code.
 *
 * @param {{tab: number, place: Place, problems: () => Known}} about
 */
export function assistance({tab, place, problems}) {
  const help = new Help(tab, place);
  return [
    autocompletion({override: [(context) => help.complete(context)], icons: true, maxRenderedOptions: 100}),
    linter(null, {hideOn: (transaction, from, to) => takesAway(transaction, from, to)}),
    problemMarks(tab, place, problems),
    lastMarks,
    EditorState.transactionFilter.of((transaction) => (setsTheSame(transaction) ? [] : transaction)),
    hoverTooltip((view, position) => help.hover(view, position), {hoverTime: 500, hideOnChange: true}),
    signatures(help),
  ];
}

/** The marks that a transaction sets, if it does nothing else. @param {Transaction} transaction */
function marksOf({effects, docChanged}) {
  return docChanged ? undefined : effects.find((each) => each.is(setDiagnosticsEffect))?.value;
}

/**
 * Whether something is typed, which a bubble may cover, or a mark is gone of those at some code: else their bubble stays
 * open under the mouse.
 *
 * @param {Transaction} transaction @param {number} from @param {number} to
 */
function takesAway(transaction, from, to) {
  const marks = marksOf(transaction);
  if (!marks) return ["input", "delete"].some((each) => transaction.isUserEvent(each)) || null;
  let isGone = false;
  forEachDiagnostic(transaction.startState, (each, start, end) => {
    if (start <= from && to <= end && !marks.includes(each)) isGone = true;
  });
  return isGone;
}

/** The marks that were set last, as long as their text is the same. */
const lastMarks = StateField.define({
  create: () => /** @type {readonly Diagnostic[] | undefined} */ (undefined),
  update: (marks, transaction) => marksOf(transaction) ?? (transaction.docChanged ? undefined : marks),
});

/** Whether nothing is done but to set the same marks again. @param {Transaction} transaction */
function setsTheSame(transaction) {
  const marks = marksOf(transaction);
  const last = transaction.startState.field(lastMarks, false);
  return marks && marks.length === last?.length && marks.every((each, index) => each === last[index]);
}

/**
 * Do the first fix of what is wrong at the cursor, else in its line; false if there is none.
 *
 * @param {EditorView} view
 */
export function fixAtCursor(view) {
  const {state} = view;
  const {head} = state.selection.main;
  const line = state.doc.lineAt(head);
  /** @type {Diagnostic[]} */
  const found = [];
  forEachDiagnostic(state, (each, from, to) => {
    if (!each.actions?.length || from > line.to || to < line.from) return;
    if (from <= head && head <= to) found.unshift(each);
    else found.push(each);
  });
  const [mark] = found;
  mark?.actions?.[0].apply(view, mark.from, mark.to);
  return Boolean(mark);
}

class Help {
  /** @param {number} tab @param {Place} place */
  constructor(tab, place) {
    this.tab = tab;
    this.place = place;
  }

  /**
   * Ask about a position in the code; null if there is no answer, since missing help is not an error.
   *
   * @template {keyof Wanted} K
   * @param {K} wanted @param {EditorState} state @param {number} position
   * @returns {Promise<Wanted[K] | null>}
   */
  async ask(wanted, {doc}, position = 0) {
    if (doc.length > LARGEST) return null;
    const at = doc.lineAt(position);
    try {
      const found = await store.request("codeHelp", {
        wanted,
        tab: this.tab,
        place: this.place,
        code: doc.toString(),
        line: at.number,
        column: position - at.from,
      });
      return /** @type {Wanted[K] | null} */ (found);
    } catch {
      return null;
    }
  }

  /** @param {CompletionContext} context */
  async complete(context) {
    const word = context.matchBefore(/[\w.]+$/);
    if (!context.explicit && (!word || /^\d/.test(word.text))) return null;
    const ofSelf = /\bself\.(\w*)$/.exec(word?.text ?? "");
    const asked = this.ask("complete", context.state, context.pos);
    const [found] = await Promise.all([asked, ofSelf && loadIdentities()]);
    if (context.aborted) return null;
    // About what was typed meanwhile CodeMirror asks only after a result, though it has no options.
    const nothing = context.view?.state.doc === context.state.doc ? null : {from: context.pos, options: []};
    const more = ofSelf ? undeclared(ofSelf[1], new Set(found?.options.map(({label}) => label))) : [];
    if (!found || !(found.options.length || more.length)) return nothing;
    const from = context.pos - (ofSelf?.[1].length ?? found.typed);
    /** Whether a word is complete: nothing longer begins with it. @param {string} typed */
    const isComplete = (typed) => {
      const longer = found.options.filter(({label}) => label.startsWith(typed));
      return longer.length === 1 && longer[0].label === typed;
    };
    if (isComplete(context.state.sliceDoc(from, context.pos))) return nothing;
    const options = found.options.map(({info, boost = 0, ...option}) => ({
      ...option,
      boost,
      // The server sends documentation of the first options; that of others is requested when selected.
      info: () => (info ? explain([], info) : this.#explainOption(context.state, from, context.pos, option.label)),
    }));
    return {
      from,
      options: [...options, ...more],
      validFor: (/** @type {string} */ typed) => /^\w*$/.test(typed) && !isComplete(typed),
    };
  }

  /** @param {EditorState} state @param {number} from @param {number} to @param {string} label */
  async #explainOption(state, from, to, label) {
    const rest = /^\w*/.exec(state.sliceDoc(to, state.doc.lineAt(to).to))?.[0].length ?? 0;
    const {state: chosen} = state.update({changes: {from, to: to + rest, insert: label}});
    const found = await this.ask("explain", chosen, from);
    return found && explain(found.detail ? [`${found.name}${found.detail}`] : [], found.documentation);
  }

  /** @param {EditorView} view @param {number} position */
  async hover(view, position) {
    const word = view.state.wordAt(position);
    if (!word) return null;
    const found = await this.ask("explain", view.state, word.from);
    if (!found) return null;
    return {
      pos: word.from,
      end: word.to,
      above: true,
      create: () => ({dom: explain([`${found.name}${found.detail}`], found.documentation)}),
    };
  }
}

/**
 * What the robot has that begins so and the document does not declare, which it does when it is chosen.
 *
 * @param {string} begun @param {Set<string>} known
 */
function undeclared(begun, known) {
  const left = served().filter(({name, type}) => type && name.startsWith(begun) && !known.has(name));
  return left.map(({name, type = ""}) => ({
    label: name,
    type: "variable",
    detail: t("declare {type}", {type}),
    boost: -2, // below what is there
    info: () => null,
    apply: (
      /** @type {EditorView} */ view,
      /** @type {unknown} */ _,
      /** @type {number} */ from,
      /** @type {number} */ to,
    ) => {
      view.dispatch({
        changes: {from, to, insert: name},
        selection: {anchor: from + name.length},
        userEvent: "input.complete",
      });
      void declare(name, type);
    },
  }));
}

/**
 * Marks of the problems of the document at a place; while text is typed, the last ones move with it.
 *
 * @param {number} tab @param {Place} place @param {() => Known} problems
 */
function problemMarks(tab, place, problems) {
  return ViewPlugin.define((view) => {
    /** The last marks, by what they say. @type {Map<string, Diagnostic>} */
    let shown = new Map();
    const show = async () => {
      const {doc} = view.state;
      const known = problemsAt(problems().items, place).filter((each) => each.line);
      mark(known);
      const document = store.documents.get(tab);
      if (!document || !known.length) return;
      await learnFixes(document);
      if (view.state.doc === doc && view.dom.isConnected) mark(known); // else these are marks of an earlier text
    };
    /** @param {Problem[]} known */
    const mark = (known) => {
      const {doc} = view.state;
      const found = known.map((each) => asMark(doc, each, tab)).sort((one, other) => one.from - other.from);
      shown = kept(found, shown);
      view.dispatch(setDiagnostics(view.state, [...shown.values()]));
    };
    queueMicrotask(show); // of the last check, as long as there is no newer one
    return {
      update({transactions}) {
        const isNew = transactions.some((each) => each.effects.some((effect) => effect.is(recheck)));
        if (isNew && problems().current) queueMicrotask(show);
      },
    };
  });
}

/**
 * Marks by what they say. Those that say the same as earlier ones are replaced by these: open bubbles and buttons stay.
 *
 * @param {Diagnostic[]} found @param {Map<string, Diagnostic>} earlier
 */
function kept(found, earlier) {
  /** @type {Map<string, Diagnostic>} */
  const marks = new Map();
  for (const mark of found) {
    const {from, to, severity, message, actions = []} = mark;
    const key = JSON.stringify([from, to, severity, message, ...actions.map(({name}) => name)]);
    const known = earlier.get(key) ?? mark;
    known.actions?.forEach((action, index) => Object.assign(action, actions[index]));
    marks.set(key, known);
  }
  return marks;
}

/** Show the names in a message as code; one function for all, by which diagnostics are equal. @this {Diagnostic} */
function renderMessage() {
  const shown = document.createElement("span");
  shown.append(...coded(this.message));
  return shown;
}

/**
 * A problem as a diagnostic of CodeMirror; line and column count from 1.
 *
 * @param {Text} doc @param {Problem} problem @param {number} tab
 * @returns {Diagnostic}
 */
function asMark(doc, problem, tab) {
  const {line = 1, column = 1, length = 0, severity, message} = problem;
  const at = doc.line(Math.min(Math.max(line, 1), doc.lines));
  // A problem at the end of a line is marked at its last character.
  const from = Math.max(at.from, Math.min(at.from + Math.max(column - 1, 0), at.to - 1));
  const rest = doc.sliceString(from, at.to);
  const to = Math.min(at.to, from + Math.max(length, /^\w+/.exec(rest)?.[0].length ?? 1));
  const document = store.documents.get(tab);
  const actions = document ? fixesFor(problem, document) : [];
  return {from, to, severity: severity === "note" ? "info" : severity, message, renderMessage, actions};
}

/**
 * An explanation as an element: lines of code, and text below; nothing in it is read as HTML.
 *
 * @param {string[]} code @param {string} text
 */
function explain(code, text) {
  const dom = document.createElement("div");
  dom.className = "cm-help";
  for (const part of code) {
    const line = document.createElement("code");
    line.append(part);
    dom.append(line);
  }
  if (text) {
    const paragraph = document.createElement("p");
    paragraph.append(...coded(text));
    dom.append(paragraph);
  }
  return dom;
}

/** Show the parameters of the call in which the cursor stands, after `(` or `,` was typed. @param {Help} help */
function signatures(help) {
  /** @type {import("codemirror").StateEffectType<Tooltip | null>} */
  const show = StateEffect.define();
  const shown = StateField.define({
    create: () => /** @type {Tooltip | null} */ (null),
    update(value, transaction) {
      for (const effect of transaction.effects) {
        if (effect.is(show)) return effect.value;
        if (effect.is(hideCall)) return null;
      }
      if (value && transaction.docChanged) return {...value, pos: transaction.changes.mapPos(value.pos)};
      return value;
    },
    provide: (field) => showTooltip.from(field),
  });
  let asked = 0;
  let answered = 0;
  const follow = EditorView.updateListener.of((update) => {
    const {state, view} = update;
    const isOpen = state.field(shown) !== null;
    if (update.transactions.some((each) => each.effects.some((effect) => effect.is(hideCall)))) answered = ++asked;
    const isWaiting = answered < asked; // text typed meanwhile may end the call
    if (!update.docChanged && !(update.selectionSet && (isOpen || isWaiting))) {
      if (isOpen && update.focusChanged && !view.hasFocus) setTimeout(() => view.dispatch({effects: show.of(null)}));
      return;
    }
    const position = state.selection.main.head;
    const opens = update.docChanged && /[(,]\s?$/.test(state.sliceDoc(Math.max(0, position - 2), position));
    if (!opens && !isOpen && !isWaiting) return;
    const number = ++asked;
    help.ask("signature", state, position).then((found) => {
      if (number !== asked) return;
      answered = number;
      const current = view.state.field(shown, false);
      if (!view.dom.isConnected || current === undefined) return; // another piece of code is shown meanwhile
      if (found || current) view.dispatch({effects: show.of(found ? tip(found, position) : null)});
    });
  });
  const close = EditorView.domEventHandlers({
    keydown(event, view) {
      if (event.key !== "Escape" || !view.state.field(shown)) return false;
      view.dispatch({effects: show.of(null)});
      return true;
    },
  });
  return [shown, follow, close];
}

/** @param {Signature} found @param {number} pos @returns {Tooltip} */
function tip(found, pos) {
  return {
    pos,
    create() {
      const {name, parameters, active, result, documentation} = found;
      const dom = explain([], documentation);
      dom.classList.add("cm-signature");
      const line = document.createElement("code");
      line.append(`${name}(`);
      parameters.forEach((parameter, index) => {
        const part = document.createElement("span");
        if (index === active) part.className = "now";
        part.textContent = parameter;
        line.append(index ? ", " : "", part);
      });
      line.append(result && result !== "None" ? `) → ${result}` : ")");
      dom.prepend(line);
      return {dom};
    },
  };
}
