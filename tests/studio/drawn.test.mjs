// What the page draws: every line, place and word on its canvases, held against closed forms. Run by test_units.py.
import assert from "node:assert/strict";
import test from "node:test";
import { BOTH, COLD, HOT, KIND_COLOURS, SLOT_COLOURS, pick } from "./colours.js";

const RATIO = 2; // pixels of the screen to one of CSS

/** A canvas that remembers what was drawn on it, in its own pixels, whatever it was turned and moved by. */
class Ink {
  constructor(canvas) { Object.assign(this, { canvas, dash: [], path: [], stack: [], at: [1, 0, 0, 1, 0, 0] }); this.clearRect(); }
  put(x, y) { const [a, b, c, d, e, f] = this.at; return [a * x + c * y + e, b * x + d * y + f]; }
  save() { this.stack.push([...this.at]); }
  restore() { this.at = this.stack.pop(); }
  setTransform(...at) { this.at = at.map((value) => value / RATIO); }
  translate(x, y) { this.at = [...this.at.slice(0, 4), ...this.put(x, y)]; }
  rotate(t) { const [a, b, c, d, e, f] = this.at, p = Math.cos(t), q = Math.sin(t); this.at = [a * p + c * q, b * p + d * q, c * p - a * q, d * p - b * q, e, f]; }
  clearRect() { Object.assign(this, { texts: [], strokes: [], fills: [], rects: [], boxes: [], pictures: [] }); }
  beginPath() { this.path = []; }
  moveTo(x, y) { this.path.push(this.put(x, y)); }
  lineTo(x, y) { this.path.push(this.put(x, y)); }
  arc(x, y, radius) { this.path.push([...this.put(x, y), radius]); }
  ellipse(x, y, wide, high, turn, from, to) { this.path.push([...this.put(x, y), wide, high, Math.atan2(this.at[1], this.at[0])]); }
  closePath() {}
  setLineDash(dash) { this.dash = dash; }
  stroke(path) { this.strokes.push({ ink: this.strokeStyle, dash: this.dash, wide: this.lineWidth, points: path ? path.points : this.path }); }
  fill(path) { this.fills.push({ ink: this.fillStyle, points: path ? path.points : this.path }); }
  fillRect(x, y, wide, high) { this.rects.push({ ink: this.fillStyle, x, y, wide, high }); }
  strokeRect(x, y, wide, high) { this.boxes.push({ ink: this.strokeStyle, x, y, wide, high }); }
  fillText(words, x, y) { this.texts.push({ words, x, y, ink: this.fillStyle }); }
  measureText(words) { return { width: 6 * words.length }; }
  drawImage(picture, ...box) { this.pictures.push({ picture, box }); }
  createLinearGradient() { return { addColorStop() {} }; }
  createRadialGradient() { return { addColorStop() {} }; }
  createImageData(wide, high) { return { data: new Uint8ClampedArray(4 * wide * high), wide, high }; }
  putImageData(image) { this.image = image; }
  isPointInPath({ points }, ...at) { // a ray to the right crosses the rim an odd number of times
    const [x, y] = at.map((value) => value / RATIO);
    return points.filter(([ax, ay], k) => { const [bx, by] = points[(k + 1) % points.length]; return ay > y !== by > y && x < ax + ((bx - ax) * (y - ay)) / (by - ay); }).length % 2 === 1;
  }
  isPointInStroke() { return false; }
}

class Element {
  constructor() { Object.assign(this, { children: [], style: {}, dataset: {}, heard: {}, textContent: "", clientWidth: 700, clientHeight: 400, classList: { add() {}, remove() {}, toggle() {} } }); }
  append(...more) { this.children.push(...more); }
  replaceChildren(...more) { this.children = more; }
  setAttribute(name, value) { this[name] = value; }
  addEventListener(name, take) { this.heard[name] = take; }
  getContext() { return (this.ink ||= new Ink(this)); }
  getBoundingClientRect() { return { left: 0, top: 0 }; }
  setPointerCapture() {}
  tell(name, more) { this.heard[name]({ preventDefault() {}, stopPropagation() {}, ...more }); }
  find(kind) { return this.className && this.className.split(" ").includes(kind) ? this : this.children.map((one) => one.find && one.find(kind)).find(Boolean); }
  get words() { return [this.textContent, ...this.children.map((one) => one.words ?? String(one))].filter(Boolean).join("|"); }
}
Object.assign(globalThis, { window: globalThis, devicePixelRatio: RATIO, document: { createElement: () => new Element() }, ResizeObserver: class { observe() {} }, matchMedia: () => ({ matches: false }) });
globalThis.Path2D = class {
  constructor() { this.points = []; }
  moveTo(...place) { this.points.push(place); }
  lineTo(...place) { this.points.push(place); }
  arc(x, y, radius) { for (let k = 0; k < 24; k++) this.points.push([x + radius * Math.cos((k * Math.PI) / 12), y + radius * Math.sin((k * Math.PI) / 12)]); }
  closePath() {}
};
const { makeScene } = await import("./scene.js"), { makeTensor } = await import("./tensor.js");
const { makeSpikePanel, Nerve } = await import("./spikes.js"), { makeEditor } = await import("./editor.js"), { makeBoardPanel } = await import("./board.js"), { makeStagePanel } = await import("./stage.js");
const { makeCodePanel, makeSetPanel, makeVerdictPanel } = await import("./charts.js"), { TouchRecord } = await import("./record.js");

const near = (a, b, off = 1e-5) => assert.ok(Math.abs(a - b) <= off * Math.max(1, Math.abs(b)), `${a} is not ${b}`);
const all = (a, b, off) => { assert.equal(a.length, b.length); a.forEach((value, k) => (Array.isArray(value) ? all(value, b[k], off) : near(value, b[k], off))); };
const COLOURS = Object.fromEntries(["ink", "soft", "line", "card", "accent", "stage", "body", "solid", "rim", "page"].map((name) => [name, name]));
const ANTENNA = { length: 15, segments: [6, 4, 3, 2], sensors: [1, 3, 4], radius: 0.1, rest: [0, 0, 0, 0] };
const RIM = [[2, 0], [0, 1], [-1, 0], [0, -1]], HIGH = 13, N = 9;

/** Nine samples, each its own, of an antenna of four unequal segments and three sensors, and of two objects. */
function makeRecord(interval = 4, factor = 1, antenna = ANTENNA) {
  const record = new TouchRecord(), rows = (make) => ({ shape: [N, make(0).length], data: new Float32Array(Array.from({ length: N }, (_, k) => make(k)).flat()) });
  record.begin({ id: 3 + factor, antenna, rims: [[RIM], [RIM]], total: N, interval });
  record.add(0, {
    angle: rows((k) => [0.02, -0.03, 0.05, 0.011].map((value, h) => factor * value * (k + 1 + 0.3 * h))),
    base: rows((k) => [0.3 * k, 0.1 * k, 0.4 + 0.05 * k]),
    place: rows((k) => [3 + 0.2 * k, 9 - 0.1 * k, 0.3 + 0.1 * k, -4, 12, 1.1]),
    force: rows((k) => [2e-5, 3e-5 * k, 1e-5, -5e-6]),
    contact: rows((k) => [k < 2 ? NaN : 0.55 + 0.02 * k]),
  });
  record.ended = true;
  return record;
}

/** @param {any} [more] */
function makeApp(more = {}, state = {}) {
  const app = {
    colours: COLOURS, records: { A: makeRecord(), B: makeRecord(4, -0.6) }, drawn: {}, time: 18, selected: 0, hover: null, hinted: true, showContact: true, quantity: "angle",
    store: { state: { mode: "touch", B: null, touch: { side: "left", location: 0.6, objects: [{ x: -4, y: 12 }] }, ...state }, change(f) { f(this.state); } },
    aimed: [], aim(...given) { this.aimed.push(given); }, startHand() { this.handOn = true; }, setHover(at) { this.hover = at; }, draw() {}, seek(at) { this.time = at; },
    duration() { return N * this.records.A.interval; }, findPeak() { return this.records.A.peak; }, play() {}, plan: {}, studies: {}, studying: {}, isStale: () => false, isLearned: () => true, ...more,
  };
  return app;
}

/** Draw, and what lay on the canvas then; words and boxes lie within it. @param {(app: any) => any} make @param {any} app */
function paint(make, app, inside = true) { const made = make(app); made.redraw(); const ink = made.element.getContext("2d"); if (inside) checkInside(ink); return { made, ink }; }

/** @param {Ink} ink @param {any[]} [lines] of which no point may lie beyond the canvas */
function checkInside({ texts, rects, boxes, strokes, canvas }, lines = strokes.filter((one) => one.dash.length)) {
  const within = (x, y) => assert.ok(x >= -1 && x <= canvas.clientWidth + 1 && y >= -1 && y <= canvas.clientHeight + 1, `${x}, ${y} is beyond the picture`);
  for (const { x, y } of texts) within(x, y);
  for (const { x, y, wide, high } of [...rects, ...boxes]) { within(x, y); within(x + wide, y + high); assert.ok(wide >= 0 && high >= 0); }
  for (const { points } of lines) for (const [x, y] of points) within(x, y);
}

/** Pixels to a mm, by the antenna's own drawing: its first segment lies between its first two points. @param {any} app */
function findScale(app) {
  const { px, py } = app.drawn.A;
  return Math.hypot(px[1] - px[0], py[1] - py[0]) / app.records.A.antenna.segments[0];
}
/** A share of the way from sample 4 to sample 5: 18 ms are sample 4.5 where one is every 4 ms. */
const AT = 4.5, at = (make) => make(4).map((value, k) => value + 0.5 * (make(5)[k] - value));

test("a bar is as long as its words say, at the scale of the antenna beside it, and so is the grid", () => {
  for (const length of [15, 42, 7]) {
    const antenna = { ...ANTENNA, length, segments: ANTENNA.segments.map((one) => (one * length) / 15) };
    const app = makeApp({ records: { A: makeRecord(4, 0, antenna), B: makeRecord() }, time: 16 }), { ink } = paint(makeScene, app), scale = findScale(app);
    near(app.view.scale, scale);
    const { words, x, y } = ink.texts.find((one) => one.words.endsWith(" mm"));
    const bar = ink.strokes.find(({ points: [a, b, ...more] }) => b && !more.length && a[1] === b[1] && b[0] === x && Math.abs(a[1] - y) < 8);
    near((bar.points[1][0] - bar.points[0][0]) / scale, parseFloat(words));
    const upright = ink.strokes[0].points.filter(([, to]) => to === 0).map(([to]) => to);
    near((upright[1] - upright[0]) / scale, 5);
  }
});

test("antenna, base and objects stand and turn where they are, at the moment between two samples", () => {
  for (const side of ["left", "right"]) {
    const app = makeApp({}, { touch: { side, location: 0.6, objects: [] } }), { ink } = paint(makeScene, app, side === "left"), { scale, ox, oy } = app.view;
    const place = (x, y) => [ox + y * scale, oy + x * scale];
    const base = at((k) => [0.3 * k, 0.1 * k, 0.4 + 0.05 * k]), { px, py } = app.drawn.A;
    all([px[0], py[0]], place(base[0], base[1]));
    const [before, after] = [4, 5].map((k) => app.records.A.points(k));
    all([...px].map((x, k) => [x, py[k]]), [...px].map((_, k) => place((before[2 * k] + after[2 * k]) / 2, (before[2 * k + 1] + after[2 * k + 1]) / 2)));
    if (side === "left") checkInside(ink, [{ points: [...px].map((x) => [x, py[0]]) }]); // the base, and as far as the tip is along
    const pieces = ink.strokes.filter(({ points: [a, b, ...more] }) => b && !more.length && [...px].some((x, k) => k && b[0] === x && b[1] === py[k])).map((one) => one.ink);
    const bends = at((k) => [...app.records.A.data.angle.subarray(4 * k, 4 * k + 4)]).map((value) => Math.abs(value) / app.findPeak());
    assert.deepEqual(pieces, bends.map((share) => (share < 0.04 ? "body" : pick(HOT, 0.35 + 0.5 * Math.min(1, share)))));
    const front = ink.fills.find((one) => one.ink === "ink" && one.points.length === 3).points.slice(1); // the half disc's flat nose
    const nose = [(front[0][0] + front[1][0]) / 2 - px[0], (front[0][1] + front[1][1]) / 2 - py[0]], size = Math.hypot(...nose);
    all(nose, [size * Math.cos(base[2]), size * Math.sin(base[2])]); // along is to the right, across is down
    const objects = ink.fills.filter((one) => one.points.length === 4).map((one) => one.points);
    all(objects, [at((k) => [3 + 0.2 * k, 9 - 0.1 * k, 0.3 + 0.1 * k]), [-4, 12, 1.1]].map(([x, y, turn]) =>
      RIM.map(([a, b]) => place(x + a * Math.sin(turn) - b * Math.cos(turn), y + a * Math.cos(turn) + b * Math.sin(turn)))));
  }
});

test("the force is drawn where contact is and as it points, the ring at the sensor that is pointed at, the trail to the tip", () => {
  for (const sensor of [0, 1, 2]) {
    const app = makeApp({ hover: { slot: "A", sensor } }), { ink } = paint(makeScene, app), { px, py } = app.drawn.A;
    const ring = ink.strokes.find(({ points }) => points.length === 1 && points[0].length === 3).points[0], hinge = ANTENNA.sensors[sensor] - 1;
    all(ring.slice(0, 2), [px[hinge], py[hinge]]);
    const force = [2e-5 + 1e-5, 3e-5 * 4 - 5e-6], size = Math.hypot(...force), words = ink.texts.find((one) => one.words.endsWith("µN"));
    assert.equal(words.words, `${Number((1e6 * size).toPrecision(3))} µN`);
    const arrow = ink.strokes.find(({ ink: colour, points }) => colour === "accent" && points.length === 2).points;
    all(arrow[0], [px[2], py[2]]); // 0.63 of 15 mm: the point after 6 + 4 mm is the nearest
    const long = Math.hypot(arrow[1][0] - arrow[0][0], arrow[1][1] - arrow[0][1]);
    all([arrow[1][0] - arrow[0][0], arrow[1][1] - arrow[0][1]], [(long * force[1]) / size, (long * force[0]) / size]);
    const trail = ink.strokes.filter((one) => one.ink === SLOT_COLOURS.A).map((one) => one.points), { ox, oy, scale } = app.view;
    all(trail, [1, 2, 3, 4].map((k) => [k - 1, k].map((m) => { const tip = app.records.A.points(m).slice(-2); return [ox + tip[1] * scale, oy + tip[0] * scale]; })), 1e-3);
  }
});

test("what is dragged moves as far as the pointer, on an antenna of any length", () => {
  for (const length of [15, 42, 7]) {
    const antenna = { ...ANTENNA, length, segments: ANTENNA.segments.map((one) => (one * length) / 15) };
    const app = makeApp({ records: { A: makeRecord(4, 0, antenna), B: makeRecord() } }), { made, ink } = paint(makeScene, app), { scale, ox, oy } = app.view;
    const drag = (x, y, across, along, more = {}) => {
      const from = { clientX: ox + y * scale, clientY: oy + x * scale, pointerId: 1 };
      made.element.tell("pointerdown", from);
      for (const share of [0.4, 1]) made.element.tell("pointermove", { ...from, clientX: from.clientX + share * along * scale, clientY: from.clientY + share * across * scale, ...more });
      made.element.tell("pointerup", {});
    };
    const [x, y] = at((k) => [3 + 0.2 * k, 9 - 0.1 * k]);
    drag(x, y, 0.7, 0.12 * length);
    near(app.store.state.touch.location, 0.72, 1e-3);
    drag(-4, 12, 0.7, -1.3);
    all([app.store.state.touch.objects[0].x, app.store.state.touch.objects[0].y], [-3.3, 10.7], 1e-3);
    made.element.tell("keydown", { key: "ArrowRight" });
    near(app.store.state.touch.objects[0].y, 11.2, 1e-3);
    app.store.state.mode = "hand";
    made.redraw();
    const base = at((k) => [0.3 * k, 0.1 * k, 0.4 + 0.05 * k]);
    app.handOn = true;
    drag(base[0], base[1], 0.5, 0.9);
    all(app.aimed.at(-1), [-1, base[0] + 0.5, base[1] + 0.9, base[2]], 1e-3);
    drag(base[0], base[1], 0.5, 0.9, { shiftKey: true });
    all(app.aimed.at(-1), [-1, base[0], base[1], base[2] + 0.05], 1e-3); // 10 mm to a radian, from the heading that it has
    app.records.A.hand = true;
    made.element.tell("keydown", { key: "ArrowDown", shiftKey: true });
    all(app.aimed.at(-1), [-1, base[0] + 0.5, base[1], base[2]], 1e-3);
    for (const [key, place] of [["ArrowDown", [x + 0.5, y]], ["ArrowDown", [x + 1, y]], ["ArrowLeft", [x + 1, y - 0.5]], ["ArrowUp", [x + 0.5, y - 0.5]]]) {
      app.selected = 0;
      made.element.tell("keydown", { key });
      all(app.aimed.at(-1).slice(0, 3), [0, ...place], 1e-3);
    }
    assert.ok(ink.strokes.some((one) => one.dash.length)); // who may be taken has a dashed ring
  }
});

test("the tensor says its sensor, hinge, degrees and milliseconds, however many samples a second there are", () => {
  for (const interval of [1, 4, 0.5])
    for (const sensor of [0, 1, 2]) {
      const record = makeRecord(interval), app = makeApp({ records: { A: record, B: makeRecord() }, time: 5 * interval, hover: { slot: "A", sensor } }), { ink } = paint(makeTensor, app);
      const hinge = ANTENNA.sensors[sensor], all = Array.from({ length: N }, (_, k) => record.data.angle[k * 4 + hinge - 1]);
      const peak = all.reduce((best, value, k) => (Math.abs(value) > Math.abs(all[best]) ? k : best), 0), find = (drawn) => drawn.texts.find((one) => one.words.includes("sensor")).words;
      const say = (show) => `sensor ${sensor + 1}, hinge ${hinge}, peak: ${show(all[peak])} at ${peak * interval} ms; now ${show(all[5])}`;
      assert.equal(find(ink), say((value) => `${((value * 180) / Math.PI).toFixed(2)}°`));
      app.quantity = "curvature";
      assert.equal(find(paint(makeTensor, app).ink), say((value) => `${(value / ANTENNA.segments[hinge - 1]).toFixed(4)} /mm`));
      Object.assign(app, { quantity: "angle", hover: null });
      assert.match(find(paint(makeTensor, app).ink), /^peak: sensor \d, -?\d+\.\d\d° at [\d.]+ ms; now -?\d+\.\d\d°$/);
    }
});

test("what the tensor draws over time has one axis: ticks, cursor, contact, trace and pointer", () => {
  for (const interval of [4, 10]) {
    const record = makeRecord(interval), app = makeApp({ records: { A: record, B: makeRecord() }, time: 5 * interval, hover: { slot: "A", sensor: 1 } }), { made, ink } = paint(makeTensor, app);
    const [zero, other] = ink.texts.filter((one) => /^\d+( ms)?$/.test(one.words)), pixel = (other.x - zero.x) / parseFloat(other.words);
    const x = (sample) => zero.x + pixel * interval * sample, moved = (list) => list.map(([to]) => to);
    assert.ok(ink.strokes.some(({ ink: colour, points }) => colour === "accent" && points.length === 2 && points.every(([to]) => Math.abs(to - x(5)) < 1e-6)));
    const contact = ink.strokes.find((one) => one.dash.join() === "3,3").points;
    all(moved(contact), [2, 3, 4, 5, 6, 7, 8].map((k) => x(k + 0.5)));
    const panel = ink.rects[0], sensors = [2, 3, 4, 5, 6, 7, 8].map((k) => (0.55 + 0.02 * k <= 10 / 15 ? 1 : 2)); // sensors stand at 0, 10/15 and 13/15
    all(contact.map(([, y]) => y), sensors.map((s) => panel.y + panel.high * (1 - (s + 0.5) / 3)));
    const trace = ink.strokes.find((one) => one.ink === SLOT_COLOURS.A).points;
    all(moved(trace), Array.from({ length: N }, (_, k) => x(k + 0.5)));
    const floor = ink.strokes.find(({ ink: colour, points: [a, b] }) => colour === "line" && a[0] === zero.x && a[1] === b[1] && a[1] > panel.y + panel.high).points[0][1];
    const heights = trace.map(([, y]) => floor - y), angles = Array.from({ length: N }, (_, k) => record.angle(1, k));
    angles.forEach((value, k) => near(heights[k] / heights[8], value / angles[8]));
    assert.ok((heights[8] * app.findPeak()) / angles[8] > 25); // the set's peak would fill the trace's strip
    const ticks = ink.texts.filter((one) => /^\d+( ms)?$/.test(one.words));
    ticks.forEach((one, k) => { near(one.x, x(parseFloat(one.words) / interval)); assert.ok(!k || one.x - ticks[k - 1].x > 40); });
    all(ink.pictures[0].box, [0, 0, N, 3, panel.x, panel.y, panel.wide, panel.high]);
    near(panel.x, x(0));
    near(panel.x + panel.wide, x(N));
    checkInside(ink, ink.strokes);
    near(ink.strokes.find((one) => one.ink === "rgba(255,255,255,0.85)").points[0][1], panel.y + panel.high / 2); // the second of three is pointed at
    made.element.tell("pointerdown", { clientX: x(3), clientY: panel.y + 0.1 * panel.high, pointerId: 1 });
    near(app.time, 3 * interval);
    assert.deepEqual(app.hover, { slot: "A", sensor: 2 }); // the tip is above
    made.element.tell("pointerup", {});
    for (const [key, shiftKey, ms] of [["ArrowRight", false, 1], ["ArrowRight", true, 11], ["ArrowLeft", false, 10], ["PageUp", false, 30], ["Home", false, 0], ["End", false, N * interval]]) {
      if (key === "ArrowRight" && !shiftKey) app.time = 0;
      made.element.tell("keydown", { key, shiftKey });
      near(app.time, ms);
    }
    for (const [key, sensor] of [["ArrowUp", 2], ["ArrowDown", 1], ["ArrowDown", 0], ["ArrowDown", 0], ["ArrowUp", 1]]) { made.element.tell("keydown", { key }); assert.equal(app.hover.sensor, sensor); }
  }
});

test("a pixel of the tensor is its sensor's, tip upwards; that of a difference takes from each antenna its own", () => {
  const other = { ...ANTENNA, segments: [3, 5, 1, 6] };
  for (const quantity of ["angle", "curvature"]) {
    const app = makeApp({ quantity, records: { A: makeRecord(), B: makeRecord(4, -0.6, other) }, findPeak: () => 0.4 }, { B: {} });
    const { ink } = paint(makeTensor, app), rows = ink.rects.filter((one) => one.ink === "#07060d");
    all(rows.map((one) => [one.x, one.wide, one.high]), rows.map(() => [rows[0].x, rows[0].wide, rows[0].high]));
    rows.forEach(({ y, high }, k) => { assert.ok(high > 40 && (!k || y > rows[k - 1].y + high)); near(ink.texts.find((one) => one.words === ["A", "B", "A − B"][k]).y, y + high / 2 + 4); });
    all(ink.pictures.map(({ box }) => box.slice(4)), rows.map((one) => [one.x, one.y, one.wide, one.high]));
    const pictures = ink.pictures.map(({ picture }) => picture.getContext("2d").image), [A, B] = ["A", "B"].map((slot) => app.records[slot]);
    assert.equal(pictures.length, 3);
    const value = (record, s, k) => record.angle(s, k) / (quantity === "angle" ? 1 : record.antenna.segments[ANTENNA.sensors[s] - 1]);
    const root = (v) => Math.sign(v) * Math.sqrt(Math.abs(v)), show = (v) => pick(v < 0 ? COLD : HOT, Math.abs(root(v / 0.4))), wanted = [(s, k) => show(value(A, s, k)), (s, k) => show(value(B, s, k)), (s, k) => pick(BOTH, 0.5 + root((value(A, s, k) - value(B, s, k)) / 0.4) / 2)];
    pictures.forEach(({ data, wide, high }, number) => {
      assert.deepEqual([wide, high], [N, 3]);
      for (let s = 0; s < 3; s++)
        for (let k = 0; k < N; k++) { const from = 4 * ((2 - s) * N + k); assert.equal(`rgba(${data.slice(from, from + 3)},1)`, wanted[number](s, k)); }
    });
  }
});

/** Three classes of two kinds, every `step` ms. @param {number} step */
function makeReading(step) {
  const rows = [[0.2, 0.3, 0.5], [0.25, 0.35, 0.4], [0.1, 0.2, 0.7], [0.05, 0.02, 0.93], [0.6, 0.35, 0.05]];
  return { posterior: { shape: [5, 3], data: new Float32Array(rows.flat()) }, noticed: step, step, code: { shape: [2, 5], data: new Float32Array([0, 1, 4, 2, 0, 3, 0, 1, 1, 2]) } };
}
const MATRIX = { shape: [3, 3], data: new Float32Array([1, 0.3, 0.8, 0.3, 1, 0.5, 0.8, 0.5, 1]) };
const study = () => ({
  key: "k", speed: 0.2, peak: 6, labels: [["ball", 1.5, 0.5], ["ball", 3, 0.6], ["box", 1.5, 0.7]], answers: ["ball", "ball", "box"], averages: { nmi: 0.71, pearson: 0.83, ssim: 0.94 },
  "similarity nmi": MATRIX, "similarity pearson": { ...MATRIX, data: MATRIX.data.map((v) => v / 2) }, "similarity ssim": { ...MATRIX, data: MATRIX.data.map((v) => v * v) },
  bases: { shape: [2, 3, 7], data: new Float32Array(42).map((_, k) => (k * 11) % 43) }, tensors: { shape: [3, 2, 4], data: new Float32Array(24).map((_, k) => (k * 5) % 7) },
});

test("probabilities stand over their own milliseconds and at their own height, whatever the decoder's step", () => {
  for (const step of [1, 2, 5]) {
    const reading = makeReading(step), app = makeApp({ studies: { A: study() }, duration: () => 5 * step, time: 3 * step });
    app.records.A.reading = reading;
    const panel = makeVerdictPanel(app), ink = panel.element.find("chart").getContext("2d");
    panel.redraw();
    checkInside(ink, ink.strokes);
    const zero = ink.texts.find((one) => one.words === "0 ms"), end = ink.texts.find((one) => one.words === String(5 * step) && one.y === zero.y);
    const level = (words) => ink.texts.find((one) => one.words === words && one.x < zero.x).y - 4, x = (ms) => zero.x + ((end.x - zero.x) * ms) / (5 * step);
    for (const [kind, chances] of [["ball", [0.5, 0.6, 0.3, 0.07, 0.95]], ["box", [0.5, 0.4, 0.7, 0.93, 0.05]]]) {
      const { points } = ink.strokes.find((one) => one.ink === KIND_COLOURS[kind]);
      all(points, chances.map((p, k) => [x(k * step), level("0") + p * (level("1") - level("0"))]));
      near(ink.texts.find((one) => one.words === kind).y, points[4][1] + 4);
    }
    const cursor = ink.strokes.filter((one) => one.ink === "accent").at(-1).points;
    all(cursor.map(([to]) => to), [x(3 * step), x(3 * step)]);
    const said = (ms) => { app.time = ms; panel.redraw(); return panel.element.find("verdict").words; };
    assert.equal(said(3 * step), `box|0.93 · decided ${2 * step} ms after contact`);
    assert.deepEqual([said(0), said(step), said(2 * step)], ["no touch noticed yet", "not sure yet|perhaps a ball, 0.60", "not sure yet|perhaps a box, 0.70"]);
    assert.equal(said(4 * step), `ball|0.95 · decided ${3 * step} ms after contact · before, box from ${2 * step} ms`);
  }
});

test("a pair of the set is named, coloured, drawn and valued as what it is, under each index", () => {
  const app = makeApp({ studies: { A: study() } }, { touch: { kind: "box", size: 1.5, location: 0.7 } }), panel = makeSetPanel(app);
  const map = panel.element.find("matrix"), caption = panel.element.find("caption"), buttons = panel.element.find("choice").children;
  ["nmi", "pearson", "ssim"].forEach((index, number) => {
    buttons[number].heard.click({});
    const matrix = app.studies.A[`similarity ${index}`].data, ink = map.getContext("2d"), size = 400 / 3, own = [1, 2, 3, 5, 6, 7].map((k) => matrix[k]);
    const [low, top] = [Math.min(...own), Math.max(...own)];
    assert.equal(ink.rects.length, 9);
    for (const { ink: colour, x, y } of ink.rects) {
      const column = Math.round(x / size), row = Math.round(y / size);
      assert.equal(colour, row === column ? "line" : pick(HOT, (matrix[3 * row + column] - low) / (top - low)));
    }
    near(ink.boxes.at(-1).y, 2 * size); // the row of the touch that is shown
    map.tell("pointermove", { clientX: 2.5 * size, clientY: 0.5 * size });
    assert.equal(caption.textContent, `ball 1.5 mm at 0.5 L  ·  box 1.5 mm at 0.7 L: ${["NMI", "Pearson", "SSIM"][number]} ${Number(matrix[2].toPrecision(3))}`);
    assert.equal(panel.element.find("numbers").words.split("|").at(-1), `A: ${app.studies.A.averages[index]}`);
  });
  for (const [key, row, column] of [["ArrowRight", 0, 0], ["ArrowDown", 1, 0], ["ArrowLeft", 1, 2], ["ArrowUp", 0, 2]]) { // round the corner, too
    map.tell("keydown", { key });
    assert.equal(caption.textContent.split(":")[0], [row, column].map((k) => `${study().labels[k][0]} ${study().labels[k][1]} mm at ${study().labels[k][2]} L`).join("  ·  "));
  }
  const { rects } = panel.element.find("pair").getContext("2d"), { data } = app.studies.A.tensors;
  const wide = (700 - 8) / 2;
  for (const { ink: colour, x, y } of rects) {
    const trial = x < wide ? 0 : 2, k = Math.round((x - (trial ? wide + 8 : 0)) / (wide / 4)), s = 1 - Math.round(y / 200);
    assert.equal(colour, pick(HOT, data[8 * trial + 4 * s + k] / 6));
  }
  assert.equal(rects.length, 16);
  map.tell("click", {});
  assert.deepEqual(app.store.state.touch, { kind: "ball", size: 1.5, location: 0.5, speed: 0.2 });
});

test("a spike stands at its moment, in the row of its sensor and the colour of its side", () => {
  const record = makeRecord(4, 6, { ...ANTENNA, sensors: [1, 2, 4] }), app = makeApp({ records: { A: record, B: makeRecord() } }), panel = makeSpikePanel(app), more = panel.element.children.at(-1), heard = new Nerve(3, 4, 33.5);
  for (let k = 0; k < N; k++) heard.push((sensor) => record.angle(sensor, k));
  more.open = true;
  panel.redraw();
  panel.update();
  const [dark, ...marks] = panel.element.find("raster").getContext("2d").rects, cursor = marks.pop();
  assert.ok(heard.spikes.length > 5);
  assert.equal(panel.element.find("scale").words, ` · ${heard.spikes.length} spikes, up to ${Number(heard.greatest.toPrecision(3))} Hz`);
  all(marks.map((one) => [one.x + 0.5, one.y]), heard.spikes.map(({ unit, time }) => [dark.x + (dark.wide * (time + 2)) / 36, dark.y + dark.high * (1 - ((unit % 3) + 1) / 3)]));
  for (const key of [(one) => one.ink, (one, k) => `${one.ink} ${heard.spikes[k].unit < 3}`, (one) => one.ink.length + one.ink]) assert.equal(new Set(marks.map(key)).size, 2);
  checkInside(panel.element.find("raster").getContext("2d"));
  near(cursor.x + 0.75, dark.x + (dark.wide * app.time) / 36);
});

test("handles and curves of the editor stand at their values, and a handle that is dragged takes the value that it is dragged to", () => {
  const original = { stiffness: [100, 20, 5, 1], damping: [40, 20, 10, 4], handles: { stiffness: [[0, 100], [0.5, 10], [1, 1]], damping: [[0, 40], [1, 4]] } };
  for (const editing of ["stiffness", "damping"]) {
    const line = new Element(), app = makeApp({ slot: "A", editing, findOriginal: () => original, root: { querySelector: () => line } }, { A: { preset: "x" } }), { made, ink } = paint(makeEditor, app);
    const ticks = ink.texts.filter((one) => /^[\d.]+$/.test(one.words)).map((one) => [Math.log10(Number(one.words)), one.y - 4]), [[d0, y0], [d1, y1]] = [ticks[0], ticks.at(-1)];
    const y = (value) => y0 + ((Math.log10(value) - d0) * (y1 - y0)) / (d1 - d0), left = ink.texts.find((one) => one.words === "base").x, right = ink.texts.find((one) => one.words === "tip").x, x = (share) => left + share * (right - left);
    assert.ok(ticks.length > 2);
    checkInside(ink, ink.strokes);
    all(ink.fills.filter((one) => one.ink === "card").map((one) => one.points[0].slice(0, 2)), original.handles[editing].map(([share, value]) => [x(share), y(value)]));
    const curve = (values) => values.map((value, k) => [x(k / 3), y(value)]), other = editing === "stiffness" ? "damping" : "stiffness";
    all(ink.strokes.find((one) => one.dash.join() === "2,3").points, curve(original[other]));
    all(ink.strokes.find((one) => one.ink === SLOT_COLOURS.A).points.slice(0, 4), curve(original[editing]));
    const last = original.handles[editing].length - 1;
    made.element.tell("pointerdown", { clientX: x(1), clientY: y(original.handles[editing][last][1]), pointerId: 1 });
    made.element.tell("pointermove", { clientX: x(1), clientY: y(2.5) });
    made.element.tell("pointerup", {});
    all(app.store.state.A[editing].at(-1), [1, 2.5], 1e-3);
    made.element.tell("keydown", { key: "ArrowUp" });
    near(app.store.state.A[editing].at(-1)[1], 2.75, 1e-3);
    assert.equal(line.textContent, `${editing} at 100 % of the antenna: 2.75`); // to screen readers
    made.element.tell("dblclick", { clientX: x(0.25), clientY: y(7) }); // away from all handles: a new one
    all(app.store.state.A[editing][1], [0.25, 7], 1e-3);
    made.element.tell("pointerdown", { clientX: x(0.25), clientY: y(7), pointerId: 1 });
    for (const [share, kept] of [[0.3, 0.3], [-1, 0.01], [2, app.store.state.A[editing][2][0] - 0.01]]) { // it stays between its neighbours
      made.element.tell("pointermove", { clientX: x(share), clientY: y(8.5) });
      all(app.store.state.A[editing][1], [kept, 8.5], 1e-3);
    }
    made.element.tell("pointerup", {});
  }
});
