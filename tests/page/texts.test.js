/** Texts of the page: shown in its language, and found in its modules. */

import assert from "node:assert/strict";
import test from "node:test";

import {STATIC} from "./page.js";
import {allTexts, textsOf} from "./page-texts.js";

/** The module of a page with languages. @param {string} languages @param {string[]} browser @param {object} [texts] */
async function loaded(languages, browser, texts = {}) {
  const root = {lang: ""};
  const former = globalThis.document;
  const inFile = {textContent: JSON.stringify(texts)};
  const attribute = {getAttribute: () => languages};
  const document = {documentElement: root, querySelector: () => attribute, getElementById: () => inFile};
  Object.assign(globalThis, {document});
  Object.assign(navigator, {languages: browser});
  const module = await import(new URL(`kit/texts.js?${Math.random()}`, STATIC).href);
  Object.assign(globalThis, {document: former});
  return {...module, lang: root.lang};
}

const SPANISH = {
  "Run {name}": "Ejecutar {name}",
  "{count} state": {one: "{count} estado", many: "{count} de estados", other: "{count} estados"},
};

test("the page has the first language of the browser that there is", async () => {
  assert.equal((await loaded("es pt-BR", ["fr-FR", "es-MX", "en"])).language, "es");
  assert.equal((await loaded("es pt-BR", ["pt-BR"])).language, "pt-BR");
  assert.equal((await loaded("es", ["en-GB", "es"])).language, "en");
  assert.equal((await loaded("", ["fr"])).lang, "en");
  assert.equal((await loaded("es", ["es"])).lang, "es");
});

test("the language that was chosen comes before those of the browser", async () => {
  localStorage.setItem("visualhfsm.language", "es");
  assert.equal((await loaded("es", ["en"])).language, "es");
  assert.equal((await loaded("", ["en"])).language, "en");
  localStorage.setItem("visualhfsm.language", "");
});

test("a text has the values of its placeholders, in every language", async () => {
  assert.equal((await loaded("", ["en"])).t("Run {name}", {name: "$&{name}"}), "Run $&{name}");
  const {t} = await loaded("es", ["es"], SPANISH);
  assert.equal(t("Run {name}", {name: "dance"}), "Ejecutar dance");
  assert.equal(t("not translated"), "not translated");
});

test("a text with a number has the plural of its language", async () => {
  const english = await loaded("", ["en"]);
  const spanish = await loaded("es", ["es"], SPANISH);
  /** @param {typeof english} texts */
  const counted = ({n}) => [0, 1, 2, 1_000_000].map((count) => n("{count} state", "{count} states", count));
  assert.deepEqual(counted(english), ["0 states", "1 state", "2 states", "1000000 states"]);
  assert.deepEqual(counted(spanish), ["0 estados", "1 estado", "2 estados", "1000000 de estados"]);
});

test("a text may have elements as values", async () => {
  const element = {tag: "kbd"};
  assert.deepEqual((await loaded("es", ["es"], SPANISH)).rich("Run {name}", {name: element}), [
    "Ejecutar ",
    element,
    "",
  ]);
});

test("numbers in prose have the point or comma of the language", async () => {
  assert.equal((await loaded("", ["en"])).decimal(1234.56, 1), "1,234.6");
  assert.equal((await loaded("es", ["es"])).decimal(2.5, 2), "2,50");
});

const IMPORT = 'import {n, rich, t} from "./texts.js";\n';

test("texts are found wherever they are in a template", () => {
  const source = `${IMPORT}html\`<p title=\${t("Title")}>\${some ? html\`<b>\${t("Inner {a}", {a})}</b>\` : t("El" + "se")}
    \${rich("Press {key}", {key: html\`<kbd>\${n("{count} key", "{count} keys", 2)}</kbd>\`})}</p>\``;
  const {messages, unwrapped} = textsOf(source, "some.js");
  assert.deepEqual(
    messages.map(({id, plural}) => (plural ? [id, plural] : id)),
    ["Title", "Inner {a}", "Else", "Press {key}", ["{count} key", "{count} keys"]],
  );
  assert.deepEqual(unwrapped, []);
});

test("a comment for translators goes with its text", () => {
  const source = `${IMPORT}// Translators: a verb\nconst label = t("Run");`;
  assert.equal(textsOf(source, "some.js").messages[0].comment, "a verb");
});

test("texts are found in a module that loads the functions later", () => {
  const source = 'const {t} = await import("./texts.js"); t("Later");';
  assert.equal(textsOf(source, "some.js").messages[0].id, "Later");
});

test("a text that is not written where it is used is refused", () => {
  assert.throws(() => textsOf(`${IMPORT}t(name)`, "some.js"), /some\.js:2: t\(\.\.\.\) needs texts that are written/);
  assert.throws(() => textsOf(`${IMPORT}n("one", many, 2)`, "some.js"), /some\.js:2: n/);
});

test("words that nobody can translate are found", () => {
  const source = `
    html\`<p>Words <b>\${a ? "Yes" : nothing}</b> <code>code</code> 12 \${"…"}</p>
      <input placeholder="Type" aria-label=\${\`Name of \${a}\`} class="field" .value=\${"value"}>
      <svg viewBox="0 0 1 1"><title>Sign</title></svg>\`;
    const action = {label: "Run", id: "run", hint: some || "hint"};
    notify("Done" + name);
    element.setAttribute("aria-label", "Label");
    element.title = "Title";`;
  const {unwrapped} = textsOf(source, "some.js");
  assert.deepEqual(
    unwrapped.map(({text, line}) => `${line} ${text.trim()}`),
    ["2 Words", "2 Yes", "3 Type", "3 Name of {}", "4 Sign", "5 Run", "5 hint", "6 Done", "7 Label", "8 Title"],
  );
});

test("all words of the page can be translated", () => {
  assert.deepEqual(
    allTexts().unwrapped.map(({file, line, text}) => `${file}:${line}: ${text.trim()}`),
    [],
  );
});
