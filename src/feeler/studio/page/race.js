// @ts-check
import { SLOT_COLOURS } from "./colours.js";
import { make, makeCanvas, show } from "./dom.js";
import { makePanel } from "./panels.js";
/** A race: what one observer knows of the shape, under your motion and under a policy's, against time. */

const WINNERS = { you: "You won.", policy: "The policy won.", both: "A tie.", nobody: "Nobody won." };
export const RUN_UP = 4; // mm between antenna and object at the start

/** @param {any} app */
export function makeRace(app) {
  const words = make("p", { class: "verdict", role: "status" }), legend = make("div", { class: "legend" });
  const { canvas, redraw } = makeCanvas({ class: "chart", role: "img", "aria-label": "How sure an observer is of the true shape, over time, by who moves" }, draw);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const record = app.records.A, race = record.race;
    if (!race) return;
    const colours = app.colours, left = 30, bottom = 16, high = h - bottom - 6, wide = w - left - 8, n = race.shapes.length;
    const end = Math.max(60, record.ended ? race.time[findSure(race) + 1] || 0 : 0, record.filled * record.interval);
    const shown = record.ended ? end : record.filled * record.interval;
    const x = (/** @type {number} */ t) => left + (wide * t) / end, y = (/** @type {number} */ p) => 6 + high * (1 - p);
    c.font = "11px system-ui, sans-serif";
    for (const share of [0, 0.5, race.sure, 1]) {
      c.strokeStyle = colours.line;
      c.setLineDash(share === race.sure ? [4, 3] : []);
      c.beginPath();
      c.moveTo(left, y(share));
      c.lineTo(left + wide, y(share));
      c.stroke();
      c.fillStyle = colours.soft;
      c.textAlign = "right";
      if (share !== race.sure) c.fillText(String(share), left - 5, y(share) + 4);
    }
    c.setLineDash([]);
    c.textAlign = "left";
    c.fillText("0 ms", left, h - 3);
    c.textAlign = "right";
    c.fillText(`${Math.round(end)}`, left + wide, h - 3);
    const rival = race.belief.map((/** @type {number[]} */ row, /** @type {number} */ k) => [race.time[k], row[race.target]]);
    const own = Array.from({ length: record.filled }, (_, k) => [k * record.interval, record.data.belief[k * n + race.target]]);
    for (const [line, colour] of /** @type {[number[][], string][]} */ ([[rival, SLOT_COLOURS.B], [own, SLOT_COLOURS.A]])) {
      c.strokeStyle = colour;
      c.lineWidth = 2;
      c.beginPath();
      for (const [t, p] of line) if (t <= shown) c.lineTo(x(t), y(p));
      c.stroke();
    }
  }

  /** Row at which the policy is sure, or the last. @param {any} race */
  function findSure(race) {
    const k = race.belief.findIndex((/** @type {number[]} */ row) => Math.max(...row) >= race.sure);
    return k < 0 ? race.time.length - 1 : k;
  }

  /** @param {string} name @param {any} one */
  function tell(name, one) {
    return `${name} ${one.shape ? `${one.shape} after ${Math.round(one.time)} ms${one.right ? "" : ", wrong"}` : "never sure"}`;
  }

  function update() {
    const { race } = app.records.A, wanted = Boolean(race) && app.store.state.mode === "hand" && app.records.A.hand;
    show(element, wanted);
    if (!wanted) return;
    const found = race.result;
    const text = found ? [WINNERS[/** @type {"you"} */ (found.won)], `${tell("You:", found.you)}; ${tell(`${race.name}:`, found.policy)}.`]
      : app.handOn ? ["Go!", "Take the base and feel the object. Time runs from your first move on."] : ["", "Let go before anybody was sure."];
    if (words.dataset.now !== text.join()) {
      words.dataset.now = text.join();
      words.replaceChildren(make("b", { text: text[0] }), make("span", { text: text[1] }));
    }
    if (legend.dataset.now !== race.name) {
      legend.dataset.now = race.name;
      legend.replaceChildren(...[["A", "you"], ["B", race.name]].map(([slot, name]) => {
        const dot = make("i");
        dot.style.background = SLOT_COLOURS[/** @type {"A"} */ (slot)];
        return make("span", {}, dot, name);
      }));
    }
    redraw();
  }
  const element = makePanel("Race", "race-panel", words, canvas, legend,
    make("p", { class: "caption", text: "How sure an observer is of the true shape; above the dashed line it gives its verdict. The same antenna, object, noise of 0.03 rad and observer, which knows 24 touches; only the motion differs. The policy begins at full speed, you from rest." }));
  return { element, redraw, update };
}
