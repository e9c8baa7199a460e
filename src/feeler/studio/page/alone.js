// @ts-check
import { makeBlindPanel } from "./blind.js";
import { findDecision, makeVerdictPanel } from "./charts.js";
import { makeIcon } from "./controls.js";
import { make, makeChoice, makePanel, write } from "./dom.js";
import { makeLivingPanel } from "./living.js";
import { makeStagePanel, makeTensorPanel } from "./stage.js";
import { App, makeStatus } from "./studio.js";
/** @typedef {import("./link.js").Hear} Hear */
/** @typedef {import("./link.js").Link} Link */
/** A standalone page: antenna left, tensor right, verdict below, and a few switches. */

const CLOSE = 0.15; // of the length: what bends so close to a place bends there
const SENTENCE = "With the same noise on every reading, a slow touch of a graded antenna is classified best: it bends where it is touched, and the touch lasts ten times as long " +
  "as a fast one. A fast touch is over sooner, so what is decided is decided sooner, but less is. A uniform antenna bends at its base, and less: neither speed is enough for it.";

/** @param {any} config */
function makeSteps(config) {
  const [graded, level] = config.antennas, slow = config.speeds[0].value, fast = config.speeds[config.speeds.length - 1].value;
  const touch = { ...config.state.touch, speed: slow }, mode = "touch";
  return [
    { title: `Slow, ${graded.name}: drag the ball`, look: ".stage-panel", state: { mode, A: graded.wish, touch },
      words: "Drag the ball along the antenna. Its bright band in the tensor goes along: the antenna bends near the place that is touched." },
    { title: `Slow, ${level.name}: drag it again`, look: ".tensor-panel", state: { mode, A: level.wish, touch },
      words: "Now all hinges are uniform. Drag the ball: the antenna bends most at its base wherever it is touched, and less: its tensor is dark on the same colour scale, and the verdict stays unsure." },
    { title: "And fast?", look: ".tensor-panel", state: { mode, A: graded.wish, touch: { ...touch, speed: fast } },
      words: "The same ball, ten times as fast: it is gone after a tenth of the time, and few samples are left of it. A verdict comes sooner, if it comes: over held-out touches fewer are classified correctly." },
    { title: "What you have seen", look: ".verdict-panel", state: { mode, A: graded.wish, touch }, words: SENTENCE },
  ];
}

/** Name, switches and what the page is doing. @param {any} config */
function makeSwitches(config) {
  return (/** @type {App} */ app) => {
    const change = (/** @type {(s: any) => void} */ how) => app.store.change(how);
    const antenna = makeChoice("Antenna", config.antennas.map((/** @type {any} */ { name }) => [name, name]),
      () => config.antennas[findAntenna(config, app)].name,
      (name) => change((s) => { s.A = config.antennas.find((/** @type {any} */ one) => one.name === name).wish; }));
    const speed = makeChoice("Speed", config.speeds.map((/** @type {any} */ { name, value }) => [String(value), name]),
      () => String(app.store.state.touch.speed), (value) => change((s) => { s.touch.speed = Number(value); }));
    const kinds = config.state.touch.kind === "wall" ? ["ball", "box", "triangle", "wall"] : ["ball", "box", "triangle"];
    const kind = makeChoice("Object", /** @type {any} */ (kinds.map((one) => [one, makeIcon(one), one])), () => (app.hidden ? "" : app.store.state.touch.kind),
      (value) => change((s) => { s.touch.kind = value; }));
    const mode = makeChoice("Who moves it", [["touch", "by itself"], ["hand", "by hand"]], () => app.store.state.mode,
      (value) => change((s) => { s.mode = value; }));
    const theme = make("button", { type: "button", class: "plain", "aria-label": "Light or dark", text: "◐", onclick: () => {
      app.root.dataset.theme = app.colours.dark ? "light" : "dark";
      app.refresh();
    } });
    const tourButton = make("button", { type: "button", class: "plain strong", text: "Tour" });
    const status = makeStatus(app), lead = makeLead(config)(app), all = [antenna, speed, kind, mode];
    for (const one of all) one.update(); // before the engine is there
    const named = all.map((one, k) => make("div", { class: "named" }, make("span", { text: ["Antenna", "Speed", "Object", "It moves"][k] }), one.element));
    const element = make("header", {}, make("h1", {}, make("b", { text: "feeler" }), " drag this ball"),
      make("div", { class: "switches" }, ...named), make("div", { class: "tools" }, status.element, tourButton, theme), lead.element);
    return { element, tourButton, update: () => [...all, status, lead].forEach((one) => one.update()) };
  };
}

/** Number of the antenna that is shown. @param {any} config @param {App} app */
function findAntenna(config, app) {
  const text = JSON.stringify(app.store.state.A);
  return Math.max(0, config.antennas.findIndex((/** @type {any} */ one) => JSON.stringify(one.wish) === text));
}

/** What this touch did to the antenna, in a sentence: where it was touched, where it bent, for how long. @param {any} record */
export function readTouch(record) {
  const { contact } = record.data;
  if (!contact) return null;
  const { sensors, segments, length } = record.antenna, places = [];
  const at = [0];
  for (const long of segments) at.push(at[at.length - 1] + long / length);
  let first = NaN;
  for (let k = 0; k < record.filled; k++) {
    if (!Number.isFinite(contact[k])) continue;
    if (Number.isNaN(first)) first = contact[k];
    let best = 0;
    for (let s = 1; s < sensors.length; s++) if (Math.abs(record.angle(s, k)) > Math.abs(record.angle(best, k))) best = s;
    places.push(at[sensors[best] - 1]);
  }
  if (!places.length) return null;
  return { first, bent: places.sort((a, b) => a - b)[places.length >> 1], time: places.length * record.interval };
}

/** How stiffness is spread along an antenna. @param {{stiffness: number[]}} drawn */
function describeGradient({ stiffness }) {
  const ratio = stiffness[0] / stiffness[stiffness.length - 1];
  if (ratio > 0.95 && ratio < 1.05) return "of uniform stiffness";
  return ratio > 1 ? "stiff at its base and soft at its tip" : "soft at its base and stiff at its tip";
}

/** What is seen now, in words: the sentence about slow and graded comes of switching. @param {any} config @param {App} app */
function sayFelt(config, app) {
  if (!["here", "preview"].includes(app.status)) return "";
  const one = config.antennas[findAntenna(config, app)], found = readTouch(app.records.A);
  if (!found) return "Nothing was touched.";
  const near = Math.abs(found.bent - found.first) < CLOSE ? "near the touch" : found.bent < CLOSE ? "at its base" : "away from the touch";
  return `Touched at ${write(100 * found.first, 2)} % of its length, this antenna, ${describeGradient(one.drawn)}, mostly bends at ${write(100 * found.bent, 2)} %: ` +
    `${near}. The touch lasts ${found.time} ms${sayDecision(app)}.`;
}

/** How soon it is told what touched. @param {App} app */
function sayDecision(app) {
  const { reading } = app.records.A;
  if (!reading || reading.old || !app.studies.A || app.isStale()) return "";
  const { best, probability, decided, before } = findDecision(reading, app.studies.A);
  if (best === "outside") return "; it lies outside what this decoder was trained on";
  const revised = before ? `, after it was identified as a ${before.kind} at ${before.at} ms` : "";
  if (decided < 0) return `, and what touched is not identified surely${revised}`;
  return `; identified as a ${best} after ${decided} ms (probability ${probability.toFixed(2)})${revised}`;
}

/** The first and the last of a switch. @param {{name: string}[]} all */
const pair = (all) => `${all[0].name} with ${all[all.length - 1].name}`;

/** What to do, and what came of it. @param {any} config */
function makeLead(config) {
  return (/** @type {App} */ app) => {
    const felt = make("span", { class: "felt", role: "status" });
    const element = make("p", { class: "lead" }, make("b"), felt);
    function invite() {
      const { mode, touch } = app.store.state, hand = mode === "hand", thing = touch.kind;
      element.firstChild.textContent = hand ? `Take the ${thing}, or the dark base, and touch. ` : `Drag the ${thing} along this simulated antenna. Compare ${pair(config.antennas)}, ${pair(config.speeds)}. `;
      if (app.hidden) element.firstChild.textContent = "Something touches the antenna. ";
      return hand;
    }
    function update() {
      const hand = invite();
      const words = app.hidden ? "What is it?" : hand ? "The simulation follows you, slowed down." : sayFelt(config, app);
      if (words) felt.textContent = words;
      felt.classList.toggle("old", !words); // of the touch before, while another is computed
    }
    invite(); // before the engine is there
    return { element, update };
  };
}

/** How many held-out touches are classified correctly with each antenna and speed. @param {any} config */
function makeTallyPanel(config) {
  const { kept, noise } = config.taught, [one] = kept.flat().filter(Boolean);
  const share = (/** @type {any} */ taught) => (taught ? `${Math.round(100 * taught.scores.noisy)} %` : "–");
  return (/** @type {App} */ app) => {
    const table = make("table", { class: "tally" });
    const caption = make("p", { class: "caption", text: one ? `Accuracy (chance: 33 %) on ${one.scores.n} held-out touches by ball, box and triangle at random locations (${write(100 * one.range.location[0])} to ` +
      `${write(100 * one.range.location[1])} % of the length), of random half-widths (${write(one.range.size[0])} to ${write(one.range.size[1])} mm) and at speeds within ${write(100 * config.state.unsure)} %, with white noise of ` +
      `${((180 * noise) / Math.PI).toFixed(2)}° (SD) on each reading, the same for both antennas. The verdict above allows for that noise, but reads the touch without it.` : "" });
    const element = makePanel("Held-out touches", "tally-panel", table, caption);
    function update() {
      const now = findAntenna(config, app), speed = app.store.state.touch.speed;
      const head = make("tr", {}, make("td"), ...config.speeds.map((/** @type {any} */ { name }) => make("th", { scope: "col", text: name })));
      const rows = config.antennas.map((/** @type {any} */ one, /** @type {number} */ a) => make("tr", {}, make("th", { scope: "row", text: one.name }),
        ...config.speeds.map((/** @type {any} */ { value }, /** @type {number} */ s) => make("td", { class: a === now && value === speed ? "now" : "", text: share(kept[a][s]) }))));
      table.replaceChildren(head, ...rows);
    }
    return { element, place: "right", isShown: () => true, update };
  };
}

/** What the page is: antenna, object, speed, paper, and how to get feeler. @param {any} config */
function makeAboutPanel(config) {
  return (/** @type {App} */ app) => {
    const words = make("p"), object = make("p");
    const element = makePanel("About this page", "about-panel", words, object,
      make("p", {}, "The touches are computed here, in your browser, by the engine of feeler ", config.version, ": its numbers to 1e-9 rad. Nothing is sent anywhere. Paper: ",
        make("a", { href: config.doi, text: config.paper }), "."),
      make("p", {}, "feeler is an open Python toolkit; its studio shapes any antenna: ", make("code", { text: "feeler studio" }), config.home ? ". Source and installation: " : ".",
        config.home && make("a", { href: config.home, text: config.home })),
      make("p", { class: "keys", text: "Keys: arrows move the object (in your hand: it, with Shift the base; Escape lets go), + and − change its size, blank plays, comma and full stop step." }));
    function update() {
      const { touch } = app.store.state, one = config.antennas[findAntenna(config, app)].drawn;
      words.textContent = `Antenna: ${one.name}, ${write(one.length)} mm, ${one.segments.length} hinges, ${one.sensors.length} sensors, stiffness ` +
        `${write(one.stiffness[0], 2)} N·mm/rad at the base and ${write(one.stiffness[one.stiffness.length - 1], 2)} at the tip.`;
      object.textContent = app.hidden ? "" : `Object: ${touch.kind}${touch.kind === "wall" ? "" : ` of half-width ${write(touch.size)} mm`}, at ${write(touch.location)} of the length, ${write(touch.speed)} m/s.`;
    }
    return { element, place: "right", isShown: () => true, update };
  };
}

/** @param {(app: App) => any} makeOne @param {string} place */
const put = (makeOne, place) => (/** @type {App} */ app) => ({ ...makeOne(app), place });

/** A panel that a blind round hides. @param {(app: App) => any} makeOne */
const unlessHidden = (makeOne) => (/** @type {App} */ app) => {
  const panel = makeOne(app), { isShown } = panel;
  return { ...panel, isShown: () => isShown() && !app.hidden };
};

/** What the colours of both antennas' tensors span [rad, 1/mm]: the most that any touch of their training bends them. @param {any} config */
function findScale({ taught }) {
  const all = taught ? taught.kept.flat().filter(Boolean) : [], find = (/** @type {string} */ name) => Math.max(...all.map((/** @type {any} */ one) => one[name]));
  return all.length ? { angle: find("peak"), curvature: find("curvature") } : undefined;
}

/** @param {HTMLElement} root */
export function startAlone(root) {
  const read = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id)).textContent || "";
  const config = JSON.parse(read("config"));
  root.classList.add("feeler-alone");
  const app = new App(root, {
    alone: true, scale: findScale(config), rest: config.taught ? 0 : Infinity, header: makeSwitches(config), steps: makeSteps(config),
    panels: [put(makeStagePanel, "left"), put(makeTensorPanel, "middle"), ...(config.taught ? [unlessHidden(makeVerdictPanel), makeTallyPanel(config), makeBlindPanel(config)] : []), makeLivingPanel(config), makeAboutPanel(config)],
  });
  /** @type {any} */ (root).studio = app;
  app.inPage = true;
  app.link = linkEngine(read("engine"), config, (header, arrays) => app.hear(header, arrays), () => app.send({ type: "hello" }));
  return app;
}

/**
 * An engine in the page itself, in a worker where those are allowed. `code` is its module, `config` what it computes with.
 * @param {string} code @param {any} config @param {Hear} hear @param {(s: "on"|"off") => void} tell @returns {Link}
 */
function linkEngine(code, config, hear, tell) {
  const whole = (/** @type {string} */ name) => `(function (port) {"use strict";\n${code}\n})(${name});`;
  const take = (/** @type {MessageEvent} */ event) => hear(event.data.header, event.data.arrays);
  /** @type {any} */
  let port = null;
  const start = () => {
    port.postMessage(config);
    tell("on");
  };
  const stayHere = () => {
    /** @type {any} */
    const inner = { budget: 8, postMessage: (/** @type {any} */ data) => take(/** @type {any} */ ({ data })), onmessage: null };
    Object.assign(window, { feelerPort: inner });
    document.head.append(Object.assign(document.createElement("script"), { textContent: whole("window.feelerPort") }));
    port = { postMessage: (/** @type {any} */ data) => inner.onmessage({ data }), terminate: () => {} };
    start();
  };
  try {
    const worker = new Worker(URL.createObjectURL(new Blob([whole("self")], { type: "text/javascript" })));
    worker.onmessage = take;
    worker.onerror = stayHere;
    port = worker;
    setTimeout(start);
  } catch {
    setTimeout(stayHere);
  }
  return { send: (message) => port.postMessage(message), close: () => port.terminate() };
}
