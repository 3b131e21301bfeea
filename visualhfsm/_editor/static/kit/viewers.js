/**
 * Whether the page only looks on: the server refuses whatever else it asks for, see visualhfsm/_editor/viewers.py.
 *
 * @import {Action} from "./registry.js"
 */

/** What viewers can do, besides STOP, which is no action of this kind. */
const ALLOWED = new Set([
  ..."select edit editCode editEntry editExit selectAll cancel up fit fitSelection zoomIn zoomOut wheelZooms menu".split(
    " ",
  ),
  ..."goLeft goRight goUp goDown goNext goBack search problems output tree theme language palette help".split(" "),
  ..."nextTab previousTab followComponent unfollow follow livePanel robotDock robotView cameras timeline backToLive".split(
    " ",
  ),
  ..."layoutDraw layoutRun layoutLookBack newWindow".split(" "),
  ..."interfaces timing variables functions component export stopRobot".split(" "),
]);

/** Set when the server has greeted. */
export const viewing = {on: false};

/** Whether an action changes something, and this page may not. @param {Action} action */
export const isForbidden = ({id}) => viewing.on && !ALLOWED.has(id) && !id.startsWith("language");
