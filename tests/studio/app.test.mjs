// What the page does with what it is told, and what it asks for: no picture is drawn here. Run by test_units.py.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";

class Element {
  constructor(tag = "div") { Object.assign(this, { tagName: tag.toUpperCase(), children: [], style: { setProperty() {} }, dataset: {}, heard: {}, named: {}, classes: new Set(), hidden: false, text: "", value: "", options: [] }); }
  get classList() { const { classes } = this; return { add: (name) => classes.add(name), remove: (name) => classes.delete(name), toggle: (name, on) => (on ? classes.add(name) : classes.delete(name)) }; }
  get textContent() { return this.text; }
  set textContent(words) { this.text = String(words); this.children = []; }
  get words() { return [this.text, ...this.children.map((one) => one.words ?? String(one))].filter(Boolean).join("|"); }
  get firstChild() { return this.children[0]; }
  append(...more) { this.children.push(...more); }
  replaceChildren(...more) { this.children = more; this.options = more; }
  setAttribute(name, value) { this.named[name] = value; if (name.startsWith("data-")) this.dataset[name.slice(5)] = value; }
  addEventListener(name, take) { this.heard[name] = take; }
  getContext() { return {}; }
  setPointerCapture() {}
  querySelector(css) { const name = css.replace(/^\./, ""); return this.find((one) => one.className && one.className.split(" ").includes(name)); }
  querySelectorAll() { return []; }
  find(want) { return want(this) ? this : this.children.map((one) => one instanceof Element && one.find(want)).find(Boolean); }
  tell(name, more = {}) { return this.heard[name]({ preventDefault() {}, stopPropagation() {}, target: this, key: "", ...more }); }
}
let frames = [], timers = [];
Object.assign(globalThis, {
  Element, document: { createElement: (tag) => new Element(tag), createElementNS: (_, tag) => new Element(tag), addEventListener() {} }, ResizeObserver: class { observe() {} },
  window: globalThis, matchMedia: () => ({ matches: true, addEventListener() {} }), getComputedStyle: () => ({ getPropertyValue: (name) => name }),
  requestAnimationFrame: (next) => frames.push(next), addEventListener() {},
  setTimeout: (next, ms) => { timers.push({ next, ms }); return timers.length; }, clearTimeout: (number) => { if (timers[number - 1]) timers[number - 1].next = () => {}; },
});
const { App, makeStatus } = await import("./studio.js"), { makeState } = await import("./state.js"), { linkServer, linkModel } = await import("./link.js");
const { findFrame, makeTurnableScene } = await import("./turnable.js"), { makeAntennaPanel, makeTouchPanel } = await import("./controls.js"), { makeTags } = await import("./tags.js");
const { readTouch, startAlone } = await import("./alone.js"), { Host } = await import("./host.js"), { makeTour } = await import("./tour.js"), { TouchRecord } = await import("./record.js"), { makeStagePanel, makeStudyPanel, makeTensorPanel } = await import("./stage.js"), { makeShare } = await import("./share.js");

const near = (a, b, off = 1e-9) => assert.ok(Math.abs(a - b) <= off * Math.max(1, Math.abs(b)), `${a} is not ${b}`);
const ANTENNA = { name: "a", length: 9, segments: [4, 3, 2], sensors: [1, 3], radius: 0.2, rest: [0, 0, 0], stiffness: [30, 10, 2], damping: [6, 2, 1] };
const rows = (n, wide, make) => ({ shape: [n, wide], data: new Float32Array(Array.from({ length: n * wide }, (_, k) => make(Math.floor(k / wide), k % wide))) });
const piece = (first, n, factor = 1) => ({ angle: rows(n, 3, (k, h) => factor * (first + k + 1) * [0.01, 0.02, 0.04][h]), base: rows(n, 3, () => 0) });

/** A page without panels, and all that it has asked for. @param {any} [plan] */
function open(plan = {}) {
  frames = [];
  timers = [];
  const app = new App(new Element(), { alone: false, rest: 900, panels: [], steps: [], header: () => ({ element: new Element(), tourButton: new Element(), update() {}, share: {} }), ...plan });
  app.asks = [];
  app.link = { send: (message) => app.asks.push(structuredClone(message)), close() {} };
  app.catalogue = { presets: { exponential: { ...ANTENNA }, linear: { ...ANTENNA }, space: { ...ANTENNA, planes: ["x", "z"] } } };
  app.take = () => app.asks.splice(0);
  app.said = () => app.root.querySelector(".note").textContent;
  return app;
}
const BEGIN = { type: "touch", slot: "A", part: "begin", antenna: ANTENNA, rims: [[]], total: 8, preview: false };
/** A whole touch of eight samples. @param {any} app @param {any} [more] */
function touch(app, more = {}, factor = 1) {
  app.hear({ ...BEGIN, id: 1, ...more }, {});
  app.hear({ type: "touch", slot: "A", id: 1, ...more, part: "piece", first: 0 }, piece(0, 8, factor));
  app.hear({ type: "touch", slot: "A", id: 1, hash: "h", ...more, part: "end" }, {});
}

test("a change asks for both antennas' touches, coarsely only while something is dragged, and each question has its own number", () => {
  const app = open();
  app.store.change((s) => { s.B = { preset: "linear" }; s.touch.speed = 0.31; }, false);
  const [a, b] = app.take();
  assert.deepEqual([a.slot, a.wish.antenna, a.wish.preview, b.slot, b.wish.antenna, b.wish.preview], ["A", { preset: "exponential" }, true, "B", { preset: "linear" }, true]);
  assert.deepEqual([a.wish.speed, b.wish.speed, b.id], [0.31, 0.31, a.id + 1]);
  assert.equal(timers.filter(({ ms }) => ms === 900).length, 0); // who drags is not studied
  app.store.change((s) => { s.B = null; });
  assert.deepEqual(app.take().map(({ slot, id, wish }) => [slot, id, wish.preview]), [["A", b.id + 1, false]]);
  assert.equal(timers.filter(({ ms }) => ms === 900).length, 1);
  assert.deepEqual([app.slot, app.status], ["A", "busy"]);
});

test("a mode asks for what is its own once it is set, and what another mode had going ends", () => {
  const app = open();
  app.store.change((s) => { s.A = { preset: "linear" }; }, false);
  app.take();
  app.store.change((s) => { s.mode = "hand"; });
  assert.deepEqual(app.take().map(({ type, wish }) => [type, wish.preview]), [["touch", false]]);
  app.handPace = 0.3;
  app.startHand();
  assert.deepEqual(app.take().map(({ type, slot, pace }) => [type, slot, pace]), [["hand", "A", 0.3]]);
  app.aim(0, 1, 2, 0);
  app.aim(-1, 3, 4, 0.5);
  frames.splice(0).forEach((next) => next(0));
  assert.deepEqual(app.take(), [{ type: "aim", what: -1, x: 3, y: 4, turn: 0.5 }]); // of one frame the newest
  app.store.change((s) => { s.mode = "board"; s.B = { preset: "linear" }; });
  const [ended, ports] = app.take();
  app.handOn = false; // it has let go
  assert.deepEqual([ended.what, ports.type, app.store.state.B], ["end", "ports", null]);
  app.listen("/dev/x");
  const heard = () => app.take().map(({ type, port, antenna, speed }) => [type, port, antenna, speed]), ask = ["ports", undefined, undefined, undefined];
  assert.deepEqual(heard(), [["listen", "/dev/x", { preset: "linear" }, 0.06]]);
  app.store.change((s) => { s.touch.location = 0.9; });
  assert.deepEqual(heard(), [ask]); // who is heard already is not heard anew
  app.store.change((s) => { s.touch.speed = 0.2; });
  assert.deepEqual(heard(), [ask, ["listen", "/dev/x", { preset: "linear" }, 0.2]]);
  app.status = "live";
  app.store.change((s) => { s.mode = "touch"; });
  assert.deepEqual([app.take().map(({ type, port }) => [type, port])[0], app.listening], [["listen", ""], ""]);
});

test("what answers an older question is not shown, of either antenna", () => {
  for (const slot of ["A", "B"]) {
    const app = open(), record = app.records[slot];
    touch(app, { slot, id: 7 });
    app.hear({ ...BEGIN, slot, id: 6, total: 3 }, {});
    app.hear({ type: "touch", slot, id: 6, part: "piece", first: 0 }, piece(0, 3, 5));
    app.hear({ type: "touch", slot, id: 6, part: "end", hash: "old" }, {});
    app.hear({ type: "reading", slot, id: 6, noticed: 2 }, { posterior: { shape: [4, 2] } });
    assert.deepEqual([record.total, record.hash, record.reading, app.records[slot === "A" ? "B" : "A"].filled], [8, "h", null, 0]);
    near(record.peak, 0.32, 1e-6);
    app.hear({ type: "reading", slot, id: 7, noticed: 2 }, { posterior: { shape: [4, 2] }, code: 9 });
    assert.deepEqual([record.reading.noticed, record.reading.step, record.reading.code], [2, 2, 9]); // 8 samples, 4 read
  }
});

test("a decoder that reads 380 samples of a longer touch reads each of them, and of a shorter set every second", () => {
  for (const [total, read, step] of [[380, 380, 1], [1000, 380, 1], [380, 190, 2], [60, 60, 1]]) {
    const app = open();
    app.hear({ ...BEGIN, id: 1, total }, {});
    app.hear({ type: "reading", slot: "A", id: 1, noticed: -1 }, { posterior: { shape: [read, 3] } });
    assert.equal(app.records.A.reading.step, step);
  }
});

test("the end of a touch says whether it is exact, coarse, computed here or one's own, and keeps what the hand did", () => {
  for (const [alone, preview, status] of [[false, false, "exact"], [false, true, "preview"], [true, false, "here"], [true, true, "preview"]]) {
    const app = open({ alone });
    touch(app, { preview, mode: { frequency: 0.03 } });
    assert.deepEqual([app.status, app.records.A.hash, app.records.A.mode.frequency, app.root.dataset.hash], [status, "h", 0.03, "h"]);
    touch(app, { id: 2, mode: null });
    assert.equal(app.records.A.mode.frequency, 0.03); // the same antenna rings as it did
  }
  const app = open();
  app.handOn = true;
  app.time = 3;
  touch(app, { hand: true, commands: [[1, 0, 0.1, 0.2, 0]] });
  assert.deepEqual([app.time, app.handOn, app.records.A.commands], [7, false, [[1, 0, 0.1, 0.2, 0]]]); // what comes by hand is shown as it comes
});

test("a board's samples are shown as they come, with what was lost of them, at its own pace", () => {
  const app = open();
  app.hear({ ...BEGIN, id: 1, live: true, interval: 4 }, {});
  assert.equal(app.status, "busy"); // who does not listen hears nothing
  app.listening = "/dev/x";
  app.hear({ ...BEGIN, id: 2, live: true, interval: 4, robot: true }, {});
  assert.deepEqual([app.status, app.store.state.mode, app.store.state.A], ["live", "board", { preset: "robot" }]);
  app.hear({ type: "touch", slot: "A", id: 2, live: true, part: "piece", first: 0, missing: 5, damaged: 2, contact: -1 }, piece(0, 6));
  assert.deepEqual([app.time, app.records.A.missing, app.records.A.damaged], [20, 5, 2]);
});

test("a study is asked for once for each antenna, speed and doubt, and is stale for any other", () => {
  const app = open();
  app.store.change((s) => { s.B = { preset: "linear" }; s.touch.speed = 0.2; s.unsure = 0.1; });
  app.take();
  app.study();
  const [a, b] = app.take();
  assert.deepEqual([a, b].map(({ type, slot, antenna, speed, unsure }) => [type, slot, antenna, speed, unsure]), [["study", "A", { preset: "exponential" }, 0.2, 0.1], ["study", "B", { preset: "linear" }, 0.2, 0.1]]);
  app.study();
  assert.deepEqual(app.take(), []); // they are on their way
  app.hear({ type: "study", slot: "A", id: b.id, part: "end", labels: [] }, {});
  assert.equal(app.studies.A, null); // the other's
  app.hear({ type: "study", slot: "B", id: b.id, part: "doing", doing: "touching", share: 0.25 }, {});
  const panel = makeStudyPanel(app);
  panel.update();
  assert.deepEqual([panel.element.words, panel.isShown()], ["Thirty touches of this antenna: beginning …", true]);
  app.hear({ type: "study", slot: "B", id: b.id, part: "end", labels: [1] }, { bases: 2 });
  const [again] = app.take();
  assert.deepEqual([again.type, again.slot, again.wish.antenna, app.studying.B, app.studies.B.bases], ["touch", "B", { preset: "linear" }, null, 2]); // it is read now
  assert.deepEqual([app.isStale("B"), app.isStale("A")], [false, false]);
  for (const change of [(s) => { s.touch.speed = 0.3; }, (s) => { s.unsure = 0.02; }, (s) => { s.B.length = 30; }]) {
    app.store.change(change);
    assert.equal(app.isStale("B"), true);
    app.store.undo();
    assert.equal(app.isStale("B"), false);
  }
  app.store.change((s) => { s.touch.location = 0.9; });
  assert.equal(app.isStale("B"), false); // the thirty touches have places of their own
});

test("an antenna that is opened is the chosen one, a recording the first, and a second answer to it does not begin it anew", () => {
  const app = open(), toml = "schema = 1", header = { type: "opened", what: "antenna", antenna: { toml, name: "mine" }, original: { ...ANTENNA, length: 31 } };
  app.store.change((s) => { s.B = { preset: "linear" }; s.mode = "hand"; });
  app.take();
  app.slot = "B";
  app.hear(header, {});
  assert.deepEqual([app.store.state.B, app.store.state.A.preset, app.store.state.mode, app.findOriginal("B").length], [{ toml, name: "mine" }, "exponential", "touch", 31]);
  assert.equal(app.said(), "mine is antenna B now.");
  app.hear({ ...header, original: { ...header.original, planes: ["x", "z"] } }, {});
  assert.deepEqual([app.slot, app.store.state.A.toml, app.store.state.B, app.isSpatial()], ["A", toml, null, true]);
  app.store.change((s) => { s.A = { preset: "linear" }; });
  app.hear({ type: "opened", what: "calibration", name: "c.json", hinges: 8 }, {});
  assert.match(app.said(), /^c\.json: the calibration of 8 hinges;/);
  const recording = { type: "opened", what: "recording", name: "r.csv", antenna: ANTENNA, rims: [], total: 8, interval: 2.5, rate: 800, source: "robot", robot: false, contact: 3 };
  app.hear(recording, piece(0, 8));
  assert.deepEqual([app.status, app.playing, app.time, app.records.A.rate, app.records.A.reading], ["recorded", true, 0, 800, null]);
  assert.equal(app.said(), "r.csv: 2 channels, 8 samples, played back.");
  Object.assign(app, { time: 11, playing: false });
  app.hear(recording, { ...piece(0, 8), posterior: rows(8, 2, () => 0.5) });
  assert.deepEqual([app.time, app.playing, app.records.A.reading.noticed], [11, false, 7.5]); // sample 3
  assert.deepEqual([app.store.state.A, app.duration()], [{ preset: "linear" }, 20]);
});

test("the scale is the greatest bend of what is compared, in the quantity that is shown", () => {
  const app = open();
  touch(app, {}, 1);
  touch(app, { slot: "B" }, -2);
  near(app.findPeak(), 0.32, 1e-6); // the sensors are the first and third hinge
  app.store.state.B = { preset: "linear" };
  near(app.findPeak(), 0.64, 1e-6);
  app.quantity = "curvature";
  near(app.findPeak(), 0.32, 1e-6); // 0.64 over 2 mm
  const panel = makeTensorPanel(app), scale = () => { panel.update(); return panel.element.querySelector(".scale").words; };
  assert.equal(scale(), "± 0.32 /mm, colours by square root");
  app.quantity = "angle";
  assert.equal(scale(), "± 36.67°, colours by square root");
  touch(app, { slot: "B", id: 3 }, 0.5); // a smaller one after it
  app.quantity = "curvature";
  near(app.findPeak(), 0.16, 1e-6);
});

test("the frame of a scene in space is the nearest in time, and the view turns the way it is dragged, and not over the top", () => {
  const times = [0, 3, 7, 12];
  assert.deepEqual([-1, 0, 1, 1.6, 4.9, 5.1, 9.4, 9.6, 12, 50].map((now) => findFrame(times, now)), [0, 0, 0, 1, 1, 2, 2, 3, 3, 3]);
  const { element, eye } = makeTurnableScene({ records: { A: { scene: null } } }), before = { ...eye };
  element.tell("pointermove", { buttons: 1, movementX: 20, movementY: -10 });
  near(eye.turn, before.turn + 0.2);
  near(eye.rise, before.rise - 0.1);
  element.tell("pointermove", { buttons: 0, movementX: 20, movementY: 20 });
  near(eye.turn, before.turn + 0.2);
  for (const [key, turn, rise] of [["ArrowLeft", -0.1, 0], ["ArrowRight", 0.1, 0], ["ArrowUp", 0, -0.1], ["ArrowDown", 0, 0.1]]) {
    const now = { ...eye };
    element.tell("keydown", { key });
    near(eye.turn - now.turn, turn);
    near(eye.rise - now.rise, rise);
  }
  for (const way of [1, -1]) { element.tell("pointermove", { buttons: 1, movementX: 0, movementY: 1e5 * way }); assert.equal(eye.rise, 1.5 * way); }
});

/** The slider of a panel by its label. @param {any} panel @param {string} label */
function slide(panel, label, value, event = "change") {
  const input = panel.element.find((one) => one.named["aria-label"] === label);
  input.value = String(value);
  input.tell(event);
  return input;
}
/** Choose a button or a list by its words. */
const press = (panel, words) => panel.element.find((one) => one.tagName === "BUTTON" && ([one.words, one.named.title, one.named["aria-label"]].includes(words))).tell("click");

test("what a touch did is said of its contact alone: where it began, where it bent most of the time, how long it lasted", () => {
  const record = new TouchRecord(), bends = [[9, 0, 9], [5, 9, 1], [1, 9, 4], [1, 9, 6], [9, 9, 1], [1, 0, 8]];
  record.begin({ id: 1, antenna: ANTENNA, rims: [[]], total: 6, interval: 2.5 });
  record.add(0, { angle: rows(6, 3, (k, h) => -0.01 * bends[k][h]), base: rows(6, 3, () => 0), contact: { shape: [6], data: new Float32Array([NaN, 0.7, 0.6, 0.5, NaN, 0.4]) } });
  const { first, bent, time } = readTouch(record); // most: the third hinge, in three of four
  near(first, 0.7, 1e-6);
  near(bent, 7 / 9, 1e-6);
  assert.equal(time, 10);
  record.data.contact.fill(NaN);
  assert.equal(readTouch(record), null);
});

test("the plane of bending that is chosen is the one that is shown, whole, with its own peak", () => {
  const record = new TouchRecord(), bends = { shape: [4, 2, 3], data: new Float32Array(Array.from({ length: 24 }, (_, k) => 0.01 * (k + 1) * (k % 6 < 3 ? -1 : 2))) };
  record.begin({ id: 1, antenna: { ...ANTENNA, planes: ["x", "z"] }, rims: [], total: 4 });
  record.turn({ time: [0] }, bends);
  for (const plane of [1, 0]) {
    record.choose(plane);
    const at = (k, hinge) => bends.data[(k * 2 + plane) * 3 + hinge];
    for (let k = 0; k < 4; k++) [0, 2].forEach((hinge, sensor) => near(record.angle(sensor, k), at(k, hinge), 1e-6));
    near(record.peak, Math.abs(at(3, 2)), 1e-6);
  }
  assert.equal(record.plane, 0);
});

const given = JSON.parse(readFileSync(new URL("./given.json", import.meta.url)));

/** All that a page's own engine says of a message. @param {any} host @param {any} message */
async function ask(host, said, message) {
  host.take(message);
  while (host.work(50) >= 0);
  await new Promise(setImmediate);
  await new Promise(setImmediate);
  return said.splice(0);
}
