// @ts-check
import { startServed } from "./studio.js";
/** The local server's page. */

startServed(/** @type {HTMLElement} */ (document.getElementById("studio")));
