/** Images from the server: always the newest, once the previous one is drawn. */

import {socketAddress} from "../kit/location.js";
import {messageOf} from "../kit/notices.js";
import {store} from "../data/store.js";
import {language} from "../kit/texts.js";

const AGAIN = 1500; // ms until a lost connection is retried

/**
 * Receive frames until `close` is called.
 *
 * @param {string} path of the websocket, relative to the page
 * @param {{draw: (frame: ArrayBuffer, isFirst: boolean) => Promise<void> | void, lost: (reason: string) => void,
 *   told?: (text: string) => void}}
 *   handlers the next frame is
 *   asked for when `draw` is done; its second argument says which one is the first of a connection;
 *   `told` gets text that comes between frames
 * @returns {{close: () => void}}
 */
export function receiveFrames(path, {draw, lost, told}) {
  const kept = store.exported?.frames[path];
  if (kept) {
    draw(kept, true);
    return {close() {}};
  }
  /** @type {WebSocket | undefined} */
  let socket;
  let timer = 0;
  let closed = false;
  const open = () => {
    const mine = new WebSocket(socketAddress(`${path}?language=${language}`));
    mine.binaryType = "arraybuffer";
    socket = mine;
    let isFirst = true;
    mine.addEventListener("message", async ({data}) => {
      try {
        const begins = isFirst;
        isFirst = false;
        if (typeof data === "string") told?.(data);
        else await draw(data, begins);
      } catch (error) {
        lost(messageOf(error));
      }
      if (mine.readyState === WebSocket.OPEN) mine.send("drawn");
    });
    mine.addEventListener("close", ({reason}) => {
      if (closed) return;
      lost(reason);
      timer = setTimeout(reopen, AGAIN);
    });
  };
  /** A page that is not let in, or has no server, asks for its messages alone: that decides for frames, too. */
  const reopen = () => {
    if (closed) return;
    if (store.online) open();
    else store.addEventListener("connection", reopen, {once: true});
  };
  open();
  return {
    close() {
      closed = true;
      clearTimeout(timer);
      socket?.close();
    },
  };
}
