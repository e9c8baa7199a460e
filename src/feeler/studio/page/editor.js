// @ts-check
import { SLOT_COLOURS } from "./colours.js";
import { announce, findPointer, keepGrips, makeCanvas, raise, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** The antenna editor: stiffness and damping along the antenna, on a logarithmic scale, changed by handles. */

const LEFT_EDGE = 44, RIGHT_EDGE = 12, TOP_EDGE = 14, BOTTOM_EDGE = 20, NEAR = 14;

/** Handles of a quantity, those of the original where nothing was changed. @param {any} wish @param {any} original @param {string} name @returns {number[][]} */
export function findHandles(wish, original, name) {
  return wish[name] || (original ? original.handles[name] : [[0, 1], [1, 1]]);
}

/** @param {App} app */
export function makeEditor(app) {
  let low = -4, high = 2, chosen = 0, moving = false;
  const { canvas, redraw } = makeCanvas({
    class: "editor", tabindex: "0", role: "application",
    "aria-label": "Stiffness or damping along the antenna. Left and right choose a handle, up and down change it.",
  }, draw);
  const wish = () => app.store.state[app.slot] || app.store.state.A;
  const original = () => app.findOriginal(app.slot);

  /** @param {number} share @param {number} w */
  const toX = (share, w) => LEFT_EDGE + share * (w - LEFT_EDGE - RIGHT_EDGE);
  /** @param {number} value @param {number} h */
  const toY = (value, h) => TOP_EDGE + ((high - Math.log10(value)) / (high - low)) * (h - TOP_EDGE - BOTTOM_EDGE);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const colours = app.colours, first = original();
    if (!first) return;
    if (!moving) findRange(first);
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "right";
    c.lineWidth = 1;
    for (let decade = Math.ceil(low); decade <= high; decade++) {
      const y = toY(10 ** decade, h);
      c.strokeStyle = colours.line;
      c.beginPath();
      c.moveTo(LEFT_EDGE, y);
      c.lineTo(w - RIGHT_EDGE, y);
      c.stroke();
      c.fillStyle = colours.soft;
      if (high - low < 7 || decade % 2 === 0) c.fillText(decade >= -2 && decade <= 3 ? String(10 ** decade) : `10${raise(decade)}`, LEFT_EDGE - 6, y + 4);
    }
    c.textAlign = "left";
    c.fillText("base", LEFT_EDGE, h - 5);
    c.textAlign = "right";
    c.fillText("tip", w - RIGHT_EDGE, h - 5);
    const other = app.editing === "stiffness" ? "damping" : "stiffness";
    drawCurve(c, w, h, readCurve(wish(), first, other), colours.soft, 1.2, [2, 3]);
    drawCurve(c, w, h, first[app.editing], colours.soft, 1, [5, 4]);
    if (app.store.state.B) {
      const away = app.slot === "A" ? "B" : "A";
      drawCurve(c, w, h, readCurve(app.store.state[away], app.findOriginal(away), app.editing), SLOT_COLOURS[/** @type {"A"|"B"} */ (away)], 1.4, []);
    }
    const colour = SLOT_COLOURS[/** @type {"A"|"B"} */ (app.slot)], curve = readCurve(wish(), first, app.editing);
    const fade = c.createLinearGradient(0, TOP_EDGE, 0, h - BOTTOM_EDGE);
    fade.addColorStop(0, colour + "38");
    fade.addColorStop(1, colour + "04");
    drawCurve(c, w, h, curve, colour, 2.4, [], fade);
    findHandles(wish(), first, app.editing).forEach(([share, value], k) => {
      const held = k === chosen && document.activeElement === canvas;
      c.beginPath();
      c.arc(toX(share, w), toY(lift(value), h), held ? 7 : 5.5, 0, 2 * Math.PI);
      c.fillStyle = colours.card;
      c.fill();
      c.lineWidth = held ? 3 : 2;
      c.strokeStyle = colour;
      c.stroke();
    });
  }

  /** What a handle's value becomes where the total compliance is kept. @param {number} value */
  function lift(value) {
    return app.editing === "stiffness" ? value * findFactor(wish(), original()) : value;
  }

  /** @param {any} first */
  function findRange(first) {
    const values = ["stiffness", "damping"].flatMap((name) => [...first[name], ...readCurve(wish(), first, name)]).filter((v) => v > 0);
    low = Math.floor(Math.log10(Math.min(...values)) - 0.3);
    high = Math.ceil(Math.log10(Math.max(...values)) + 0.3);
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h @param {number[]} values @param {string} colour @param {number} thick @param {number[]} dash @param {CanvasGradient} [fill] */
  function drawCurve(c, w, h, values, colour, thick, dash, fill) {
    c.beginPath();
    values.forEach((value, k) => {
      const x = toX(values.length > 1 ? k / (values.length - 1) : 0.5, w), y = toY(Math.max(value, 10 ** (low - 1)), h);
      if (k) c.lineTo(x, y);
      else c.moveTo(x, y);
    });
    c.strokeStyle = colour;
    c.lineWidth = thick;
    c.setLineDash(dash);
    c.stroke();
    c.setLineDash([]);
    if (fill) {
      c.lineTo(toX(1, w), h - BOTTOM_EDGE);
      c.lineTo(toX(0, w), h - BOTTOM_EDGE);
      c.fillStyle = fill;
      c.fill();
    }
  }

  /** @param {MouseEvent} event */
  function findHandle(event) {
    const [x, y] = findPointer(event, canvas);
    let best = NEAR ** 2, found = -1;
    findHandles(wish(), original(), app.editing).forEach(([share, value], k) => {
      const far = (toX(share, canvas.clientWidth) - x) ** 2 + (toY(lift(value), canvas.clientHeight) - y) ** 2;
      if (far < best) { best = far; found = k; }
    });
    return found;
  }

  /** @param {(handles: number[][]) => void} how @param {boolean} done */
  function edit(how, done) {
    app.store.change((/** @type {any} */ s) => {
      const one = s[app.slot] || s.A, handles = findHandles(one, original(), app.editing).map((pair) => [...pair]);
      how(handles);
      one[app.editing] = handles;
    }, done);
  }

  /** @param {MouseEvent} event @returns {[number, number]} */
  function read(event) {
    const [x, y] = findPointer(event, canvas), w = canvas.clientWidth, h = canvas.clientHeight;
    const value = 10 ** (high - ((y - TOP_EDGE) / (h - TOP_EDGE - BOTTOM_EDGE)) * (high - low));
    return [Math.max(0, Math.min(1, (x - LEFT_EDGE) / (w - LEFT_EDGE - RIGHT_EDGE))), Math.max(1e-9, Math.min(1e6, value)) / lift(1)];
  }

  keepGrips(canvas, findHandle);
  canvas.addEventListener("pointerdown", (event) => {
    const k = findHandle(event);
    if (k < 0) return;
    chosen = k;
    moving = true;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!moving) {
      canvas.style.cursor = findHandle(event) >= 0 ? "grab" : "default";
      return;
    }
    const [share, value] = read(event);
    edit((handles) => {
      const inner = chosen > 0 && chosen < handles.length - 1;
      if (inner) handles[chosen][0] = Number(Math.max(handles[chosen - 1][0] + 0.01, Math.min(handles[chosen + 1][0] - 0.01, share)).toFixed(4));
      handles[chosen][1] = Number(value.toPrecision(4));
    }, false);
  });
  const settle = () => {
    if (!moving) return;
    moving = false;
    app.store.change(() => {});
  };
  canvas.addEventListener("pointerup", settle);
  canvas.addEventListener("pointercancel", settle);
  canvas.addEventListener("dblclick", (event) => {
    const near = findHandle(event), [share, value] = read(event);
    edit((handles) => {
      if (near > 0 && near < handles.length - 1) handles.splice(near, 1);
      else if (near < 0 && handles.length < 24 && !handles.some(([x]) => Math.abs(x - share) < 0.005)) {
        handles.push([Number(share.toFixed(4)), Number(value.toPrecision(4))]);
        handles.sort((a, b) => a[0] - b[0]);
      }
    }, true);
  });
  canvas.addEventListener("keydown", (event) => {
    const handles = findHandles(wish(), original(), app.editing), n = handles.length;
    const factor = { ArrowUp: 1.1, ArrowDown: 1 / 1.1 }[event.key];
    if (event.key === "ArrowRight" || event.key === "ArrowLeft") chosen = (chosen + (event.key === "ArrowRight" ? 1 : n - 1)) % n;
    else if (factor) edit((all) => { all[chosen][1] = Number((all[chosen][1] * factor ** (event.shiftKey ? 5 : 1)).toPrecision(4)); }, true);
    else return;
    event.preventDefault();
    event.stopPropagation();
    const [share, value] = findHandles(wish(), original(), app.editing)[chosen];
    announce(app.root, `${app.editing} at ${Math.round(100 * share)} % of the antenna: ${write(value)}`);
    redraw();
  });
  canvas.addEventListener("focus", redraw);
  canvas.addEventListener("blur", redraw);
  return { element: canvas, redraw };
}

/** Values along the antenna, as the server makes them. @param {any} wish @param {any} original @param {string} name @returns {number[]} */
export function readCurve(wish, original, name) {
  if (!original) return [];
  if (!wish[name]) return original[name];
  const values = sampleHandles(wish[name], original[name].length);
  const factor = name === "stiffness" ? findFactor(wish, original) : 1;
  return factor === 1 ? values : values.map((/** @type {number} */ v) => v * factor);
}

/** @param {number[][]} handles @param {number} n */
function sampleHandles(handles, n) {
  return Array.from({ length: n }, (_, k) => {
    const share = n > 1 ? k / (n - 1) : 0;
    let after = handles.findIndex(([x]) => x >= share);
    if (after === 0) return handles[0][1];
    if (after < 0) return handles[handles.length - 1][1];
    const [a, b] = [handles[after - 1], handles[after]];
    return Math.exp(Math.log(a[1]) + ((share - a[0]) / (b[0] - a[0])) * (Math.log(b[1]) - Math.log(a[1])));
  });
}

/** @param {any} wish @param {any} original */
function findFactor(wish, original) {
  if (!wish.matched || !wish.stiffness || !original) return 1;
  return sumCompliance(sampleHandles(wish.stiffness, original.stiffness.length)) / sumCompliance(original.stiffness);
}

/** Σ 1/k. @param {number[]} stiffness */
export function sumCompliance(stiffness) {
  return stiffness.reduce((sum, k) => sum + 1 / k, 0);
}
