// @ts-check
/* global port */
import { serveHost } from "./host.js";
/** The engine's side of a standalone page. `port` is a worker's own or one within the page; what it says first is the config. */

// @ts-expect-error whoever starts this module hands it a port, see link.js
const outside = /** @type {any} */ (port);
outside.onmessage = (/** @type {MessageEvent} */ event) => serveHost(outside, event.data);
