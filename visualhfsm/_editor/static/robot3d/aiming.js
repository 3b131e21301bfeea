/**
 * Where in the drawing somebody points, and clicks without turning the view.
 *
 * @import {RobotDrawing} from "./robot-drawing.js"
 */

import {Raycaster, Vector2} from "three";

const STILL = 5; // pixels that the pointer may move in a click

/** The ray through what is pointed at. @param {RobotDrawing} drawing @param {PointerEvent} event */
export function aim({stage, viewpoints}, {clientX, clientY}) {
  const {left, top, width, height} = stage.getBoundingClientRect();
  const at = new Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height);
  const ray = new Raycaster();
  ray.setFromCamera(at, viewpoints.camera);
  return ray;
}

/**
 * Call `act` for each click on the drawing.
 *
 * @param {RobotDrawing} drawing @param {AbortSignal} signal @param {(event: PointerEvent) => void} act
 */
export function onClick({stage, renderer}, signal, act) {
  /** @type {PointerEvent | undefined} */
  let down;
  const listen = (/** @type {string} */ kind, /** @type {(event: any) => void} */ handler) =>
    stage.addEventListener(kind, handler, {capture: true, signal});
  listen("pointerdown", (event) => (down = event.button === 0 ? event : undefined));
  listen("pointercancel", () => (down = undefined));
  listen("pointerup", (event) => {
    const way = down ? Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) : Infinity;
    const begun = down?.target;
    down = undefined;
    if (begun === renderer.domElement && way <= STILL) act(event);
  });
}
