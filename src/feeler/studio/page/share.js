// @ts-check
import { make, show } from "./dom.js";
import { encodeState, makeWish } from "./state.js";
/** @typedef {import("./studio.js").App} App */
/** Every state can leave: address, script, antenna file, pictures, movie, and a standalone page. */

const LONGEST_WAIT = 120_000; // ms
const WAYS = [
  ["url", "Copy address", "this state as a link to this studio"],
  ["script", "Python script", "gives the same tensor, bit for bit"],
  ["toml", "Antenna (TOML)", "for --antenna and load_antenna"],
  ["svg", "Figure (SVG)", "the tensor, for a paper"],
  ["png", "Figure (PNG)", "the tensor, for a slide"],
  ["csv", "Recording (CSV)", "angles of all sensors over time"],
  ["mp4", "Movie (MP4)", "the touch, slowed down"],
  ["html", "Page (HTML)", "computes by itself, to be sent to somebody"],
];

/** @param {App} app */
export function makeShare(app) {
  const menu = make("div", { class: "menu", role: "menu", "aria-label": "Save" });
  for (const [what, name, words] of WAYS)
    menu.append(make("button", { type: "button", role: "menuitem", onclick: () => { close(); save(what); } }, make("b", { text: name }), make("span", { text: words })));
  const button = make("button", { type: "button", class: "plain strong", "aria-haspopup": "menu", "aria-expanded": "false", text: "Save ▾",
    onclick: () => (menu.hidden ? open() : close()) });
  const element = make("div", { class: "share" }, button, menu);
  show(menu, false);

  function open() {
    show(menu, true);
    button.setAttribute("aria-expanded", "true");
    menu.querySelector("button").focus();
  }
  function close() {
    show(menu, false);
    button.setAttribute("aria-expanded", "false");
  }
  menu.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const items = /** @type {HTMLElement[]} */ ([...menu.children]), now = items.indexOf(/** @type {HTMLElement} */ (document.activeElement));
    if (event.key === "Escape") { close(); button.focus(); }
    else if (event.key === "ArrowDown") items[(now + 1) % items.length].focus();
    else if (event.key === "ArrowUp") items[(now + items.length - 1) % items.length].focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  document.addEventListener("pointerdown", (event) => { if (!element.contains(/** @type {Node} */ (event.target))) close(); });

  /** @param {string} what */
  async function save(what) {
    const state = app.store.state, record = app.records.A;
    if (what === "url") {
      const address = `${location.href.split("#")[0]}#s=${await encodeState(state)}`;
      history.replaceState(null, "", address);
      try {
        await navigator.clipboard.writeText(address);
        app.say("The address is in the clipboard.");
      } catch {
        app.say("The address bar now holds this state: copy it from there.");
      }
      return;
    }
    if (app.isSpatial() && !["script", "toml"].includes(what)) {
      app.say("A touch in space leaves as an address, as a Python script, and its antenna as TOML; feeler touch draws pictures and movies of it.");
      return;
    }
    if (what === "csv") {
      keepFile("feeler-recording.csv", "text/csv", new TextEncoder().encode(writeRecording(record, state.mode === "board" ? record.source || "robot" : "simulation")));
      return;
    }
    if (state.mode === "board" && what !== "toml") {
      app.say("What a real antenna felt leaves as Recording (CSV), and its model as TOML.");
      return;
    }
    const message = { type: "save", what, quantity: app.quantity, unsure: state.unsure, wish: makeWish(state, "A", false), other: state.B && !record.hand ? makeWish(state, "B", false) : null };
    if (record.hand) Object.assign(message, { commands: record.commands, samples: record.filled });
    if (app.away) {
      app.say(app.away === "full" ? "Too many pages are open: close one, then save." : "The server is away: nothing can be saved until it is back.", true);
      return;
    }
    app.saving = true;
    app.say({ mp4: "Drawing the movie …", html: "Teaching the page what it is to discriminate, which takes some seconds …" }[what] || "Writing …", false, LONGEST_WAIT);
    app.send(message);
  }
  return { element, save };
}

/** Angles as a recording, as feeler.robot.load_recording reads it. @param {any} record @param {string} source */
function writeRecording(record, source) {
  const sensors = [...record.index.keys()], lines = [`# source: ${source}`, ["time_ms", ...sensors.map((s) => `hinge${s + 1}_rad`)].join()];
  for (let k = 0; k < record.filled; k++) lines.push([k * record.interval, ...sensors.map((s) => record.angle(s, k))].join());
  return lines.join("\n") + "\n";
}

/** Hand a file to the browser. @param {string} name @param {string} mime @param {Uint8Array<ArrayBuffer>} bytes */
export function keepFile(name, mime, bytes) {
  const link = make("a", { href: URL.createObjectURL(new Blob([bytes], { type: mime })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
