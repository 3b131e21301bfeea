/**
 * A video of what the 3D view shows of a past run: the browser records it while it plays.
 *
 * @import {RobotDrawing} from "./robot-drawing.js"
 */

import {download} from "../canvas/export.js";
import {page} from "../data/page.js";
import {notify} from "../kit/notices.js";
import {t} from "../kit/texts.js";
import {scrubbing} from "../run/scrubbing.js";

const RATE = 25; // pictures per second, at most
const BITS = 4_000_000; // per second
const PAPER = "#fafbfd"; // behind the robot, where the page shows through otherwise
const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

/**
 * Play from the shown moment to the end, or until somebody pauses, and download what was drawn meanwhile.
 *
 * @param {RobotDrawing} drawing
 */
export async function saveVideo({renderer}) {
  const name = page.component.replace(/\.mcap$/i, "");
  const type = TYPES.find((each) => globalThis.MediaRecorder?.isTypeSupported(each));
  if (!type) {
    notify(t("This browser cannot write videos."), "error");
    return;
  }
  const stream = renderer.domElement.captureStream(RATE);
  const recorder = new MediaRecorder(stream, {mimeType: type, videoBitsPerSecond: BITS});
  /** @type {Blob[]} */
  const parts = [];
  recorder.addEventListener("dataavailable", ({data}) => parts.push(data));
  const ended = new Promise((resolve) => recorder.addEventListener("stop", resolve, {once: true}));
  const follow = () => {
    if (!scrubbing.plays && recorder.state === "recording") recorder.stop();
  };
  renderer.setClearColor(PAPER, 1);
  scrubbing.addEventListener("play", follow);
  try {
    recorder.start();
    scrubbing.play();
    await ended;
  } finally {
    scrubbing.removeEventListener("play", follow);
    renderer.setClearAlpha(0);
    for (const track of stream.getTracks()) track.stop();
  }
  const path = `${name}.${type.includes("webm") ? "webm" : "mp4"}`;
  download(path, new Blob(parts, {type}));
  notify(t("Saved {path}.", {path}));
}
