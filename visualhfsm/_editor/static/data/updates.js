/**
 * Documents after a push of the server: unchanged parts are the same objects as before.
 *
 * @import {Automaton, Change, DocumentPush, Fields, Part} from "./protocol.js"
 * @import {OpenDocument} from "./store.js"
 */

/**
 * A document after a push, with the ids of the automata that are new or changed.
 *
 * @param {OpenDocument | undefined} former @param {DocumentPush} push
 */
export function updated(former, {tab, revision, undo, redo, dirty, full, patch}) {
  /** @type {OpenDocument} */
  const document = {
    tab,
    problems: [],
    counts: {},
    fields: /** @type {Fields} */ ({}),
    automata: new Map(),
    own: new Map(),
    content: [],
    ...former,
    revision,
    undo,
    redo,
    dirty,
  };
  /** @type {Set<number>} */
  const changed = new Set();
  if (full) {
    const {automata, ...fields} = full;
    document.fields = fields;
    document.own = new Map(automata.map((each) => [each.id, each]));
    for (const {id} of automata) changed.add(id);
  } else if (patch) {
    const {document: fields, automata = [], parts = [], removed = [], order} = patch;
    if (fields) document.fields = {...document.fields, ...fields};
    const known = new Map(document.own);
    for (const id of removed) known.delete(id);
    for (const each of [...automata, ...parts.map((part) => patched(known.get(part.id), part))]) {
      known.set(each.id, each);
      changed.add(each.id);
    }
    document.own = order ? new Map(inOrder(known, order).map((each) => [each.id, each])) : known;
  }
  document.automata = withContent(document);
  return {document, changed};
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

/**
 * An automaton after a change; unchanged parts are the same objects as before.
 *
 * @param {Automaton | undefined} automaton @param {Part} part
 * @returns {Automaton}
 */
function patched(automaton, {id, fields, states, transitions, annotations}) {
  if (!automaton) throw new Error(`the server has changed automaton ${id}, which this page does not have`);
  return {
    ...automaton,
    ...fields,
    states: patchedItems(automaton.states, states),
    transitions: patchedItems(automaton.transitions, transitions),
    annotations: patchedItems(automaton.annotations, annotations),
  };
}

/** @template {{id: number}} T @param {T[]} list @param {Change<T>} [change] @returns {T[]} */
function patchedItems(list, change) {
  if (!change) return list;
  const {changed = [], removed = [], order} = change;
  const byId = new Map(list.map((each) => [each.id, each]));
  for (const id of removed) byId.delete(id);
  for (const each of changed) byId.set(each.id, each);
  return order ? inOrder(byId, order) : [...byId.values()];
}

/** The items that exist. @template T @param {Map<number, T>} byId @param {number[]} order @returns {T[]} */
const inOrder = (byId, order) => order.flatMap((id) => byId.get(id) ?? []);
