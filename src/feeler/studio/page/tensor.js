// @ts-check
import { BOTH, COLD, HOT, SLOT_COLOURS } from "./colours.js";
import { drawMoment, findPointer, makeCanvas, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** The tensor: sensors from base (bottom) to tip over time, as in the paper; of two antennae also their difference. */

const LEFT = 46, RIGHT = 10, BOTTOM = 20, GAP = 12, TOP = 4, TRACE = 58;

/** A number with so many decimals, and no minus before zero. @param {number} value @param {number} digits */
function fix(value, digits) {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

/** @param {App} app */
export function makeTensor(app) {
  /** @type {Object<string, {canvas: HTMLCanvasElement, key: string}>} */
  const pictures = {};
  let rows = /** @type {{slot: string, top: number, high: number}[]} */ ([]);
  let dragging = false;
  const { canvas, redraw } = makeCanvas({
    class: "tensor", tabindex: "0", role: "slider", "aria-label": "Tensor and moment shown, in milliseconds",
    "aria-valuemin": "0", "aria-valuemax": "380", "aria-valuenow": "0",
  }, draw);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const two = app.store.state.B && app.records.B.shown && app.store.state.mode === "touch", colours = app.colours;
    const names = two ? ["A", "B", "A − B"] : ["A"];
    const high = (h - BOTTOM - TOP - TRACE - GAP * names.length) / names.length;
    rows = names.map((slot, k) => ({ slot, top: TOP + k * (high + GAP), high }));
    const peak = app.findPeak();
    for (const row of rows) drawRow(c, w, row, peak, names.length > 1);
    drawTrace(c, w, h, colours, peak);
    drawTime(c, w, h, colours);
    writeReading(c, w, h, colours);
    canvas.setAttribute("aria-valuemax", String(Math.round(app.duration())));
    canvas.setAttribute("aria-valuenow", String(Math.round(app.time)));
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {{slot: string, top: number, high: number}} row @param {number} peak @param {boolean} named */
  function drawRow(c, w, row, peak, named) {
    const colours = app.colours, both = row.slot === "A − B", record = app.records[both ? "A" : row.slot], wide = w - LEFT - RIGHT;
    c.fillStyle = "#07060d";
    c.fillRect(LEFT, row.top, wide, row.high);
    if (record.shown) {
      const picture = paint(row.slot, peak);
      c.imageSmoothingEnabled = false;
      if (picture) c.drawImage(picture, 0, 0, record.span, picture.height, LEFT, row.top, wide, row.high);
      const valid = named ? Math.min(app.records.A.valid, app.records.B.valid) : record.valid;
      if (valid < record.shown) { // the rest is of the touch before
        c.fillStyle = colours.dark ? "rgba(20,23,26,0.88)" : "rgba(251,250,248,0.9)";
        const from = LEFT + (wide * valid) / record.span;
        c.fillRect(from, row.top, LEFT + wide - from, row.high);
      }
      if (!both) drawContact(c, record, row, wide);
    }
    c.strokeStyle = colours.line;
    c.lineWidth = 1;
    c.strokeRect(LEFT - 0.5, row.top - 0.5, wide + 1, row.high + 1);
    c.fillStyle = colours.soft;
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "right";
    c.fillText("tip", LEFT - 6, row.top + 10);
    c.fillText("base", LEFT - 6, row.top + row.high);
    if (named) {
      c.fillStyle = both ? colours.ink : SLOT_COLOURS[/** @type {"A"|"B"} */ (row.slot)];
      c.font = "600 12px system-ui, sans-serif";
      c.fillText(row.slot, LEFT - 6, row.top + row.high / 2 + 4);
    }
    if (app.hover && record.antenna && (both || app.hover.slot === row.slot)) {
      const n = record.antenna.sensors.length, y = row.top + row.high * (1 - (app.hover.sensor + 0.5) / n);
      c.strokeStyle = "rgba(255,255,255,0.85)";
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(LEFT, y);
      c.lineTo(LEFT + wide, y);
      c.stroke();
    }
  }

  /** Where the object touches, over time. @param {CanvasRenderingContext2D} c @param {any} record @param {{top: number, high: number}} row @param {number} wide */
  function drawContact(c, record, row, wide) {
    const contact = record.data.contact;
    if (!contact || !app.showContact || app.hidden) return;
    const shares = findShares(record), n = shares.length;
    c.strokeStyle = "rgba(130,225,255,0.9)";
    c.lineWidth = 1.4;
    c.setLineDash([3, 3]);
    c.beginPath();
    let on = false;
    for (let k = 0; k < record.valid; k++) {
      if (!Number.isFinite(contact[k])) { on = false; continue; }
      let s = 0;
      while (s < n - 1 && shares[s] < contact[k]) s++;
      const x = LEFT + (wide * (k + 0.5)) / record.span, y = row.top + row.high * (1 - (s + 0.5) / n);
      if (on) c.lineTo(x, y);
      else c.moveTo(x, y);
      on = true;
    }
    c.stroke();
    c.setLineDash([]);
  }

  /** Place of each sensor as a share of the length. @param {any} record */
  function findShares(record) {
    if (record.shares && record.shares.of === record.antenna) return record.shares.at;
    const ends = [0];
    for (const long of record.antenna.segments) ends.push(ends[ends.length - 1] + long);
    const at = record.antenna.sensors.map((/** @type {number} */ hinge) => ends[hinge - 1] / record.antenna.length);
    record.shares = { of: record.antenna, at };
    return at;
  }

  /** @param {string} slot @param {number} peak */
  function paint(slot, peak) {
    const both = slot === "A − B", record = app.records[both ? "A" : slot], other = app.records.B;
    if (both && (other.total !== record.total || other.index.length !== record.index.length)) return null;
    const key = [record.id, record.plane, record.filled, record.shown, peak, app.quantity, both ? other.id : "", both ? other.filled : ""].join();
    const known = pictures[slot], n = record.index.length, total = record.total;
    if (known && known.key === key && known.canvas.width === total) return known.canvas;
    const canvas = known && known.canvas.width === total && known.canvas.height === n ? known.canvas : document.createElement("canvas");
    if (canvas.width !== total || canvas.height !== n) { canvas.width = total; canvas.height = n; }
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const image = context.createImageData(total, n), pixels = image.data, top = Math.max(peak, 1e-9);
    // by the square root sensors that bend little are seen too; noise would be all that is seen
    const spread = record.noise ? (/** @type {number} */ share) => share : Math.sqrt;
    for (let s = 0; s < n; s++) {
      const factor = app.quantity === "curvature" ? 1 / record.antenna.segments[record.index[s]] : 1;
      const row = (n - 1 - s) * total;
      for (let k = 0; k < record.shown; k++) {
        let value = record.angle(s, k) * factor;
        let table = HOT, share = 0;
        if (both) {
          table = BOTH;
          value -= other.angle(s, k) * (app.quantity === "curvature" ? 1 / other.antenna.segments[other.index[s]] : 1);
          share = 0.5 + Math.sign(value) * spread(Math.abs(value) / top) / 2;
        } else { table = value < 0 ? COLD : HOT; share = spread(Math.abs(value) / top); }
        const from = 3 * Math.max(0, Math.min(255, Math.round(255 * share))), to = 4 * (row + k);
        pixels[to] = table[from];
        pixels[to + 1] = table[from + 1];
        pixels[to + 2] = table[from + 2];
        pixels[to + 3] = 255;
      }
    }
    context.putImageData(image, 0, 0);
    pictures[slot] = { canvas, key };
    return canvas;
  }

  /** The chosen sensor over time. @param {CanvasRenderingContext2D} c @param {number} w @param {number} h @param {any} colours @param {number} peak */
  function drawTrace(c, w, h, colours, peak) {
    const top = h - BOTTOM - TRACE + 10, high = TRACE - 16, wide = w - LEFT - RIGHT;
    const two = app.store.state.B && app.store.state.mode === "touch";
    const { sensor, record } = findReading();
    const down = record.shown && sensor < record.index.length && record.angle(sensor, findPeakSample(record, sensor)) < 0;
    const zero = top + high * (down ? 0.15 : 0.85); // what bends the other way has its room below
    c.strokeStyle = colours.line;
    c.lineWidth = 1;
    c.beginPath();
    c.moveTo(LEFT, zero);
    c.lineTo(LEFT + wide, zero);
    c.stroke();
    for (const slot of two ? ["B", "A"] : ["A"]) {
      const one = app.records[slot];
      if (!one.shown || sensor >= one.index.length) continue;
      const factor = app.quantity === "curvature" ? 1 / one.antenna.segments[one.index[sensor]] : 1;
      c.strokeStyle = SLOT_COLOURS[/** @type {"A"|"B"} */ (slot)];
      c.lineWidth = 1.6;
      c.setLineDash(slot === "B" ? [5, 3] : []);
      c.beginPath();
      for (let k = 0; k < one.valid; k++) {
        const x = LEFT + (wide * (k + 0.5)) / one.span, y = zero - (high * 0.8 * one.angle(sensor, k) * factor) / Math.max(peak, 1e-9);
        if (k) c.lineTo(x, y);
        else c.moveTo(x, y);
      }
      c.stroke();
    }
    c.setLineDash([]);
  }

  /** The sensor whose trace is drawn: the one pointed at, or the one that bends most. */
  function findReading() {
    const two = app.store.state.B && app.store.state.mode === "touch", slot = two && app.hover && app.hover.slot === "B" ? "B" : "A";
    const record = app.records[slot];
    return { two, slot, record, sensor: app.hover ? app.hover.sensor : findPeakSensor(record) };
  }

  /** What that sensor reads now, over all lines. @param {CanvasRenderingContext2D} c @param {number} w @param {number} h @param {any} colours */
  function writeReading(c, w, h, colours) {
    const { two, slot, record, sensor } = findReading();
    if (!record.shown || !record.antenna || sensor >= record.index.length) return;
    const hinge = record.antenna.sensors[sensor], k = Math.max(0, Math.min(Math.round(app.time / record.interval), record.shown - 1));
    const high = h - BOTTOM - TRACE, most = w - LEFT - RIGHT - 8, peak = findPeakSample(record, sensor);
    const show = (/** @type {number} */ at) => app.quantity === "curvature" ? `${fix(record.angle(sensor, at) / record.antenna.segments[hinge - 1], 4)} /mm`
      : `${fix((record.angle(sensor, at) * 180) / Math.PI, 2)}°`;
    const name = app.hover ? `sensor ${sensor + 1}, hinge ${hinge}, peak:` : `peak: sensor ${sensor + 1},`;
    const words = k < record.valid ? `${two ? `${slot}, ` : ""}${name} ${show(peak)} at ${write(peak * record.interval, 4)} ms; now ${show(k)}` : "computing …";
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "left";
    c.fillStyle = colours.card;
    c.fillRect(LEFT + 2, high - 1, Math.min(most, c.measureText(words).width) + 4, 13);
    c.fillStyle = colours.soft;
    c.fillText(words, LEFT + 4, high + 9, most);
  }

  /** The sensor with the greatest angle or curvature, whichever is shown. @param {any} record */
  function findPeakSensor(record) {
    const key = [record.id, record.valid, record.plane, app.quantity].join();
    if (record.best && record.best.key === key) return record.best.sensor;
    let best = 0, size = -1;
    for (let s = 0; s < record.index.length; s++) {
      const factor = app.quantity === "curvature" ? 1 / record.antenna.segments[record.index[s]] : 1;
      for (let k = 0; k < record.valid; k++) {
        const value = Math.abs(record.angle(s, k)) * factor;
        if (value > size) { size = value; best = s; }
      }
    }
    record.best = { key, sensor: best };
    return best;
  }

  /** The sample at which a sensor bends most. @param {any} record @param {number} sensor */
  function findPeakSample(record, sensor) {
    let best = 0;
    for (let k = 1; k < record.valid; k++) if (Math.abs(record.angle(sensor, k)) > Math.abs(record.angle(sensor, best))) best = k;
    return best;
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h @param {any} colours */
  function drawTime(c, w, h, colours) {
    const wide = w - LEFT - RIGHT, end = app.duration();
    const step = [10, 20, 50, 100, 200, 500, 1000].find((s) => (wide * s) / end > 52) || 1000;
    c.fillStyle = colours.soft;
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "center";
    for (let t = 0; t <= end; t += step) c.fillText(t === 0 ? "0 ms" : String(t), LEFT + (wide * t) / end, h - 5);
    const x = LEFT + (wide * app.time) / end;
    drawMoment(c, colours.accent, x, 0, h - BOTTOM + 2);
    c.fillStyle = colours.accent;
    c.beginPath();
    c.arc(x, h - BOTTOM, 4, 0, 2 * Math.PI);
    c.fill();
  }

  /** @param {MouseEvent} event */
  function look(event) {
    const [x, y] = findPointer(event, canvas), row = rows.find((r) => y >= r.top && y <= r.top + r.high);
    if (row) {
      const slot = row.slot === "B" ? "B" : "A", n = app.records[slot].index.length;
      app.setHover({ slot, sensor: Math.max(0, Math.min(n - 1, Math.floor(n * (1 - (y - row.top) / row.high)))) });
    } else app.setHover(null);
    return ((x - LEFT) / (canvas.clientWidth - LEFT - RIGHT)) * app.duration();
  }
  canvas.addEventListener("pointermove", (event) => {
    const time = look(event);
    if (dragging) app.seek(time);
  });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    dragging = true;
    app.play(false);
    app.seek(look(event));
  });
  canvas.addEventListener("pointerup", () => { dragging = false; });
  canvas.addEventListener("pointerleave", () => app.setHover(null));
  canvas.addEventListener("keydown", (event) => {
    const step = ({ ArrowRight: 1, ArrowLeft: -1, PageUp: 20, PageDown: -20 })[event.key] || 0;
    if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      const now = app.hover ? app.hover.sensor : 0, n = app.records.A.index.length;
      app.setHover({ slot: "A", sensor: Math.max(0, Math.min(n - 1, now + (event.key === "ArrowUp" ? 1 : -1))) });
    } else if (step) app.seek(app.time + step * (event.shiftKey ? 10 : 1));
    else if (event.key === "Home" || event.key === "End") app.seek(event.key === "Home" ? 0 : app.duration());
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return { element: canvas, redraw };
}
