/** Record the followed component into a file, with pictures at the rate that this browser remembers. */

import {ask} from "../data/commands.js";
import {confirm} from "../kit/dialog.js";
import {notify} from "../kit/notices.js";
import {browserStorage} from "../kit/location.js";
import {store} from "../data/store.js";
import {t} from "../kit/texts.js";
import {play} from "./documents.js";
import {monitor} from "./monitor.js";

const RATE = "visualhfsm.recordedPictures";
/** Choices of pictures per second and camera. */
const RATES = [0, 1, 5, 10, 30];
const USUAL = 5;

/** The number of pictures recorded per second and camera. */
export function pictureRate() {
  const kept = browserStorage.getItem(RATE);
  const rate = Number(kept);
  return kept !== null && RATES.includes(rate) ? rate : USUAL;
}

/** Begin or end a recording of the followed component. */
export async function toggleRecording() {
  const {component} = monitor;
  if (monitor.recordedSince) {
    await ask("record", {component, pictures: null});
    return;
  }
  const done = await ask("record", {component, pictures: pictureRate()});
  if (done) awaitEnd(done.recording);
}

/** Offer to play a recording as soon as it has ended, in any window. @param {string} path */
function awaitEnd(path) {
  let begun = false;
  const look = () => {
    const goesOn = store.workspace.present.some(({recording}) => recording && path.endsWith(`/${recording}`));
    if (goesOn) begun = true;
    if (goesOn || !begun) return;
    store.removeEventListener("workspace", look);
    notify(t("The recording is {path}.", {path}), "info", {label: t("Play it"), run: () => play(path)});
  };
  store.addEventListener("workspace", look);
  look();
}

/** Ask how many pictures are to be recorded. */
export async function chooseRate() {
  const now = pictureRate();
  const rates = [...RATES.filter((each) => each !== now), now]; // the last one has the focus
  const rate = await confirm({
    title: t("Pictures in recordings"),
    text: now
      ? t("Per camera and second; currently {rate}. A picture takes about 10 kB.", {rate: now})
      : t("Per camera and second; currently none. A picture takes about 10 kB."),
    choices: rates.map((each) => [String(each), each ? String(each) : t("None"), each === now ? "primary" : ""]),
  });
  if (rate !== undefined) browserStorage.setItem(RATE, rate);
}
