/**
 * The texts of the page: those for the catalogs, and those that nobody can translate.
 *
 * `node page-texts.js` prints both as JSON. The first are the arguments of `t`, `n` and `rich`. The others are words
 * in templates, in attributes that people see or hear, and in a few properties and calls, outside of these functions.
 */

import {existsSync, readFileSync, readdirSync} from "node:fs";
import {relative, resolve} from "node:path";
import {fileURLToPath} from "node:url";

import {parse} from "acorn";
import {parseFragment} from "parse5";

export const STATIC = fileURLToPath(new URL("../../visualhfsm/_editor/static/", import.meta.url));
const PLUGINS = fileURLToPath(new URL("../../plugins/", import.meta.url));

/** How many of their arguments are texts. @type {Record<string, number>} */
const FUNCTIONS = {t: 1, n: 2, rich: 1};
const TEMPLATES = new Set(["html", "svg"]);
const ATTRIBUTES =
  /^(alt|title|label|placeholder|aria-(label|description|roledescription|valuetext|placeholder|braillelabel))$/;
const PROPERTIES = new Set(["label", "title", "hint", "help", "words", "placeholder", "ariaLabel", "textContent"]);
const CALLS = new Set(["notify", "announce"]);
/** Elements whose content is not for translators. */
const CODE = new Set(["code", "kbd", "samp", "style", "script"]);
/** Names and units, which are the same in every language; `short` is how a button shows its action, `self` is code. */
const SAME = new Set(
  "self short VisualHFSM Nao NAOqi Python ROS ROS 2 Pupper STOP SVG PNG JPEG XML HTML SCXML JSON CSV PDF ms s min h m cm rad Hz kB MB °C x y z".split(
    " ",
  ),
);

/** @typedef {any} Node of a syntax tree */
/** @typedef {{id: string, plural?: string, file: string, line: number, comment?: string}} Message */
/** @typedef {{file: string, line: number, text: string, start: number, end: number, what: string}} Finding */

/** The modules of the page, without the libraries, and after them those of views. */
export function modules() {
  const own = readdirSync(STATIC, {recursive: true, encoding: "utf-8"})
    .filter((name) => name.endsWith(".js") && !name.startsWith("vendor") && name !== "kit/texts.js")
    .sort();
  const views = existsSync(PLUGINS) ? readdirSync(PLUGINS, {recursive: true, encoding: "utf-8"}) : [];
  return [
    ...own,
    ...views
      .filter((name) => /\/static\/.*\.js$/.test(name))
      .map((name) => `plugins/${name}`)
      .sort(),
  ];
}

/** The file of a module. @param {string} name */
export const fileOf = (name) =>
  name.startsWith("plugins/") ? resolve(PLUGINS, name.slice("plugins/".length)) : resolve(STATIC, name);

/**
 * The texts of one module.
 *
 * @param {string} source
 * @param {string} file its name
 */
export function textsOf(source, file) {
  /** @type {Message[]} */
  const messages = [];
  /** @type {Finding[]} */
  const unwrapped = [];
  /** @type {{line: number, text: string}[]} */
  const comments = [];
  const tree = parse(source, {
    ecmaVersion: "latest",
    sourceType: "module",
    locations: true,
    onComment: (_block, text, _start, _end, _from, to) => {
      const [, said] = /^\s*Translators:\s*(.*)$/s.exec(text) ?? [];
      if (said && to) comments.push({line: to.line, text: said.trim()});
    },
  });

  /** What the module imports of the functions. @type {Set<string>} */
  const known = new Set();

  /** @param {Node} node */
  const visit = (node) => {
    if (node.type === "ImportDeclaration" && node.source.value.endsWith("/texts.js"))
      for (const each of node.specifiers) known.add(each.local.name);
    if (node.type === "ImportExpression" && node.source.value?.endsWith?.("/texts.js"))
      for (const name of Object.keys(FUNCTIONS)) known.add(name);
    if (node.type === "CallExpression" && known.has(node.callee.name) && FUNCTIONS[node.callee.name])
      messages.push(messageOf(node, file, comments));
    if (node.type === "TaggedTemplateExpression" && TEMPLATES.has(node.tag.name))
      for (const each of inTemplate(node.quasi, source)) find(each.node, each.what, each);
    if (node.type === "Property" && PROPERTIES.has(node.key.name ?? node.key.value)) find(node.value, node.key.name);
    if (node.type === "AssignmentExpression" && PROPERTIES.has(node.left.property?.name))
      find(node.right, node.left.property.name);
    if (node.type === "CallExpression" && CALLS.has(node.callee.name)) find(node.arguments[0], node.callee.name);
    if (node.type === "CallExpression" && node.callee.property?.name === "setAttribute")
      if (ATTRIBUTES.test(node.arguments[0].value)) find(node.arguments[1], node.arguments[0].value);
    for (const child of childrenOf(node)) visit(child);
  };

  /**
   * Note the words of an expression that are not the argument of a function for texts.
   *
   * @param {Node | undefined} node @param {string} what it is for
   * @param {{text?: string, start?: number, end?: number}} [given] if it is not an expression
   */
  const find = (node, what, given = {}) => {
    for (const leaf of given.text === undefined ? leavesOf(node) : [given]) {
      if (!isWords(leaf.text)) continue;
      const line = source.slice(0, leaf.start).split("\n").length;
      unwrapped.push({file, line, text: leaf.text, start: leaf.start, end: leaf.end, what});
    }
  };

  visit(tree);
  return {messages, unwrapped: unwrapped.sort((one, other) => one.start - other.start)};
}

/** Whether a text, with `{}` for its values, has words of a language. @param {string} text */
const isWords = (text) =>
  text
    .split("{}")
    .map((piece) => piece.replace(/^[^\p{L}]+|[^\p{L}\d]+$/gu, ""))
    .some((piece) => /\p{L}{2}/u.test(piece) && !SAME.has(piece));

/** @param {Node} node @returns {Node[]} */
function childrenOf(node) {
  return Object.values(node).flatMap((each) =>
    Array.isArray(each) ? each.filter((item) => item?.type) : each?.type ? [each] : [],
  );
}

/** @param {Node} call @param {string} file @param {{line: number, text: string}[]} comments */
function messageOf({callee, arguments: given, loc}, file, comments) {
  const [id, plural] = given.slice(0, FUNCTIONS[callee.name]).map((/** @type {Node} */ each) => constant(each));
  const {line} = loc.start;
  if (id === undefined || (FUNCTIONS[callee.name] === 2 && plural === undefined))
    throw new Error(`${file}:${line}: ${callee.name}(...) needs texts that are written there`);
  const comment = comments.find((each) => each.line === line || each.line === line - 1)?.text;
  return {id, ...(plural !== undefined && {plural}), file, line, ...(comment && {comment})};
}

/** The text of an expression without variables. @param {Node} node @returns {string | undefined} */
function constant(node) {
  if (node?.type === "Literal" && typeof node.value === "string") return node.value;
  if (node?.type === "TemplateLiteral" && !node.expressions.length) return node.quasis[0].value.cooked;
  if (node?.type !== "BinaryExpression" || node.operator !== "+") return undefined;
  const [left, right] = [constant(node.left), constant(node.right)];
  return left === undefined || right === undefined ? undefined : left + right;
}

/** The texts that an expression may be. @param {Node} node @returns {{text: string, start: number, end: number}[]} */
function leavesOf(node) {
  if (!node) return [];
  const {type, start, end} = node;
  if (type === "ConditionalExpression") return [...leavesOf(node.consequent), ...leavesOf(node.alternate)];
  if (type === "LogicalExpression") return [...leavesOf(node.left), ...leavesOf(node.right)];
  const whole = type === "BinaryExpression" ? constant(node) : undefined;
  if (whole !== undefined) return [{text: whole, start, end}];
  if (type === "BinaryExpression")
    return node.operator === "+" ? [...leavesOf(node.left), ...leavesOf(node.right)] : [];
  if (type === "Literal") return typeof node.value === "string" ? [{text: node.value, start, end}] : [];
  if (type === "ArrowFunctionExpression" && node.body.type !== "BlockStatement") return leavesOf(node.body);
  if (type !== "TemplateLiteral") return [];
  const text = node.quasis.map((/** @type {Node} */ each) => each.value.cooked).join("{}");
  return [{text, start, end}, ...node.expressions.flatMap(leavesOf)];
}

/**
 * The words in a template: of its text, of its attributes, and of the expressions in both.
 *
 * @param {Node} quasi @param {string} source
 */
function inTemplate({quasis, expressions}, source) {
  // The parser sees the template with a mark of the same length instead of each expression.
  const {start} = quasis[0];
  const {end} = quasis.at(-1);
  let text = "";
  for (const [index, each] of quasis.entries()) {
    text += source.slice(each.start, each.end);
    if (index < expressions.length) text += "\uE000".repeat(quasis[index + 1].start - each.end);
  }
  /** @type {any[]} */
  const found = [];
  /** @param {number} from @param {number} to @param {string} what */
  const expressionsIn = (from, to, what) => {
    for (const each of expressions)
      if (each.start - start >= from && each.end - start <= to) found.push({node: each, what});
  };
  /** @param {any} node @param {boolean} isCode */
  const visit = (node, isCode) => {
    const isText = node.nodeName === "#text";
    const location = node.sourceCodeLocation;
    if (isText && location && !isCode) {
      const {startOffset: from, endOffset: to} = location;
      const words = node.value.replace(/\uE000+/g, "{}");
      found.push({text: words, what: "text", start: start + from, end: start + to});
      expressionsIn(from, to, "text");
    }
    for (const {name, value} of node.attrs ?? []) {
      const place = location?.attrs?.[name];
      if (!place || !ATTRIBUTES.test(name)) continue;
      found.push({
        text: value.replace(/\uE000+/g, "{}"),
        what: name,
        start: start + place.startOffset,
        end: start + place.endOffset,
      });
      expressionsIn(place.startOffset, place.endOffset, name);
    }
    const inner = isCode || CODE.has(node.nodeName);
    for (const child of node.content?.childNodes ?? node.childNodes ?? []) visit(child, inner);
  };
  visit(parseFragment(text, {sourceCodeLocationInfo: true}), false);
  return end > start ? found : [];
}

/** The texts of all modules. */
export function allTexts() {
  const found = modules().map((name) => textsOf(readFileSync(fileOf(name), "utf-8"), name));
  return {messages: found.flatMap(({messages}) => messages), unwrapped: found.flatMap(({unwrapped}) => unwrapped)};
}

if (process.argv[1] && relative(process.argv[1], fileURLToPath(import.meta.url)) === "")
  process.stdout.write(JSON.stringify(allTexts()));
