/** What a run says of a line of code, below the line, until the code changes. */

import {Decoration, EditorView, StateField, WidgetType} from "codemirror";
import {FAILED} from "../data/problems.js";
import {coded} from "../kit/texts.js";
import {recheck} from "./assistance.js";
import {problemsAt} from "../data/places.js";

class Message extends WidgetType {
  /** @param {string} text @param {number} indent */
  constructor(text, indent) {
    super();
    this.text = text;
    this.indent = indent;
  }

  /** @param {Message} other @override */
  eq(other) {
    return this.text === other.text && this.indent === other.indent;
  }

  /** @override */
  toDOM() {
    const dom = document.createElement("div");
    dom.className = "cm-failed";
    const text = document.createElement("span");
    text.append(...coded(this.text));
    dom.append(" ".repeat(this.indent), text);
    return dom;
  }
}

/**
 * The extension that shows them in the code at a place.
 *
 * @param {import("../data/protocol.js").Place} place @param {() => import("./assistance.js").Known} problems
 */
export function failedLines(place, problems) {
  /** @param {import("codemirror").Text} doc */
  const marks = (doc) => {
    const failed = problemsAt(problems().items, place).filter(
      ({code, line = 0}) => code === FAILED && line && line <= doc.lines,
    );
    return Decoration.set(
      failed.flatMap(({line = 1, column = 1, message}) => {
        const {from, to} = doc.line(line);
        const widget = new Message(message, column - 1);
        return [
          Decoration.line({class: "cm-failedLine"}).range(from),
          Decoration.widget({widget, block: true, side: 1}).range(to),
        ];
      }),
      true,
    );
  };
  return StateField.define({
    create: ({doc}) => marks(doc),
    update(value, {docChanged, effects, state}) {
      if (docChanged) return Decoration.none;
      return effects.some((each) => each.is(recheck)) && problems().current ? marks(state.doc) : value;
    },
    provide: (field) => EditorView.decorations.from(field),
  });
}
