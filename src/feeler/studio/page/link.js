// @ts-check
import { unpack } from "./record.js";
/**
 * Several hosts, one way to talk (a standalone page has its engine, in alone.js): `send(message)`; what comes back goes to `hear(header, arrays)`.
 * @typedef {{send: (message: any) => void, close: () => void}} Link
 * @typedef {(header: any, arrays: any) => void} Hear
 */

const AGAIN = 600; // ms
const TRY_LATER = 1013; // the server has too many pages open

/** The local server; after it was away, `tell("on")` is called anew. @param {Hear} hear @param {(s: "on"|"off"|"full") => void} tell @returns {Link} */
export function linkServer(hear, tell) {
  /** @type {WebSocket|null} */
  let socket = null;
  let closed = false;
  /** @type {any[]} */
  let waiting = [];
  const connect = () => {
    const address = new URL("live", location.href);
    address.protocol = "ws:";
    address.hash = address.search = "";
    const mine = new WebSocket(address);
    socket = mine;
    mine.binaryType = "arraybuffer";
    mine.onopen = () => {
      tell("on");
      for (const message of waiting.splice(0)) mine.send(JSON.stringify(message));
    };
    mine.onmessage = (event) => hear(...unpack(event.data));
    mine.onclose = (event) => {
      if (closed) return;
      tell(event.code === TRY_LATER ? "full" : "off");
      waiting = [];
      setTimeout(connect, AGAIN);
    };
  };
  connect();
  // the browser takes its time to close the connection of a page that has gone
  addEventListener("pagehide", () => {
    if (socket && socket.readyState === 1) socket.send('{"type": "stop"}');
  });
  return {
    send: (message) => {
      if (socket && socket.readyState === 1) socket.send(JSON.stringify(message));
      else if (socket && socket.readyState === 0) waiting.push(message);
    },
    close: () => {
      closed = true;
      if (socket) socket.close();
    },
  };
}

/** A notebook's kernel, by anywidget's model. @param {any} model @param {Hear} hear @param {(s: "on"|"off") => void} tell @returns {Link} */
export function linkModel(model, hear, tell) {
  const take = (/** @type {any} */ _content, /** @type {DataView[]} */ buffers) => {
    for (const view of buffers || []) {
      const copy = new Uint8Array(view.byteLength);
      copy.set(new Uint8Array(view.buffer, view.byteOffset, view.byteLength));
      hear(...unpack(copy.buffer));
    }
  };
  model.on("msg:custom", take);
  setTimeout(() => tell("on"));
  return { send: (message) => model.send(message), close: () => model.off("msg:custom", take) };
}
