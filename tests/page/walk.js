/**
 * Walks through the page in Firefox as a user would: `node walk.js FIREFOX ADDRESS`, of an editor with the states `wait`
 * and `go` and a robot. Ends with an error where something is not seen within a limit.
 */

/* global document */

import assert from "node:assert/strict";

const PUPPETEER = /** @type {string} */ ("puppeteer-core"); // it may not be installed
const LIMIT = {timeout: 30_000};
const [, , firefox, address] = process.argv;
const {launch} = (await import(PUPPETEER)).default;
const browser = await launch({browser: "firefox", executablePath: firefox, headless: true, defaultViewport: null});

/** @type {string[]} */
const errors = [];

/** Open the page in a window. @param {string} url */
async function open(url) {
  const page = await browser.newPage();
  await page.setViewport({width: 1280, height: 800});
  page.on("pageerror", (/** @type {Error} */ error) => errors.push(String(error)));
  await page.goto(url);
  await page.waitForSelector("hfsm-canvas .state", LIMIT);
  /** @param {string} selector @param {string} text that an element is to have, or its name */
  const see = (selector, text = "") =>
    page.waitForFunction(
      (/** @type {string} */ sought, /** @type {string} */ words) =>
        [...document.querySelectorAll(sought)].some((each) => `${each.ariaLabel} ${each.textContent}`.includes(words)),
      LIMIT,
      selector,
      text,
    );
  /** @param {string[]} keys such as `Control+c` */
  const press = async (...keys) => {
    for (const all of keys) {
      const parts = all.split("+");
      for (const key of parts.slice(0, -1)) await page.keyboard.down(key);
      await page.keyboard.press(parts.at(-1));
      for (const key of parts.slice(0, -1).reverse()) await page.keyboard.up(key);
    }
  };
  /** @param {number} count */
  const countStates = (count) =>
    page.waitForFunction(
      (/** @type {number} */ wanted) => document.querySelectorAll("hfsm-canvas .state").length === wanted,
      LIMIT,
      count,
    );
  /** @param {string} name */
  const choose = (name) => page.click(`hfsm-canvas .state[aria-label^="State ${name}"] .body`);
  return {page, see, press, countStates, choose};
}

try {
  const one = await open(address);
  const {page, see, press} = one;

  // Draw two states and a transition, with keys.
  await one.choose("go");
  for (const name of ["walk", "rest"]) {
    await press("s", "Enter");
    await see(".rename");
    await page.keyboard.type(name);
    await press("Enter");
    await see("hfsm-canvas .state", `State ${name}`);
  }
  await one.choose("wait");
  await press("t", ".", "Enter");
  await see(".rename");
  await page.keyboard.type("later");
  await press("Enter");
  await see("hfsm-canvas .transition", "Transition later from wait to go");

  // Copy, and paste in a second window; undo.
  await one.choose("walk");
  await press("Control+c");
  const two = await open(new URL("/", address).href);
  await two.page.bringToFront();
  await two.choose("wait");
  await two.press("Control+v");
  await two.see("hfsm-canvas .state", "State walk 2");
  await two.press("Control+z");
  await two.countStates(4);
  await two.page.close();
  await page.bringToFront();
  await one.countStates(4);

  // A menu by a key.
  await one.choose("wait");
  await press("Shift+F10");
  await see("[role=menu]", "State wait");
  await press("Escape");

  // Code with completion.
  await press("Shift+Enter");
  await page.waitForSelector(".side >>> .cm-content", LIMIT);
  await page.waitForFunction(() => document.activeElement?.closest(".side"), LIMIT);
  await press("Control+a");
  await page.keyboard.type("self.lo");
  await page.waitForSelector(".side >>> .cm-tooltip-autocomplete", LIMIT);
  await press("Enter");
  await page.waitForSelector(".side >>> .cm-tooltip-autocomplete", {...LIMIT, hidden: true});
  const code = await page.$eval(".side >>> .cm-content", (/** @type {HTMLElement} */ each) => each.innerText);
  assert.match(code, /^self\.log/);
  await page.keyboard.type(".info('walked')");
  await press("Escape", "Escape");

  // Run, pause, and STOP.
  await press("F5");
  await see(".live-status", "Running");
  await press("F8");
  await see(".live-status", "Paused");
  await press("F8");
  await see(".live-status", "Running");
  await press("Control+Shift+ ");
  await see(".banner", "The robot is stopped");

  // Dark, and Spanish.
  await press("Alt+d");
  await see('html[data-theme="dark"]');
  await page.evaluate(() => localStorage.setItem("visualhfsm.language", "es"));
  await page.reload();
  await see("hfsm-menubar", "Archivo");
  assert.deepEqual(errors, []);
} catch (error) {
  for (const page of await browser.pages()) process.stderr.write(await page.evaluate(() => document.body.innerText));
  throw error;
} finally {
  await browser.close();
}
