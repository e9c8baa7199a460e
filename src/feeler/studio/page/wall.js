// @ts-check
import { HOT, SLOT_COLOURS, pick } from "./colours.js";
import { drawMoment, makeCanvas, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** Following a wall: the body runs, its antenna bends at the wall, and where it bends most tells how far the wall is. */

export class WallRecord {
  constructor() {
    this.id = -1;
    /** @type {any} */
    this.header = null;
    /** @type {number[]} */
    this.body = [];
    /** @type {Float32Array[]} */
    this.angle = [];
    this.n = 0;
    /** @type {any} */
    this.end = null;
  }

  /** @param {any} header @param {any} arrays */
  take(header, arrays) {
    if (header.part === "begin") {
      Object.assign(this, { id: header.id, header, body: [], angle: [], n: 0, end: null });
    } else if (header.part === "piece") {
      this.body.push(...arrays.body.data);
      const wide = arrays.angle.shape[1];
      for (let k = 0; k < arrays.angle.shape[0]; k++) this.angle.push(arrays.angle.data.subarray(k * wide, (k + 1) * wide));
      this.n = this.angle.length;
    } else if (header.part === "end") this.end = { ...header, distance: arrays.distance.data, estimate: arrays.estimate.data };
  }
}

const TRUNK = 22; // mm of body that is drawn

/** The body, its antenna and the wall, from above. @param {App} app */
export function makeWallScene(app) {
  const { canvas, redraw } = makeCanvas({ class: "stage", role: "img", "aria-label": "A body follows a wall by touch" }, drawScene);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function drawScene(c, w, h) {
    const record = app.walls.A, colours = app.colours;
    if (!record.header || !record.n) {
      c.fillStyle = colours.soft;
      c.textAlign = "center";
      c.font = "14px system-ui, sans-serif";
      c.fillText(record.header ? "learning what distance feels like … (the first time ever, the engine is compiled: a minute)" : app.waiting || "", w / 2, h / 2);
      return;
    }
    const at = Math.min(Math.round(app.time), record.n - 1), [x, y, heading] = record.body.slice(3 * at, 3 * at + 3);
    const scale = Math.min(w / 150, h / 82), fromX = x - 6, fromY = y + 14;
    /** @param {number} a across @param {number} b along @returns {[number, number]} */
    const place = (a, b) => [w * 0.42 + (b - fromY) * scale, h * 0.5 + (a - fromX) * scale];
    const corners = record.header.wall.map((/** @type {number[]} */ [a, b]) => place(a, b));
    c.fillStyle = colours.solid;
    c.beginPath();
    corners.forEach((/** @type {[number, number]} */ [px, py]) => c.lineTo(px, py));
    c.lineTo(corners[corners.length - 1][0] + 900, h + 900);
    c.lineTo(corners[0][0] - 900, h + 900);
    c.fill();
    c.strokeStyle = colours.rim;
    c.lineWidth = 2;
    c.beginPath();
    corners.forEach((/** @type {[number, number]} */ [px, py]) => c.lineTo(px, py));
    c.stroke();
    c.strokeStyle = SLOT_COLOURS.A;
    c.globalAlpha = 0.55;
    c.lineWidth = 1.5;
    c.beginPath();
    for (let k = 0; k <= at; k += 3) c.lineTo(...place(record.body[3 * k], record.body[3 * k + 1]));
    c.stroke();
    c.globalAlpha = 1;
    drawBody(c, place(x, y), heading, scale, colours);
    drawFlagellum(c, record, at, x, y, heading, scale, place, colours);
  }

  /** @param {CanvasRenderingContext2D} c @param {[number, number]} at @param {number} heading @param {number} scale @param {any} colours */
  function drawBody(c, [px, py], heading, scale, colours) {
    c.save();
    c.translate(px, py);
    c.rotate(heading);
    c.fillStyle = colours.body;
    c.strokeStyle = colours.rim;
    c.beginPath();
    c.ellipse((-TRUNK / 2 - 1) * scale, -4 * scale, (TRUNK / 2) * scale, 5 * scale, 0, 0, 2 * Math.PI);
    c.fill();
    c.stroke();
    c.beginPath();
    c.ellipse(-1.2 * scale, -2.6 * scale, 2.4 * scale, 2.8 * scale, 0, 0, 2 * Math.PI);
    c.fill();
    c.stroke();
    c.restore();
  }

  /** @param {CanvasRenderingContext2D} c @param {any} record @param {number} at @param {number} x @param {number} y @param {number} heading @param {number} scale @param {(a: number, b: number) => [number, number]} place @param {any} colours */
  function drawFlagellum(c, record, at, x, y, heading, scale, place, colours) {
    const { segments, radius, rest } = record.header.antenna, angle = record.angle[at];
    let turn = heading + record.header.heading, top = 0, best = 0;
    angle.forEach((/** @type {number} */ a, /** @type {number} */ k) => { const bend = Math.abs(a - rest[k]) / segments[k]; if (bend > top) { top = bend; best = k; } });
    c.lineCap = "round";
    c.lineWidth = Math.max(2 * radius * scale, 2.6);
    for (let k = 0; k < segments.length; k++) {
      turn += angle[k];
      const nx = x + segments[k] * Math.sin(turn), ny = y + segments[k] * Math.cos(turn);
      const share = Math.min(1, Math.abs(angle[k] - rest[k]) / segments[k] / (top || 1));
      c.strokeStyle = share < 0.06 ? colours.body : pick(HOT, 0.35 + 0.5 * share);
      c.beginPath();
      c.moveTo(...place(x, y));
      c.lineTo(...place(nx, ny));
      c.stroke();
      if (k === best) {
        c.strokeStyle = colours.accent;
        c.lineWidth = 2;
        c.beginPath();
        c.arc(...place(x, y), 7, 0, 2 * Math.PI); // the hinge, at which its segment begins
        c.stroke();
        c.lineWidth = Math.max(2 * radius * scale, 2.6);
      }
      x = nx;
      y = ny;
    }
  }

  return { element: canvas, redraw };
}

/** Distance from the wall over time, true and felt. @param {App} app */
export function makeWallChart(app) {
  const { canvas, redraw } = makeCanvas({ class: "tensor", role: "img", "aria-label": "Distance from the wall over time, true and felt" }, drawChart);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function drawChart(c, w, h) {
    const record = app.walls.A, colours = app.colours, left = 48, bottom = 20, wide = w - left - 10, high = h - bottom - 26;
    c.font = "11px system-ui, sans-serif";
    if (!record.end) return;
    const n = record.end.distance.length, most = 22;
    const toY = (/** @type {number} */ d) => 22 + high * (1 - Math.min(d, most) / most);
    for (const d of [0, 5, 10, 15, 20]) {
      c.strokeStyle = colours.line;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(left, toY(d));
      c.lineTo(left + wide, toY(d));
      c.stroke();
      c.fillStyle = colours.soft;
      c.textAlign = "right";
      c.fillText(d === 20 ? "20 mm" : String(d), left - 5, toY(d) + 4);
    }
    c.setLineDash([5, 4]);
    c.strokeStyle = colours.soft;
    c.beginPath();
    c.moveTo(left, toY(record.end.target));
    c.lineTo(left + wide, toY(record.end.target));
    c.stroke();
    c.setLineDash([]);
    for (const [values, colour, thick] of /** @type {[Float32Array, string, number][]} */ ([[record.end.estimate, SLOT_COLOURS.B, 1.4], [record.end.distance, SLOT_COLOURS.A, 2.2]])) {
      c.strokeStyle = colour;
      c.lineWidth = thick;
      c.beginPath();
      let on = false;
      values.forEach((value, k) => {
        const x = left + (wide * k) / n;
        if (!Number.isFinite(value)) { on = false; return; }
        if (on) c.lineTo(x, toY(value));
        else c.moveTo(x, toY(value));
        on = true;
      });
      c.stroke();
    }
    drawMoment(c, colours.accent, left + (wide * app.time) / app.duration(), 16, 22 + high);
    c.textAlign = "left";
    c.fillStyle = SLOT_COLOURS.A;
    c.fillText("true distance", left + 4, 12);
    c.fillStyle = SLOT_COLOURS.B;
    c.fillText("felt, from the point of greatest curvature", left + 86, 12);
    c.fillStyle = colours.soft;
    c.textAlign = "right";
    const words = record.end.collided ? "ran into the wall" : `off target by ${write(record.end.error, 2)} mm (rms)`;
    c.fillText(words, left + wide, 12);
    c.textAlign = "center";
    for (let t = 0; t <= n; t += 100) c.fillText(t ? String(t) : "0 ms", left + (wide * t) / n, h - 5);
  }

  return { element: canvas, redraw };
}
