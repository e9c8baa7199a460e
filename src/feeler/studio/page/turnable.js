// @ts-check
import { makeCanvas } from "./dom.js";
import { drawScene } from "./turn.js";
/** @typedef {import("./studio.js").App} App */
/** The scene of an antenna in space: the view of a touch that is turned by dragging or with the arrow keys. */

const TURN = 0.01, KEY_TURN = 0.1, STEEP = 1.5; // rad by a pixel, by a key, and at most from above or below

/** @param {App} app */
export function makeTurnableScene(app) {
  const eye = { turn: 0.6, rise: 0.35 };
  const { canvas, redraw } = makeCanvas({
    class: "stage turned", tabindex: "0", role: "application",
    "aria-label": "Scene in space. Dragging or arrow keys turn it.",
  }, draw);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const { scene } = app.records.A;
    if (!scene) return;
    const now = findFrame(scene.time, app.time);
    drawScene(c, { ...eye, width: w, height: h, scale: (0.8 * h) / scene.reach, left: w / 2, top: 0.9 * h }, scene, now);
    c.fillText(`${scene.time[now]} ms`, 12, h - 12);
  }
  /** @param {number} sideways @param {number} upwards */
  function turn(sideways, upwards) {
    eye.turn += sideways;
    eye.rise = Math.max(-STEEP, Math.min(STEEP, eye.rise + upwards));
    redraw();
  }
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) turn(TURN * event.movementX, TURN * event.movementY); });
  canvas.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way) return;
    turn(KEY_TURN * way[0], KEY_TURN * way[1]);
    event.preventDefault();
    event.stopPropagation();
  });
  return { element: canvas, redraw, eye };
}

/** The frame nearest to a moment. @param {number[]} times rising [ms] @param {number} now [ms] */
export function findFrame(times, now) {
  const next = times.findIndex((time) => time >= now);
  if (next < 0) return times.length - 1;
  return next && now - times[next - 1] < times[next] - now ? next - 1 : next;
}
