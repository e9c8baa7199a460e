// @ts-check
import { make, makePanel, makeSlider, show, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** @typedef {import("./panels.js").Panel} Panel */
/** An antenna of one's own: a board that sends while it feels, and recordings. */

/** @param {App} app */
export function makeBoardPanel(app) {
  const ports = make("select", { "aria-label": "Serial port", class: "ports" });
  const again = make("button", { type: "button", class: "plain small", text: "look again", onclick: () => app.send({ type: "ports" }) });
  const listen = make("button", { type: "button", class: "plain strong", onclick: () => app.listen(app.listening ? "" : ports.value) });
  const speed = makeSlider({ label: "Speed of your touches", min: 0.02, max: 1, log: true, unit: "m/s", marks: [0.06, 0.3, 0.6], tag: "own",
    read: () => app.store.state.touch.speed, take: (v, done) => app.store.change((/** @type {any} */ s) => { s.touch.speed = v; }, done) });
  const facts = make("dl", { class: "facts" });
  const words = make("p", { class: "caption" });

  function update() {
    const names = Object.keys(app.ports), record = app.records.A;
    if (ports.dataset.now !== names.join()) {
      ports.dataset.now = names.join();
      ports.replaceChildren(...names.map((name) => make("option", { value: name, text: name, title: app.ports[name] })));
    }
    show(ports, names.length > 0);
    listen.textContent = app.listening ? "Stop" : "Listen";
    listen.disabled = !names.length && !app.listening;
    words.textContent = (names.length ? "" : "No board found. ") +
      `A board sends a line per sample: one number per sensor, the time in ms before them if it likes. ${app.calibrated ? "The sensors' calibration is open." : "Angles in rad; for capacitance open the calibration (.json) first."} A recording (.csv) is opened, or dropped on the page. The verdict knows thirty simulated touches at the speed below, and nothing else.`;
    speed.update();
    const rows = record.live ? [["samples a second", write(1000 / record.interval)], ["missing", String(record.missing)], ["lines that are none", String(record.damaged)]]
      : record.name ? [["recording", record.name], ["samples a second", write(record.rate)], ["source", record.source]] : [];
    facts.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", { text: name }), make("dd", { text: value })]));
    show(facts, rows.length > 0);
  }
  const element = makePanel("Own antenna", "board-panel", make("div", { class: "row" }, ports, listen, again), words, speed.element, facts);
  return /** @type {Panel} */ ({ element, place: "left", isShown: () => app.store.state.mode === "board", update });
}
