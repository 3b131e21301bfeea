/** A series of trials in one file, without a server: the content is a `TrialsView` from plugins/trials/src/visualhfsm_trials/_page.py. */

import {html, render} from "lit";

import {n} from "visualhfsm/kit/texts.js";
import "./trials-view.js";
import {begin, themeButton} from "visualhfsm/onefile/frame.js";
import {unpacked, unpackedData} from "visualhfsm/onefile/unpacked.js";

async function show() {
  const view = unpacked(await unpackedData());
  const draw = () =>
    render(
      html`<div class="trials-page">
        <header>
          <h1>${view.name}</h1>
          <p>${n("{count} trial", "{count} trials", view.share.trials)}</p>
          ${themeButton(draw)}
        </header>
        <main><hfsm-trials .view=${view}></hfsm-trials></main>
      </div>`,
      document.body,
    );
  draw();
}

begin(show);
