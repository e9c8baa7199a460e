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
const { findFrame, makeTurnableScene } = await import("./turnable.js"), { makeAntennaPanel, makeTouchPanel, makeWallPanel } = await import("./controls.js"), { makeTags } = await import("./tags.js");
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
  app.store.change((s) => { s.mode = "wall"; s.wall = { turn: -25, speed: 0.35 }; }, false);
  assert.deepEqual(app.take(), []); // while the slider is held nothing runs
  app.store.change((s) => { s.A = { preset: "linear" }; });
  assert.deepEqual(app.take(), [{ id: 1, type: "follow", slot: "A", antenna: { preset: "linear" }, turn: -25, speed: 0.35 }]);
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

test("an error ends what it is of and no more, and is said", () => {
  for (const [of, gone] of [["study", "studying"], ["hand", "handOn"], ["listen", "listening"], ["save", "saving"]]) {
    const app = open(), before = { studying: { A: { id: 1 }, B: { id: 2 } }, handOn: true, listening: "x", saving: true };
    Object.assign(app, structuredClone(before), { status: "exact" });
    app.hear({ type: "error", of, slot: "B", message: `no ${of}` }, {});
    const now = Object.fromEntries(Object.keys(before).map((name) => [name, app[name]])), wanted = { ...before, [gone]: { listening: "", studying: { A: { id: 1 }, B: null } }[gone] ?? false };
    assert.deepEqual(now, wanted);
    assert.deepEqual([app.said(), app.status], [`no ${of}`, ["hand", "listen"].includes(of) ? "error" : "exact"]);
  }
});

test("an antenna that is opened is the chosen one, a recording the first, and a second answer to it does not begin it anew", () => {
  const app = open(), toml = "schema = 1", header = { type: "opened", what: "antenna", antenna: { toml, name: "mine" }, original: { ...ANTENNA, length: 31 } };
  app.store.change((s) => { s.B = { preset: "linear" }; s.mode = "wall"; });
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

test("what is added, resized and taken away is that object, on the side that the first comes from", () => {
  for (const [side, sign] of [["left", 1], ["right", -1]]) {
    const app = open();
    app.store.change((s) => { s.touch.side = side; });
    touch(app);
    for (let k = 0; k < 3; k++) app.addObject();
    const { touch: now } = app.store.state;
    assert.deepEqual(now.objects.map(({ x, y, heading }) => [x, y, heading]), [0.4, 0.52, 0.64].map((share) => [4 * sign, Number((9 * share).toFixed(2)), -90 * sign]));
    assert.equal(app.selected, 3);
    app.resize(2, 1.5, true);
    app.resize(0, 3, true);
    assert.deepEqual([now.size, ...now.objects.map(({ size }) => size)], [4.5, 1.5, 2.25, 1.5]);
    app.resize(1, 0.01, true);
    app.resize(3, 100, true);
    assert.deepEqual(now.objects.map(({ size }) => size), [0.2, 2.25, 10]);
    app.removeObject(1);
    assert.deepEqual([now.objects.map(({ size }) => size), app.selected], [[0.2, 10], -1]);
  }
});

test("time lasts as long as the touch, the run along the wall or what the hand did, stops before its end and begins anew there", () => {
  const app = open();
  assert.equal(app.duration(), 380);
  touch(app, { interval: 4 });
  app.seek(1e9);
  assert.deepEqual([app.duration(), app.time], [32, 31]);
  app.seek(-3);
  assert.equal(app.time, 0);
  app.seek(29);
  app.play(true);
  assert.equal(app.time, 29);
  app.seek(30.5);
  app.play(true);
  assert.equal(app.time, 0);
  Object.assign(app, { time: 5, rate: 0.3, last: 1000, views: { update() {} } });
  app.frame(1020);
  near(app.time, 11); // 20 ms at 0.3
  app.frame(9999);
  assert.equal(app.time, 0); // of a long pause 100 ms, which is beyond the end
  touch(app, { id: 2, hand: true });
  assert.equal(app.duration(), 100);
  app.store.state.mode = "wall";
  assert.equal(app.duration(), 400);
  Object.assign(app.walls.A, { end: {}, n: 731 });
  assert.equal(app.duration(), 731);
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
  assert.equal(scale(), "± 0.32 /mm");
  app.quantity = "angle";
  assert.equal(scale(), "± 36.67°");
  touch(app, { slot: "B", id: 3 }, 0.5); // a smaller one after it
  app.quantity = "curvature";
  near(app.findPeak(), 0.16, 1e-6);
});

test("keys undo, redo, play and step where nothing is typed", () => {
  const app = open(), key = (name, more = {}) => app.root.tell("keydown", { key: name, ...more });
  touch(app, { interval: 4 });
  app.store.change((s) => { s.touch.speed = 0.5; });
  key("z", { ctrlKey: true });
  assert.equal(app.store.state.touch.speed, 0.06);
  key("Z", { metaKey: true, shiftKey: true });
  assert.equal(app.store.state.touch.speed, 0.5);
  key("z", { ctrlKey: true });
  key("y", { ctrlKey: true });
  assert.equal(app.store.state.touch.speed, 0.5);
  app.seek(7);
  key(".");
  key(".");
  key(",");
  assert.equal(app.time, 8);
  key(" ");
  assert.equal(app.playing, true);
  key(" ", { target: new Element("button") }); // the button's own
  key(".", { target: new Element("input") });
  key(".", { altKey: true });
  assert.deepEqual([app.playing, app.time], [true, 8]);
});

test("the first scene is the address's, else the catalogue's, and asks for its own mode", async () => {
  for (const [mode, asked] of [["touch", "touch"], ["wall", "follow"], ["board", "ports"]]) {
    const app = open(), state = { ...makeState({ preset: "linear" }), mode };
    app.hear({ type: "catalogue", presets: app.catalogue.presets, first: { preset: "exponential" }, state }, {});
    await Promise.resolve();
    await new Promise(setImmediate);
    assert.deepEqual([app.store.state.A, app.take()[0].type], [{ preset: "linear" }, asked]);
    app.store.undo();
    assert.equal(app.store.state.mode, mode); // nothing was before it
  }
});

test("a status is a word of its own, and one that is away or full says so whatever was before", () => {
  const app = open(), status = makeStatus(app), words = ["busy", "exact", "preview", "recorded", "here", "live", "hand", "error"].map((one) => { app.status = one; status.update(); return `${status.element.textContent} ${status.element.title}`; });
  assert.equal(new Set(words).size, 8);
  for (const away of ["away", "full"]) { app.away = away; status.update(); assert.equal(status.element.dataset.is, away); }
});

test("messages wait for a connection that is being made, none for one that was lost, and a full server is told from one that is away", () => {
  const made = [], told = [], heard = [];
  Object.assign(globalThis, { location: { href: "http://127.0.0.1:9/token/?x#s=1" }, WebSocket: class { constructor(address) { Object.assign(this, { address: String(address), sent: [], readyState: 0 }); made.push(this); } send(text) { this.sent.push(text); } close() { this.readyState = 3; } } });
  timers = [];
  const link = linkServer((...given) => heard.push(given), (now) => told.push(now));
  assert.equal(made[0].address, "ws://127.0.0.1:9/token/live");
  link.send({ id: 1 });
  link.send({ id: 2 });
  made[0].readyState = 1;
  made[0].onopen();
  link.send({ id: 3 });
  assert.deepEqual(made[0].sent, ['{"id":1}', '{"id":2}', '{"id":3}']);
  for (const [code, word] of [[1013, "full"], [1006, "off"]]) {
    const last = made.at(-1);
    last.readyState = 3;
    link.send({ id: 4 });
    last.onclose({ code });
    assert.equal(told.at(-1), word);
    timers.pop().next();
    link.send({ id: 5 }); // to one that never answers
    made.at(-1).onclose({ code });
    timers.pop().next();
    made.at(-1).readyState = 1;
    made.at(-1).onopen();
    assert.deepEqual(made.at(-1).sent, []);
  }
  link.close();
  made.at(-1).onclose({ code: 1000 });
  assert.deepEqual([told, timers.length], [["on", "full", "full", "on", "off", "off", "on"], 0]); // who closes it does not come back
});

test("of a notebook's message the bytes are those of its own part of the buffer", () => {
  const heard = [], kept = {}, text = '{"type":"x","arrays":[["a",[2]]]}  '.padEnd(36), bytes = new Uint8Array(5 + 4 + 36 + 8);
  new DataView(bytes.buffer).setUint32(5, 36, true);
  bytes.set(new TextEncoder().encode(text), 9);
  new DataView(bytes.buffer).setFloat32(45, 1.5, true);
  new DataView(bytes.buffer).setFloat32(49, -2, true);
  const model = { on: (name, take) => { kept[name] = take; }, off: (name, take) => { if (kept[name] === take) delete kept[name]; }, send: (message) => heard.push(message) };
  const link = linkModel(model, (...given) => heard.push(given), () => {});
  kept["msg:custom"]({}, [new DataView(bytes.buffer, 5)]);
  const [header, arrays] = heard.pop();
  assert.deepEqual([header.type, [...arrays.a.data]], ["x", [1.5, -2]]);
  link.send({ type: "stop" });
  link.close();
  assert.deepEqual([heard, kept], [[{ type: "stop" }], {}]);
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

test("the gradient's slider tilts stiffness about its middle, keeps what is bent, and every other slider sets its own number of the chosen antenna", () => {
  const app = open(), handles = { stiffness: [[0, 40], [0.25, 30], [1, 0.4]], damping: [[0, 5], [1, 1]] };
  app.catalogue.presets.exponential = { ...ANTENNA, handles, compliance: 1 };
  app.catalogue.presets.linear = { ...ANTENNA, handles, length: 20 };
  app.store.state.B = { preset: "linear" };
  const panel = makeAntennaPanel(app);
  app.slot = "B";
  for (const decades of [1, 3, 0]) {
    app.store.state.B = { preset: "linear" };
    slide(panel, "Stiffness gradient", decades);
    const { stiffness, matched } = app.store.state.B, logs = stiffness.map(([, k]) => Math.log10(k)), middle = Math.log10(Math.sqrt(40 * 0.4));
    near(logs[0] - logs[2], decades, 1e-3);
    near((logs[0] + logs[2]) / 2, middle, 1e-3);
    near(logs[1] - (middle + 0.25 * decades), (Math.log10(30) - (middle + 0.25 * 2)) * (decades / 2), 1e-3); // the bend shrinks with the tilt
    assert.deepEqual([matched, app.store.state.A], [true, { preset: "exponential" }]);
  }
  slide(panel, "Length", Math.log10(31));
  slide(panel, "Sensors", 12);
  near(app.store.state.B.length, 31);
  assert.equal(app.store.state.B.sensors, 12);
  press(panel, "swap");
  assert.deepEqual([app.store.state.A.length, app.store.state.B], [31, { preset: "exponential" }]);
  press(panel, "leave B out");
  assert.deepEqual([app.store.state.B, app.slot], [null, "A"]);
  press(panel, "as it was");
  assert.deepEqual(app.store.state.A, { preset: "linear" });
  press(panel, "B");
  assert.deepEqual([app.store.state.B, app.slot], [{ preset: "exponential" }, "B"]);
  assert.equal(panel.element.find((one) => one.className === "unit").words, "");
});

test("a panel's facts are its antenna's, in the unit of what the handles change", () => {
  const app = open();
  app.catalogue.presets.exponential = { ...ANTENNA, handles: { stiffness: [[0, 30], [1, 2]], damping: [[0, 6], [1, 1]] } };
  const panel = makeAntennaPanel(app), facts = () => { panel.update(); return panel.element.find((one) => one.className === "facts").children.map((one) => one.words); };
  app.records.A.mode = { frequency: 0.0123, damping_ratio: 0.456 };
  assert.deepEqual(facts(), ["stiffest", "30 N·mm/rad", "softest", "2 N·mm/rad", "compliance Σ 1/k", "0.633 rad/(N·mm)", "first mode, damped", "12.3 Hz", "damping ratio", "0.456"]);
  app.records.A.mode = { frequency: null, damping_ratio: 1.3 };
  assert.equal(facts()[7], "does not swing");
  const unit = panel.element.find((one) => one.className === "unit");
  assert.equal(unit.words, "N·mm/rad");
  app.editing = "damping";
  facts();
  assert.equal(unit.words, "N·mm·ms/rad");
});

test("every slider and switch of a touch and of a wall sets what its label says", () => {
  const app = open(), panel = makeTouchPanel(app), wall = makeWallPanel(app);
  const wanted = { size: ["Half-width", Math.log10(2.3), 2.3], location: ["Place", 0.83], speed: ["Speed", Math.log10(0.29), 0.29], approach: ["Approach", 71], friction: ["Friction", 0.35], duration: ["Recorded time", 540], azimuth: ["Azimuth", -35] };
  for (const [name, [label, value, set = value]] of Object.entries(wanted)) {
    const before = structuredClone(app.store.state.touch);
    slide(panel, label, value);
    assert.deepEqual(app.store.state.touch, { ...before, [name]: set });
  }
  press(panel, "box");
  press(panel, "from the right");
  assert.deepEqual([app.store.state.touch.kind, app.store.state.touch.side], ["box", "right"]);
  slide(wall, "Turn of the wall", -40);
  slide(wall, "Running speed", 0.65);
  assert.deepEqual(app.store.state.wall, { turn: -40, speed: 0.65 });
  app.addObject();
  app.addObject();
  panel.update();
  app.store.state.touch.objects.forEach((one) => { one.heading = 175; });
  press(panel, "Turn object 3 by 15 degrees");
  assert.deepEqual(app.store.state.touch.objects.map((one) => one.heading), [175, -170]);
  press(panel, "Take object 2 away");
  assert.deepEqual(app.store.state.touch.objects.map((one) => one.heading), [-170]);
});

test("a number's source is said with its value, its unit and what its letters mean", () => {
  const app = open();
  app.catalogue = { tags: { P: "paper", C: "choice" }, facts: { modulus: { value: 1234.56, unit: "MPa", tag: "P+C", note: "see there" }, share: { value: 0.25, unit: "1", tag: "C", note: "" }, both: { value: [1, 2], unit: "mm", tag: "P", note: "" } } };
  const tip = makeTags(app), say = (tag) => { const target = new Element(); target.closest = () => target; target.dataset.tag = tag; target.getBoundingClientRect = app.root.getBoundingClientRect = () => ({ left: 0, top: 0, bottom: 0, width: 900 }); app.root.tell("pointerover", { target }); return tip.hidden ? null : tip.words; };
  assert.deepEqual(["modulus", "share", "both", "nothing"].map(say), ["[P+C]| modulus 1235 MPa: paper; choice. see there", "[C]| share 0.25 : choice", "[P]| both  mm: paper", null]);
  assert.match(say("friction"), /^\[D\]\| 1\.0 fits/);
  app.root.tell("focusout");
  assert.equal(tip.hidden, true);
});

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

test("each step of a tour shows its own scene, counts itself, and the last one ends it", () => {
  const steps = [{ title: "one", words: "first", look: ".x", state: { A: { preset: "linear" } } }, { title: "two", words: "second", look: ".x", asks: "speed", state: { mode: "hand", unsure: 0.1, A: { preset: "exponential" } } }];
  const app = open({ steps }), tour = makeTour(app), say = () => tour.element.words, speed = tour.element.find((one) => one.named["aria-label"] === "Speed");
  assert.equal(tour.element.hidden, true);
  tour.start();
  assert.match(say(), /^one\|first\|.*1 of 2/);
  assert.deepEqual([app.store.state.A.preset, app.store.state.unsure, speed.hidden, app.playing], ["linear", 0.02, true, true]);
  press(tour, "Next");
  assert.match(say(), /^two\|second\|.*2 of 2.*Done$/);
  assert.deepEqual([app.store.state.A.preset, app.store.state.mode, app.store.state.unsure, speed.hidden, app.playing], ["exponential", "hand", 0.1, false, false]);
  app.store.state.A.preset = "space"; // what a visitor changes is not the tour's
  press(tour, "Back");
  assert.deepEqual([app.store.state.mode, app.store.state.unsure], ["touch", 0.02]);
  press(tour, "Next");
  assert.equal(app.store.state.A.preset, "exponential");
  press(tour, "Done");
  assert.equal(tour.element.hidden, true);
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

test("a page's own engine answers as feeler does: a touch in pieces that fit, of the wish's antenna, objects and side", async () => {
  const { config, touches } = given.host, said = [], host = new Host(config, (header, arrays) => said.push([header, arrays]));
  for (const [id, { wish, angle, place, force }] of touches.entries()) {
    const own = config.antennas.find((one) => JSON.stringify(one.wish) === JSON.stringify(wish.antenna));
    const heard = await ask(host, said, { type: "touch", slot: id ? "B" : "A", id, wish }), [begin] = heard[0], pieces = heard.filter(([one]) => one.part === "piece");
    assert.deepEqual([begin.part, begin.total, begin.slot, begin.id, begin.rims.length, begin.antenna.name], ["begin", angle.length, id ? "B" : "A", id, 1 + wish.objects.length, own.drawn.name]);
    let done = 0;
    for (const [{ first }, arrays] of pieces) { assert.equal(first, done); done += arrays.angle.shape[0]; }
    assert.ok(pieces.length > 1 && heard.at(-1)[0].part === "end" && heard.at(-1)[0].preview === wish.preview);
    for (const [name, rows] of Object.entries({ angle, place, force })) {
      const all = pieces.flatMap(([, arrays]) => [...arrays[name].data]);
      rows.flat(Infinity).forEach((value, k) => near(all[k], value, 2e-7));
    }
  }
  const [[unknown]] = await ask(host, said, { type: "touch", slot: "A", id: 9, wish: { ...touches[0].wish, antenna: { preset: "no" } } });
  assert.deepEqual([unknown.type, unknown.of, unknown.id, unknown.message], ["error", "touch", 9, "This page has no such antenna."]);
  const [[study]] = await ask(host, said, { type: "study", slot: "B", id: 4, antenna: config.antennas[0].wish, speed: 0.111 });
  assert.deepEqual([study.type, study.of, study.slot, study.id], ["error", "study", "B", 4]);
  assert.match(study.message, /^No verdict here/);
  const [[hello]] = await ask(host, said, { type: "hello" });
  assert.deepEqual([hello.type, hello.first, hello.state], ["catalogue", config.state.A, config.state]);
});

test("a run by hand that a page was saved with is the first thing that it shows, as it was, and no second time", async () => {
  const { config, touches, run } = given.host, said = [], host = new Host({ ...config, commands: run.commands, samples: run.samples }, (header, arrays) => said.push([header, arrays]));
  const { wish } = touches[0], heard = await ask(host, said, { type: "touch", slot: "A", id: 1, wish }), all = (name) => heard.filter(([one]) => one.part === "piece").flatMap(([, arrays]) => [...arrays[name].data]);
  assert.deepEqual([heard[0][0].hand, heard[0][0].total], [true, run.samples]);
  for (const name of ["angle", "base", "place"]) { const found = all(name); run[name].flat(Infinity).forEach((value, k) => near(found[k], value, 2e-7)); }
  const [[begin]] = await ask(host, said, { type: "touch", slot: "A", id: 2, wish });
  assert.deepEqual([begin.hand, begin.total], [undefined, touches[0].angle.length]);
});

test("by hand everything goes where the hand is, no faster than it may, at the pace that was asked for", async () => {
  const { config, touches } = given.host, [{ wish }] = touches;
  for (const [pace, aims] of [[0.5, { "-1": [3, 2, -0.4], 0: [9, 20, 0] }], [0.2, { "-1": [-2, 1, 0.3] }]]) {
    const said = [], host = new Host(config, (header, arrays) => said.push([header, arrays])), real = performance.now;
    let now = 0;
    performance.now = () => now;
    host.take({ type: "hand", slot: "A", id: 5, wish, pace });
    for (const [what, [x, y, turn]] of Object.entries(aims)) host.take({ type: "aim", what: Number(what), x, y, turn });
    let early = 0;
    while (now < 2500) {
      const wait = host.work(0);
      if (now <= 100) early = said.filter(([one]) => one.part === "piece").reduce((sum, [, { angle }]) => sum + angle.shape[0], 0);
      now += Math.max(wait, 1);
    }
    host.take({ type: "aim", what: "end" });
    host.work(0);
    performance.now = real;
    const rows = (name, wide) => { const flat = said.filter(([one]) => one.part === "piece").flatMap(([, arrays]) => [...arrays[name].data]); return Array.from({ length: flat.length / wide }, (_, k) => flat.slice(k * wide, (k + 1) * wide)); };
    const base = rows("base", 3), place = rows("place", 9);
    assert.ok(Math.abs(early - 1 - pace * 100) <= 20 * pace + 1, `${early} samples at ${pace}`); // then all stands still, and time too
    assert.ok(base.length < pace * 2500);
    assert.deepEqual([said[0][0].hand, said[0][0].id, said.at(-1)[0].part], [true, 5, "end"]);
    aims["-1"].forEach((value, k) => near(base.at(-1)[k], value, 0.02));
    if (aims[0]) aims[0].slice(0, 2).forEach((value, k) => near(place.at(-1)[k], value, 0.02));
    const steps = (all, k) => all.slice(1).map((row, n) => row[k] - all[n][k]), most = (...ways) => Math.max(...ways[0].map((_, n) => Math.hypot(...ways.map((way) => way[n]))));
    assert.ok(most(steps(base, 0), steps(base, 1)) < 1.2001 && most(steps(base, 2)) < 0.03001);
    assert.deepEqual([3, 4, 6, 7].map((k) => place.at(-1)[k]), [3, 4, 6, 7].map((k) => place[0][k])); // what nobody moves stands still
  }
});

test("a new run by hand begins where the antenna stands and follows nothing that was asked of the run before", async () => {
  const { config, touches } = given.host, [{ wish }] = touches, said = [], host = new Host(config, (header, arrays) => said.push([header, arrays])), real = performance.now;
  let now = 0;
  performance.now = () => now;
  const run = (id, until) => { host.take({ type: "hand", slot: "A", id, wish, pace: 0.5 }); if (id === 5) host.take({ type: "aim", what: -1, x: 3, y: 2, turn: -0.4 }); while (now < until) now += Math.max(host.work(0), 1); };
  run(5, 400);
  run(6, 800);
  performance.now = real;
  const bases = (id) => said.filter(([one]) => one.part === "piece" && one.id === id).flatMap(([, arrays]) => [...arrays.base.data]);
  const [first, second] = [bases(5), bases(6)];
  assert.ok(second.length >= 3 && Math.abs(first.at(-3) - first[0]) > 0.5);
  for (let k = 0; k < second.length; k++) assert.equal(second[k], second[k % 3]);
});

test("the pace of the hand is that of the clock", () => {
  const app = open(), panel = makeStagePanel(app), rate = panel.element.find((one) => one.named["aria-label"] === "Slow motion");
  for (const value of [0.3, 1, 0.01]) {
    rate.value = String(value);
    rate.tell("change");
    assert.deepEqual([app.rate, app.handPace], [value, value]);
  }
});

test("what leaves the page is what it shows: quantity, doubt, the other antenna or the hand's own run, and a recording's own clock", async () => {
  const app = open(), share = makeShare(app), files = [], { createObjectURL } = URL;
  Object.assign(URL, { createObjectURL: (blob) => { files.push(blob); return "blob:"; }, revokeObjectURL() {} });
  Element.prototype.click = Element.prototype.remove = () => {};
  app.store.change((s) => { s.B = { preset: "linear" }; s.unsure = 0.1; });
  touch(app, { interval: 2.5 });
  app.quantity = "curvature";
  app.take();
  await share.save("svg");
  const [{ type, what, quantity, unsure, wish, other, commands }] = app.take();
  assert.deepEqual([type, what, quantity, unsure, wish.antenna.preset, wish.preview, other.antenna.preset, commands, app.saving], ["save", "svg", "curvature", 0.1, "exponential", false, "linear", undefined, true]);
  await share.save("csv");
  const lines = (await files.pop().text()).trim().split("\n");
  assert.deepEqual(lines.slice(0, 2), ["# source: simulation", "time_ms,hinge1_rad,hinge2_rad"]);
  lines.slice(2).forEach((line, k) => line.split(",").forEach((value, c) => near(Number(value), [2.5 * k, 0.01 * (k + 1), 0.04 * (k + 1)][c], 1e-6)));
  assert.equal(lines.length, 10);
  app.hear({ ...BEGIN, id: 2, hand: true, total: 4000 }, {});
  app.hear({ type: "touch", slot: "A", id: 2, part: "piece", first: 0 }, piece(0, 6));
  app.hear({ type: "touch", slot: "A", id: 2, part: "end", hand: true, commands: [[1, 0, 0, 0, 0]] }, {});
  await share.save("mp4");
  const [hand] = app.take();
  assert.deepEqual([hand.commands, hand.samples, hand.other], [[[1, 0, 0, 0, 0]], 6, null]);
  app.store.change((s) => { s.mode = "board"; });
  Object.assign(app.records.A, { source: "surrogate" });
  app.take();
  await share.save("csv");
  assert.match(await files.pop().text(), /^# source: surrogate\n/);
  await share.save("png");
  assert.match(app.said(), /^What a real antenna felt/);
  app.store.change((s) => { s.mode = "touch"; });
  for (const [away, words] of [["full", /^Too many pages/], ["away", /^The server is away/]]) { app.take(); app.away = away; await share.save("png"); assert.match(app.said(), words); assert.deepEqual(app.take(), []); }
  Object.assign(URL, { createObjectURL });
});

test("a standalone page switches to its own antennas and speeds, and says what it shows and what it was taught", () => {
  const { antennas } = given.host.config, speeds = [{ name: "slow", value: 0.06 }, { name: "0.2 m/s", value: 0.2 }, { name: "fast", value: 0.6 }], posted = [];
  const trained = { n: 96, clean: 0.99, confidently_wrong: 0 }, range = { location: [0.45, 0.95], size: [1.2, 3.5], speed: [0.06, 0.06], approach: 90, friction: 1 };
  const kept = (...noisy) => noisy.map((one, k) => one && { peak: 0.1 * (k + 1), curvature: 0.3, range, scores: { ...trained, noisy: one } }), state = { ...makeState(antennas[0].wish), unsure: 0.1 };
  const config = { ...given.host.config, antennas, speeds, state, taught: { noise: 0.03, answers: ["ball", "box", "triangle", "outside"], kept: [kept(0.21, 0.22, 0.23), kept(0.11, null, 0.13)] }, paper: "a paper", doi: "https://doi.org/x" };
  Object.assign(document, { getElementById: (id) => ({ textContent: id === "config" ? JSON.stringify(config) : "" }), head: new Element() });
  globalThis.Worker = class { postMessage(message) { posted.push(message); } };
  frames = [];
  const app = startAlone(new Element());
  app.hear({ type: "catalogue", presets: {}, first: antennas[0].wish, state }, {});
  app.store.state = structuredClone(state);
  const draw = () => app.views.update(true), find = (name) => app.root.find((one) => one.className && one.className.split(" ").includes(name));
  Object.assign(app, { time: 0 });
  for (const panel of ["stage-panel", "tensor-panel", "verdict-panel"]) for (const canvas of [find(panel)]) canvas.find((one) => { if (one.tagName === "CANVAS") one.clientWidth = 0; return false; });
  press({ element: app.root }, "second");
  press({ element: app.root }, "0.2 m/s");
  press({ element: app.root }, "triangle");
  const { A, touch: now } = app.store.state;
  assert.deepEqual([A, now.speed, now.kind], [antennas[1].wish, 0.2, "triangle"]);
  app.colours = {};
  draw();
  const table = find("tally").children.map((row) => row.children.map((cell) => cell.words));
  assert.deepEqual(table, [["", "slow", "0.2 m/s", "fast"], ["first", "21 %", "22 %", "23 %"], ["second", "11 %", "–", "13 %"]]);
  const marked = find("tally").children.slice(1).map((row) => row.children.map((cell) => cell.className === "now"));
  assert.deepEqual(marked, [[false, false, false, false], [false, false, true, false]]);
  assert.match(find("tally-panel").words, /45 to 95 % of the length.*1.2 to 3.5 mm.*within 10 %, with white noise of 1.72°/);
  near(app.findPeak(), 0.3); // one scale for both antennas
  const { drawn } = antennas[1], about = find("about-panel").words;
  assert.ok(about.includes(`Antenna: ${drawn.name}, 30 mm, ${drawn.segments.length} hinges, 7 sensors, stiffness `), about);
  assert.match(about, /Object: triangle of half-width 1.5 mm, at 0.7 of the length, 0.2 m\/s\./);
  press({ element: app.root }, "by hand");
  assert.equal(app.store.state.mode, "hand");
});
