// @ts-check
import { make, makeChoice, show, write } from "./dom.js";
import { makeScene } from "./scene.js";
import { makeTensor } from "./tensor.js";
import { makeTurnableScene } from "./turnable.js";
/** @typedef {import("./studio.js").App} App */
/** @typedef {import("./panels.js").Panel} Panel */
/** The middle of the page: the scene with its clock, and the tensor below it. */

const PLANE_WORDS = { x: "towards x", z: "towards z", twist: "twist" };
const RATES = [0.01, 0.03, 0.1, 0.3, 1];

/** @param {App} app @returns {Panel} */
export function makeStagePanel(app) {
  const scene = makeScene(app), turned = makeTurnableScene(app), transport = makeTransport(app);
  const views = [scene, turned];
  const element = make("section", { class: "panel stage-panel", "aria-label": "Scene" }, ...views.map((view) => view.element), transport.element);
  function redraw() {
    const now = app.records.A.scene ? turned : scene;
    for (const view of views) show(view.element, view === now);
    now.redraw();
    transport.redraw();
  }
  return { element, place: "middle", isShown: () => true, update: transport.update, redraw };
}

/** Play, the moment shown, and how slowly. @param {App} app */
function makeTransport(app) {
  const play = make("button", { type: "button", class: "play", "aria-label": "Play or pause", onclick: () => app.play(!app.playing) });
  const scrub = make("input", {
    type: "range", class: "scrub", min: 0, max: 379, step: 0.5, "aria-label": "Moment",
    oninput: () => { app.play(false); app.seek(Number(scrub.value)); },
  });
  const clock = make("output", { class: "clock" });
  const rate = make("select", {
    "aria-label": "Slow motion",
    onchange: () => { app.rate = Number(rate.value); app.handPace = Math.min(app.rate, 1); app.refresh(); },
  }, ...RATES.map((value) => make("option", { value: String(value), text: nameRate(value), selected: value === app.rate })));
  const letGo = make("button", { type: "button", class: "plain strong", text: "Let go", onclick: () => app.endHand() });
  const element = make("div", { class: "transport" }, play, scrub, clock, rate, letGo);

  function redraw() {
    scrub.max = String(Math.max(app.duration() - 1, 1));
    if (document.activeElement !== scrub || app.playing) scrub.value = String(app.time);
    clock.textContent = `${app.time.toFixed(app.rate < 0.05 ? 1 : 0)} ms`;
  }
  function update() {
    play.textContent = app.playing ? "❚❚" : "▶";
    show(letGo, app.handOn);
  }
  return { element, redraw, update };
}

/** @param {number} rate */
function nameRate(rate) {
  if (rate === 1) return "real time";
  return `${1 / rate >= 30 ? Math.round(1 / rate) : write(1 / rate, 2)} × slower`;
}

/** @param {App} app @returns {Panel} */
export function makeTensorPanel(app) {
  const tensor = makeTensor(app);
  const quantity = makeChoice("Quantity shown", [["angle", "Angle"], ["curvature", "Curvature"]], () => app.quantity,
    (value) => { app.quantity = value; app.refresh(); });
  const plane = make("select", { "aria-label": "Plane of bending shown", onchange: () => { app.records.A.choose(Number(plane.value)); app.refresh(); } });
  const scale = make("span", { class: "scale" });
  const element = make("section", { class: "panel tensor-panel", "aria-label": "Tensor" },
    make("div", { class: "row spread" }, make("h2", { text: "Tensor" }), make("div", { class: "row" }, scale, plane, quantity.element)), tensor.element);
  function update() {
    quantity.update();
    const { bends, antenna } = app.records.A, names = bends ? antenna.planes.map((/** @type {string} */ name) => PLANE_WORDS[/** @type {"x"} */ (name)]) : [];
    show(plane, names.length > 0);
    if (plane.options.length !== names.length) plane.replaceChildren(...names.map((/** @type {string} */ text, /** @type {number} */ value) => make("option", { value: String(value), text })));
    plane.value = String(app.records.A.plane);
    const peak = app.findPeak();
    const range = app.quantity === "angle" ? `± ${((peak * 180) / Math.PI).toFixed(2)}°` : `± ${write(peak)} /mm`;
    scale.textContent = !peak ? "" : app.records.A.noise ? range : `${range}, colours by square root`;
  }
  return { element, place: "middle", isShown: () => true, update, redraw: tensor.redraw };
}

/** How far the study of this antenna is. @param {App} app @returns {Panel} */
export function makeStudyPanel(app) {
  const doing = make("p", { class: "doing" }), bar = make("progress", { max: 1, value: 0, "aria-label": "Study of this antenna" });
  const element = make("section", { class: "panel study-panel", "aria-label": "Study" }, doing, bar);
  const find = () => app.studying.A || app.studying.B;
  function update() {
    doing.textContent = `Thirty touches of this antenna: ${find().doing} …`;
    bar.value = find().share;
  }
  return { element, place: "right", isShown: () => Boolean(find()), update };
}
