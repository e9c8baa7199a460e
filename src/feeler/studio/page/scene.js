// @ts-check
import { HOT, SLOT_COLOURS, pick } from "./colours.js";
import { findPointer, keepGrips, makeCanvas, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** The scene: antennae and objects as seen from above, base left, tip right; things in it are taken with the mouse. */

const TRAIL = 70; // samples

/** @param {App} app */
export function makeScene(app) {
  /** @type {{slot: string, number: number, path: Path2D}[]} */
  let grips = [];
  let scale = 10, ox = 0, oy = 0;
  /** Where keys have moved what is in the hand. @type {Map<number, [number, number]>} */
  const keyed = new Map();
  /** @type {{what: number, dx: number, dy: number, turn: number, at: MouseEvent, last: number, from: number} | null} */
  let held = null;
  const { canvas, redraw } = makeCanvas({
    class: "stage", tabindex: "0", role: "application",
    "aria-label": "Scene. Arrow keys move the object along the antenna, plus and minus change its size, Delete takes a further object away. " +
      "By hand, arrow keys move the object, with Shift the base, and Escape lets go.",
  }, draw);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const colours = app.colours, record = app.records.A, length = record.antenna ? record.antenna.length : 42;
    const own = app.store.state.mode === "board"; // it may bend to either side
    const before = held && toWorld(held.at);
    scale = Math.min(w / (1.14 * length), h / ((own ? 1.1 : 0.88) * length));
    ox = (w - length * scale) / 2 - 0.01 * w;
    oy = (own ? 0.5 : app.store.state.touch.side === "left" ? 0.14 : 0.86) * h; // a level antenna swings far
    app.view = { scale, ox, oy };
    if (held && before) { // the picture may have grown under the hand: what it holds stays where it is
      const now = toWorld(held.at);
      held.dx += now[0] - before[0];
      held.dy += now[1] - before[1];
    }
    drawGround(c, w, h, colours);
    grips = [];
    if (!record.shown) {
      drawWaiting(c, w, h, colours);
      return;
    }
    const slots = app.store.state.B && app.records.B.shown ? ["B", "A"] : ["A"];
    if (!app.hidden) drawObjects(c, record, colours);
    for (const slot of slots) drawAntenna(c, app.records[slot], slot, colours, slots.length > 1);
    if (!app.hidden) drawForce(c, record, colours);
    drawBase(c, record, colours);
    if (!app.hidden) drawHint(c, w > 440 ? h - 14 : 18, colours); // beside the scale, or on top
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h @param {any} colours */
  function drawGround(c, w, h, colours) {
    c.strokeStyle = colours.line;
    c.lineWidth = 1;
    c.globalAlpha = 0.55;
    c.beginPath();
    const step = 5 * scale;
    for (let x = ox % step; x < w; x += step) { c.moveTo(x, 0); c.lineTo(x, h); }
    for (let y = oy % step; y < h; y += step) { c.moveTo(0, y); c.lineTo(w, y); }
    c.stroke();
    c.globalAlpha = 1;
    const long = 10 * scale;
    c.strokeStyle = c.fillStyle = colours.soft;
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(w - 16 - long, h - 14);
    c.lineTo(w - 16, h - 14);
    c.stroke();
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "right";
    c.fillText("10 mm", w - 16, h - 19);
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h @param {any} colours */
  function drawWaiting(c, w, h, colours) {
    c.fillStyle = colours.soft;
    c.textAlign = "center";
    c.font = "14px system-ui, sans-serif";
    c.fillText(app.waiting || "", w / 2, h / 2);
  }

  /** Sample before, share of the way to the next. @param {any} record */
  function findMoment(record) {
    const at = Math.max(0, Math.min(app.time / record.interval, record.shown - 1)), low = Math.floor(at);
    return { low, high: Math.min(low + 1, record.shown - 1), share: at - low };
  }

  /** @param {any} record @param {string} name @param {number} k @param {{low: number, high: number, share: number}} t */
  function mix(record, name, k, t) {
    const data = record.data[name], wide = record.wide[name];
    if (!data) return 0;
    const a = data[t.low * wide + k], b = data[t.high * wide + k];
    return a + t.share * (b - a);
  }

  /** @param {CanvasRenderingContext2D} c @param {any} record @param {any} colours */
  function drawObjects(c, record, colours) {
    const t = findMoment(record);
    record.rims.forEach((/** @type {number[][][]} */ parts, /** @type {number} */ o) => {
      const x = mix(record, "place", 3 * o, t), y = mix(record, "place", 3 * o + 1, t), turn = mix(record, "place", 3 * o + 2, t);
      const fx = Math.sin(turn), fy = Math.cos(turn), path = new Path2D();
      for (const part of parts) {
        part.forEach(([a, b], k) => {
          const px = x + a * fx - b * fy, py = y + a * fy + b * fx;
          if (k) path.lineTo(ox + py * scale, oy + px * scale);
          else path.moveTo(ox + py * scale, oy + px * scale);
        });
        path.closePath();
      }
      const cx = ox + y * scale, cy = oy + x * scale, size = 4 * scale;
      const shade = c.createLinearGradient(cx - size * fy, cy - size * fx, cx, cy);
      shade.addColorStop(0, colours.solid);
      shade.addColorStop(1, colours.rim);
      c.save();
      c.shadowColor = "rgba(20,14,8,0.28)";
      c.shadowBlur = 10;
      c.shadowOffsetY = 3;
      c.fillStyle = shade;
      c.fill(path);
      c.restore();
      const chosen = app.selected === o;
      c.strokeStyle = chosen ? colours.accent : colours.rim;
      c.lineWidth = chosen ? 2 : 1;
      c.stroke(path);
      grips.push({ slot: "A", number: o, path });
    });
  }

  /** @param {CanvasRenderingContext2D} c @param {any} record @param {string} slot @param {any} colours @param {boolean} two */
  function drawAntenna(c, record, slot, colours, two) {
    const t = findMoment(record), a = record.points(t.low), b = record.points(t.high), n = a.length / 2;
    const px = new Float64Array(n), py = new Float64Array(n);
    for (let k = 0; k < n; k++) {
      px[k] = ox + (a[2 * k + 1] + t.share * (b[2 * k + 1] - a[2 * k + 1])) * scale;
      py[k] = oy + (a[2 * k] + t.share * (b[2 * k] - a[2 * k])) * scale;
    }
    drawTrail(c, record, slot, t.low);
    const faint = (two && slot === "B") || t.low >= record.valid; // then it is of the touch before
    const radius = Math.max(record.antenna.radius * scale, 1.6);
    c.lineCap = c.lineJoin = "round";
    c.globalAlpha = faint ? 0.75 : 1;
    c.strokeStyle = two ? SLOT_COLOURS[/** @type {"A"|"B"} */ (slot)] : colours.dark ? "rgba(255,236,214,0.22)" : "rgba(74,42,14,0.24)";
    c.lineWidth = 2 * radius + (two ? 2.5 : 3);
    c.beginPath();
    for (let k = 0; k < n; k++) c.lineTo(px[k], py[k]);
    c.stroke();
    const angle = record.data.angle, wide = record.wide.angle, top = Math.max(app.findPeak(), 1e-9);
    for (let k = 1; k < n; k++) {
      const bend = Math.abs(angle[t.low * wide + k - 1] + t.share * (angle[t.high * wide + k - 1] - angle[t.low * wide + k - 1]));
      const share = Math.min(1, bend / top);
      c.strokeStyle = mixBody(colours, share);
      c.lineWidth = 2 * radius * (1 - 0.45 * (k / n));
      c.beginPath();
      c.moveTo(px[k - 1], py[k - 1]);
      c.lineTo(px[k], py[k]);
      c.stroke();
    }
    c.globalAlpha = 1;
    if (app.hover && app.hover.slot === slot && record.antenna.sensors[app.hover.sensor]) {
      const k = record.antenna.sensors[app.hover.sensor] - 1;
      c.strokeStyle = colours.accent;
      c.lineWidth = 2.5;
      c.beginPath();
      c.arc(px[k], py[k], radius + 5, 0, 2 * Math.PI);
      c.stroke();
    }
    app.drawn[slot] = { px, py };
  }

  /** @param {any} colours @param {number} share */
  function mixBody(colours, share) {
    return share < 0.04 ? colours.body : pick(HOT, 0.35 + 0.5 * share);
  }

  /** @param {CanvasRenderingContext2D} c @param {any} record @param {string} slot @param {number} now */
  function drawTrail(c, record, slot, now) {
    c.strokeStyle = SLOT_COLOURS[/** @type {"A"|"B"} */ (slot)];
    c.lineWidth = 1.4;
    for (let k = Math.max(1, now - TRAIL); k <= now; k += 1) {
      const a = record.tip(k - 1), b = record.tip(k);
      c.globalAlpha = (0.5 * (k - now + TRAIL)) / TRAIL;
      c.beginPath();
      c.moveTo(ox + a[1] * scale, oy + a[0] * scale);
      c.lineTo(ox + b[1] * scale, oy + b[0] * scale);
      c.stroke();
    }
    c.globalAlpha = 1;
  }

  /** @param {CanvasRenderingContext2D} c @param {any} record @param {any} colours */
  function drawForce(c, record, colours) {
    const t = findMoment(record), place = record.data.contact ? record.data.contact[t.low] : NaN;
    if (!Number.isFinite(place) || !app.drawn.A || t.low >= record.valid) return;
    const at = findPlace(record, place), { px, py } = app.drawn.A;
    let fx = 0, fy = 0;
    for (let o = 0; o < record.rims.length; o++) {
      fx += record.data.force[t.low * record.wide.force + 2 * o];
      fy += record.data.force[t.low * record.wide.force + 2 * o + 1];
    }
    const size = Math.hypot(fx, fy);
    if (!(size > 0)) return;
    const long = Math.min(64, 12 + 9 * Math.log10(1 + size * 1e5)), x = px[at], y = py[at];
    const ex = x + (fy / size) * long, ey = y + (fx / size) * long, turn = Math.atan2(ey - y, ex - x);
    const glow = c.createRadialGradient(x, y, 0, x, y, 16);
    glow.addColorStop(0, "rgba(255,150,60,0.75)");
    glow.addColorStop(1, "rgba(255,150,60,0)");
    c.fillStyle = glow;
    c.fillRect(x - 16, y - 16, 32, 32);
    c.strokeStyle = c.fillStyle = colours.accent;
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(ex, ey);
    c.stroke();
    c.beginPath();
    c.moveTo(ex + 7 * Math.cos(turn), ey + 7 * Math.sin(turn));
    c.lineTo(ex + 5 * Math.cos(turn + 2.3), ey + 5 * Math.sin(turn + 2.3));
    c.lineTo(ex + 5 * Math.cos(turn - 2.3), ey + 5 * Math.sin(turn - 2.3));
    c.fill();
    c.font = "11px system-ui, sans-serif";
    c.textAlign = ex < x ? "right" : "left";
    c.fillText(`${write(size * 1e6)} µN`, ex + (ex < x ? -10 : 10), ey + 4);
  }

  /** Number of the point nearest to a share of the length. @param {any} record @param {number} share */
  function findPlace(record, share) {
    const wanted = share * record.antenna.length;
    let sum = 0;
    for (let k = 0; k < record.antenna.segments.length; k++) {
      sum += record.antenna.segments[k];
      if (sum >= wanted) return k + 1;
    }
    return record.antenna.segments.length;
  }

  /** @param {CanvasRenderingContext2D} c @param {any} record @param {any} colours */
  function drawBase(c, record, colours) {
    const t = findMoment(record), x = ox + mix(record, "base", 1, t) * scale, y = oy + mix(record, "base", 0, t) * scale;
    const turn = mix(record, "base", 2, t), size = Math.max(9, 0.7 * scale), path = new Path2D();
    path.arc(x, y, size, 0, 2 * Math.PI);
    c.save();
    c.translate(x, y);
    c.rotate(turn);
    c.fillStyle = colours.ink;
    c.beginPath();
    c.arc(0, 0, size, Math.PI / 2, -Math.PI / 2);
    c.lineTo(size * 0.55, -size * 0.45);
    c.lineTo(size * 0.55, size * 0.45);
    c.closePath();
    c.fill();
    c.restore();
    if (app.store.state.mode === "hand") {
      c.strokeStyle = colours.accent;
      c.setLineDash([4, 3]);
      c.lineWidth = 1.5;
      c.beginPath();
      c.arc(x, y, size + 6, 0, 2 * Math.PI);
      c.stroke();
      c.setLineDash([]);
      grips.push({ slot: "A", number: -1, path });
    }
  }

  /** @param {CanvasRenderingContext2D} c @param {number} y @param {any} colours */
  function drawHint(c, y, colours) {
    const words = app.store.state.mode === "board" ? "" : app.store.state.mode === "hand"
      ? (app.handOn ? "drag the object, or the base (Shift: turn it)" : "take the object, or the base, and touch")
      : app.hinted ? "" : `drag the object along the antenna${matchMedia("(pointer: coarse)").matches ? "" : " · wheel: size"}`;
    c.fillStyle = colours.soft;
    c.font = "12px system-ui, sans-serif";
    c.textAlign = "left";
    c.fillText(words, 14, y);
  }

  /** @param {MouseEvent} event */
  function findGrip(event) {
    const [x, y] = findPointer(event, canvas), c = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const ratio = window.devicePixelRatio || 1;
    c.save();
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.lineWidth = 16;
    const found = [...grips].reverse().find(({ path }) => {
      c.setTransform(ratio, 0, 0, ratio, 0, 0);
      return c.isPointInPath(path, x * ratio, y * ratio) || c.isPointInStroke(path, x * ratio, y * ratio);
    });
    c.restore();
    return found;
  }

  /** @param {MouseEvent} event @returns {[number, number]} x across and y along [mm] */
  function toWorld(event) {
    const [x, y] = findPointer(event, canvas);
    return [(y - oy) / scale, (x - ox) / scale];
  }

  canvas.addEventListener("pointerdown", (event) => {
    const grip = findGrip(event);
    if (!grip || !["touch", "hand"].includes(app.store.state.mode)) return;
    canvas.setPointerCapture(event.pointerId);
    const [x, y] = toWorld(event), record = app.records.A, t = findMoment(record);
    const hand = app.store.state.mode === "hand";
    if (hand && !app.handOn) app.startHand();
    const now = hand ? { low: 0, high: 0, share: 0 } : t;
    const name = grip.number < 0 ? "base" : "place", from = grip.number < 0 ? 0 : 3 * grip.number;
    held = { what: grip.number, dx: x - mix(record, name, from, hand && app.handOn ? t : now),
      dy: y - mix(record, name, from + 1, hand && app.handOn ? t : now), turn: grip.number < 0 ? mix(record, "base", 2, t) : 0, at: event, last: 0, from: 0 };
    held.last = y - held.dy;
    held.from = x - held.dx;
    if (grip.number >= 0) app.selected = grip.number;
    app.hinted = true;
    canvas.classList.add("held");
    app.draw();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) {
      hoverAntenna(event);
      canvas.style.cursor = findGrip(event) ? "grab" : "default";
      return;
    }
    const [x, y] = toWorld(event), hold = held;
    hold.at = event;
    if (app.store.state.mode === "hand") {
      const base = hold.what < 0 && event.shiftKey;
      if (base) app.aim(-1, mix(app.records.A, "base", 0, findMoment(app.records.A)), mix(app.records.A, "base", 1, findMoment(app.records.A)), hold.turn + (x - hold.dx - hold.from) / 10);
      else app.aim(hold.what, x - hold.dx, y - hold.dy, hold.turn);
      return;
    }
    app.store.change((/** @type {any} */ s) => {
      if (hold.what === 0) s.touch.location = Number(Math.max(0.05, Math.min(1, s.touch.location + (y - hold.dy - hold.last) / app.records.A.antenna.length)).toFixed(4));
      else {
        const item = s.touch.objects[hold.what - 1];
        item.x = Number((x - hold.dx).toFixed(3));
        item.y = Number((y - hold.dy).toFixed(3));
      }
    }, false);
    hold.last = y - hold.dy;
  });
  const release = () => {
    if (!held) return;
    held = null;
    canvas.classList.remove("held");
    if (app.store.state.mode !== "hand") app.store.change(() => {});
  };
  keepGrips(canvas, findGrip);
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => { if (!held) app.setHover(null); });
  let settling = 0;
  canvas.addEventListener("wheel", (event) => {
    const grip = findGrip(event);
    if (!grip || grip.number < 0 || app.store.state.mode !== "touch") return;
    event.preventDefault();
    app.resize(grip.number, Math.exp(-event.deltaY * 0.0015), false);
    clearTimeout(settling);
    settling = window.setTimeout(() => app.store.change(() => {}), 250);
  }, { passive: false });
  /** By hand: arrows move the object, with Shift the base, 0.5 mm at a time; Escape lets go. @param {KeyboardEvent} event */
  function moveByKey(event) {
    const along = { ArrowRight: 1, ArrowLeft: -1 }[event.key] || 0, across = { ArrowDown: 1, ArrowUp: -1 }[event.key] || 0;
    if (event.key === "Escape") app.endHand();
    if (!along && !across) return event.key === "Escape";
    if (!app.handOn) { keyed.clear(); app.startHand(); }
    const what = event.shiftKey ? -1 : Math.max(app.selected, 0), record = app.records.A, t = record.hand ? findMoment(record) : { low: 0, high: 0, share: 0 };
    const name = what < 0 ? "base" : "place", from = Math.max(0, 3 * what);
    const [x, y] = keyed.get(what) || [mix(record, name, from, t), mix(record, name, from + 1, t)];
    keyed.set(what, [x + 0.5 * across, y + 0.5 * along]);
    app.aim(what, x + 0.5 * across, y + 0.5 * along, what < 0 ? mix(record, "base", 2, t) : 0);
    return true;
  }
  canvas.addEventListener("keydown", (event) => {
    if (app.store.state.mode === "hand" && moveByKey(event)) {
      event.preventDefault();
      event.stopPropagation();
    }
    if (app.store.state.mode !== "touch") return;
    const along = { ArrowRight: 1, ArrowLeft: -1 }[event.key] || 0, across = { ArrowDown: 1, ArrowUp: -1 }[event.key] || 0;
    if (along || across) {
      app.store.change((/** @type {any} */ s) => {
        if (app.selected > 0 && s.touch.objects[app.selected - 1]) {
          s.touch.objects[app.selected - 1].y += 0.5 * along;
          s.touch.objects[app.selected - 1].x += 0.5 * across;
        } else s.touch.location = Number(Math.max(0.05, Math.min(1, s.touch.location + 0.01 * along)).toFixed(4));
      });
    } else if (event.key === "+" || event.key === "-") app.resize(Math.max(app.selected, 0), event.key === "+" ? 1.1 : 1 / 1.1, true);
    else if (event.key === "Delete" && app.selected > 0) app.removeObject(app.selected - 1);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });

  /** @param {MouseEvent} event */
  function hoverAntenna(event) {
    const [x, y] = findPointer(event, canvas);
    let best = 12 ** 2, found = null;
    for (const slot of Object.keys(app.drawn)) {
      const record = app.records[slot], shape = app.drawn[slot];
      if (!shape || !record.antenna || (slot === "B" && !app.store.state.B)) continue;
      record.antenna.sensors.forEach((/** @type {number} */ hinge, /** @type {number} */ sensor) => {
        const far = (shape.px[hinge - 1] - x) ** 2 + (shape.py[hinge - 1] - y) ** 2;
        if (far < best) { best = far; found = { slot, sensor }; }
      });
    }
    app.setHover(found);
  }

  return { element: canvas, redraw };
}
