/** The page promises to work in certain browsers: those that have all that its code needs. */

import assert from "node:assert/strict";
import {readdirSync, readFileSync} from "node:fs";
import {test} from "node:test";

import {STATIC} from "./page.js";

/**
 * What the page does not work without, how its code names it, and in which version of Firefox, Safari and Chromium it
 * came, by the data on browsers of MDN. What only looks better with it, or has another way, is left out.
 *
 * @type {[name: string, use: RegExp, came: [firefox: number, safari: number, chromium: number]][]}
 */
const NEEDED = [
  ["popovers", /:popover-open/, [125, 17, 114]],
  [":has()", /:has\(/, [121, 15.4, 105]],
  ["toSorted", /\.toSorted\(/, [115, 16, 110]],
  ["unpacking", /new DecompressionStream/, [113, 16.4, 80]],
  ["color-mix()", /color-mix\(/, [113, 16.2, 111]],
  ["container queries", /@container /, [110, 16, 105]],
  ["import maps", /type="importmap"/, [108, 16.4, 89]],
  ["looking behind", /\(\?<[=!]/, [78, 16.4, 62]],
];

/** What came later. */
const LATER = [
  /\b(Promise\.(try|withResolvers)|fromAsync|(Object|Map)\.groupBy|Iterator\.from|RegExp\.escape|AbortSignal\.timeout)\b/,
  /\.(values|keys|entries)\(\)\s*\.(map|filter|take|drop|flatMap|reduce|toArray|forEach|some|every|find)\(/,
  /\.(union|intersection|difference|symmetricDifference|isSubsetOf|isSupersetOf|isDisjointFrom|checkVisibility)\(/,
  /\b(startViewTransition|documentPictureInPicture|showPicker|moveBefore|closedby|commandfor)\b/,
  /@(starting-style|scope |position-try|property --)|\b(anchor-name|position-anchor|text-wrap|interpolate-size)\b|^\s*&/m,
];

const files = readdirSync(STATIC, {recursive: true, encoding: "utf8"}).filter(
  (name) => /\.(js|css|html)$/.test(name) && !name.startsWith("vendor"),
);
const code = files.map((name) => readFileSync(new URL(name, STATIC), "utf8"));
const [newest] = NEEDED;
const [firefox, safari, chromium] = newest[2];

test("the newest thing that the page needs is what tells older browsers apart", () => {
  for (const [name, use, came] of NEEDED) {
    assert.ok(
      came.every((version, browser) => version <= newest[2][browser]),
      name,
    );
    assert.ok(
      code.some((text) => use.test(text)),
      `nothing uses ${name}`,
    );
  }
  assert.ok(code.some((text) => text.includes("@supports selector(:popover-open) { .too-old { display: none; } }")));
});

test("the page and its documentation name the versions in which it came", () => {
  const page = readFileSync(new URL("index.html", STATIC), "utf8");
  assert.ok(page.includes(`Firefox ${firefox}, Safari ${safari}, Chromium, Chrome or Edge ${chromium}`));
  assert.ok(page.includes(`Firefox ${firefox}, Safari ${safari}, Chromium, Chrome o Edge ${chromium}`));
  const documentation = readFileSync(new URL("../../docs/how-to/editor.md", import.meta.url), "utf8");
  assert.ok(documentation.includes(`Firefox ${firefox}, Safari ${safari}, Chromium, Chrome and Edge ${chromium}`));
});

test("nothing later is used", () => {
  const found = code.flatMap((text, index) =>
    LATER.filter((use) => use.test(text)).map((use) => `${files[index]}: ${text.match(use)?.[0]}`),
  );
  assert.deepEqual(found, []);
});

test("what Safari knows by another name has that, too", () => {
  for (const text of code) assert.doesNotMatch(text, /(?<!-webkit-user-select: none; |-webkit-)\buser-select/);
});
