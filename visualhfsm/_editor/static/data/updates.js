/**
 * Documents after a push of the server: unchanged parts are the same objects as before, so that only others are redrawn.
 *
 * @import {Automaton, DocumentPush} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 */

/** @param {OpenDocument | undefined} former @param {DocumentPush} push @returns {OpenDocument} */
export function updated(former, {tab, revision, undo, redo, dirty, full: {automata, ...fields}}) {
  const own = kept([...(former?.own.values() ?? [])], automata, withKeptItems);
  /** @type {OpenDocument} */
  const document = {
    problems: [],
    counts: {},
    automata: new Map(),
    content: [],
    ...former,
    tab,
    revision,
    undo,
    redo,
    dirty,
    fields: former && isSame(former.fields, fields) ? former.fields : fields,
    own: new Map(own.map((each) => [each.id, each])),
  };
  document.automata = withContent(document);
  return document;
}

/** The automata of a document, with imported content in the place of each import. @param {OpenDocument} document */
export function withContent({own, content}) {
  if (!content.length) return own;
  const automata = new Map(own);
  for (const each of content) {
    const stub = own.get(each.id);
    const fits = stub
      ? each.imported &&
        stub.imported?.file === each.imported.file &&
        stub.imported.automaton === each.imported.automaton
      : automata.has(each.father);
    if (fits) automata.set(each.id, stub ? {...each, father: stub.father} : each);
  }
  return automata;
}

/** An automaton, some of whose items are as before. @param {Automaton} former @param {Automaton} now @returns {Automaton} */
const withKeptItems = (former, now) => ({
  ...now,
  states: kept(former.states, now.states),
  transitions: kept(former.transitions, now.transitions),
  annotations: kept(former.annotations, now.annotations),
});

/**
 * A list with the former objects where their texts are the same.
 *
 * @template {{id: number}} T
 * @param {T[]} former @param {T[]} now @param {(former: T, now: T) => T} [merged] of two that differ
 */
function kept(former, now, merged = (_, each) => each) {
  const known = new Map(former.map((each) => [each.id, each]));
  return now.map((each) => {
    const before = known.get(each.id);
    return !before ? each : isSame(before, each) ? before : merged(before, each);
  });
}

/** @param {unknown} one @param {unknown} other */
const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);
