/** A series of trials in one file, without a server: the content is a `TrialsView` from visualhfsm/trials/_page.py. */

import {html, render} from "lit";

import {iconButton} from "../kit/icons.js";
import {messageOf} from "../kit/notices.js";
import {n, t} from "../kit/texts.js";
import {currentTheme, initTheme, switchTheme} from "../kit/theme.js";
import "../trials/trials-view.js";
import {unpacked, unpackedData} from "./unpacked.js";

async function show() {
  const view = unpacked(await unpackedData());
  const theme = () => {
    switchTheme();
    draw();
  };
  const draw = () =>
    render(
      html`<div class="trials-page">
        <header>
          <h1>${view.name}</h1>
          <p>${n("{count} trial", "{count} trials", view.share.trials)}</p>
          ${iconButton(currentTheme() === "dark" ? "sun" : "moon", t("Light or dark"), theme)}
        </header>
        <main><hfsm-trials .view=${view}></hfsm-trials></main>
      </div>`,
      document.body,
    );
  draw();
}

initTheme();
show().catch((error) => {
  document.body.textContent = t("This page cannot be shown: {reason}. It needs a browser of 2023 or later.", {
    reason: messageOf(error),
  });
});
