// @ts-check
import { readColours } from "./colours.js";
import { announce, make, makeChoice, show, write } from "./dom.js";
import { linkModel, linkServer } from "./link.js";
import { PANELS } from "./panels.js";
import { TouchRecord } from "./record.js";
import { keepFile, makeShare } from "./share.js";
import { Store, decodeState, leavePlane, makeState, makeWish } from "./state.js";
import { makeTags } from "./tags.js";
import { STEPS, makeTour } from "./tour.js";
/** The studio: one front end for a local server, a notebook and an exported page. */

const STUDY_AFTER = 900; // ms of rest after which an antenna is studied
/** @type {[string, string][]} */
const MODES = [["touch", "Touch"], ["hand", "By hand"], ["board", "Own antenna"]];

/**
 * What a page is made of: its panels, header and tour, how soon an antenna is studied [ms], and whether it computes by itself.
 * A `scale` is what the colours span, whatever is touched.
 * @typedef {{alone: boolean, scale?: any, rest: number, panels: ((app: App) => any)[], header: (app: App) => any, steps: any[]}} Plan
 */

export class App {
  /** @param {HTMLElement} root @param {Plan} [plan] */
  constructor(root, plan = STUDIO) {
    this.root = root;
    this.plan = plan;
    /** @type {any} */
    this.catalogue = null;
    this.store = new Store(makeState({ preset: "exponential" }), (done) => this.changed(done));
    /** @type {Object<string, TouchRecord>} */
    this.records = { A: new TouchRecord(), B: new TouchRecord() };
    /** @type {any} */
    this.studies = { A: null, B: null };
    /** @type {any} */
    this.studying = { A: null, B: null };
    /** @type {any} */
    this.originals = {};
    /** @type {any} */
    this.drawn = {};
    this.slot = "A";
    this.editing = "stiffness";
    this.quantity = "angle";
    this.showContact = true;
    this.hidden = false; // what touches is not shown, in a blind round
    /** Of the living figure. @type {(header: any, arrays: any) => void} */
    this.takeFamily = () => {};
    this.view = { scale: 1, ox: 0, oy: 0 }; // px/mm, and where the base's rest is in the scene
    this.hover = null;
    this.selected = -1;
    this.hinted = false;
    this.handOn = false;
    this.handPace = 0.1;
    this.listening = "";
    this.saving = false;
    this.calibrated = false;
    /** @type {Object<string, string>} */
    this.ports = {};
    /** A recording that was opened. @type {any} */
    this.opened = null;
    this.heardWith = "";
    this.time = 0;
    this.rate = 0.1;
    this.playing = false;
    this.waiting = "waiting for the engine …";
    this.id = 0;
    this.studyTimer = 0;
    this.pending = 0;
    this.last = 0;
    this.wants = { draw: false, panels: false };
    /** @type {any} */
    this.link = { send: () => {}, close: () => {} };
    /** What benchmarks/studio.py reads. @type {{asked: number, first: number, whole?: number, read?: number}[]} */
    this.latency = [];
    this.asked = 0;
    this.inPage = false;
    this.restored = false;
    this.away = ""; // or why nothing comes: the server is "away", or "full"
    this.status = "busy";
    this.frames = 0;
    /** @type {any} */
    this.nextAim = null;
    /** @type {any} */
    this.views = null;
    root.classList.add("feeler-studio");
    this.colours = readColours(root);
    build(this);
  }

  /** @param {any} message */
  send(message) { this.link.send({ id: ++this.id, ...message }); }

  // what changes what is shown

  /** @param {boolean} done */
  changed(done) {
    if (!this.store.state.B) this.slot = "A";
    this.refresh();
    if (!this.catalogue) return;
    const { mode } = this.store.state;
    if (mode !== "hand" && this.handOn) this.endHand();
    if (mode !== "board" && this.listening) this.listen("");
    if (mode === "board" && done) this.askBoard();
    if (mode === "touch" || (mode === "hand" && done)) this.ask(!done && mode === "touch");
  }

  /** Ask for both touches; while something is dragged coarse steps will do. @param {boolean} preview */
  ask(preview) {
    if (this.handOn) this.endHand();
    const { state } = this.store;
    this.asked = performance.now();
    for (const slot of /** @type {("A"|"B")[]} */ (["A", "B"])) {
      if (!state[slot]) continue;
      this.records[slot].waits = Boolean(state.B); // two antennae are compared once both are new
      this.send({ type: "touch", slot, wish: makeWish(state, slot, preview) });
    }
    this.setStatus("busy");
    clearTimeout(this.studyTimer);
    if (!preview) this.studySoon();
  }

  studySoon() {
    clearTimeout(this.studyTimer);
    if (this.plan.rest < Infinity && !this.isSpatial()) this.studyTimer = window.setTimeout(() => this.study(), this.plan.rest);
  }

  // an antenna of one's own

  /** Listen to a board; no port ends it. @param {string} port */
  listen(port) {
    const { state } = this.store;
    this.opened = port ? null : this.opened;
    if (this.listening && !port && this.status === "live") this.setStatus("recorded");
    else if (port) this.setStatus("busy");
    this.listening = port;
    this.heardWith = keyStudy(state, "A");
    this.send({ type: "listen", slot: "A", port, antenna: state.A, speed: state.touch.speed });
    this.refresh();
  }

  /** Hear the recording, or the board, as the antenna and speed that are set now. */
  askBoard() {
    const { state } = this.store;
    if (state.B) { state.B = null; this.slot = "A"; }
    this.send({ type: "ports" });
    this.studySoon();
    if (this.heardWith === keyStudy(state, "A")) return;
    if (this.listening) this.listen(this.listening);
    else if (this.opened) this.open(this.opened);
  }

  /** @param {{name: string, text: string}} file */
  open(file) {
    const { state } = this.store;
    this.heardWith = keyStudy(state, "A");
    this.send({ type: "open", slot: this.slot, ...file, antenna: state.A, speed: state.touch.speed });
  }

  /** What was heard is of this antenna: that of the page, or the robot. @param {boolean} robot */
  own(robot) {
    const { state } = this.store, next = { ...state, mode: "board", B: null, A: robot ? { preset: "robot" } : state.A };
    this.heardWith = keyStudy(next, "A");
    this.slot = "A";
    if (robot || state.mode !== "board") this.store.change((s) => Object.assign(s, next));
  }

  /** Let each antenna be studied at the present speed, where it was not. */
  study() {
    const { state } = this.store;
    if (this.isSpatial()) return;
    if (state.mode !== "touch" && !(state.mode === "board" && (this.listening || this.opened))) return;
    for (const slot of ["A", "B"]) {
      if (!state[slot]) continue;
      const key = keyStudy(state, slot);
      if (this.studies[slot] && this.studies[slot].key === key && (this.studies[slot].labels || this.plan.alone)) continue;
      if (this.studying[slot] && this.studying[slot].key === key) continue;
      this.studying[slot] = { key, id: this.id + 1, doing: "beginning", share: 0 };
      this.send({ type: "study", slot, antenna: state[slot], speed: state.touch.speed, unsure: state.unsure });
    }
    this.refresh();
  }

  /** What the server says. @param {any} header @param {any} arrays */
  hear(header, arrays) {
    const { state } = this.store;
    if (header.type === "catalogue") {
      this.catalogue = header;
      this.greeted();
    } else if (header.type === "touch") this.hearTouch(header, arrays);
    else if (header.type === "reading") this.hearReading(header, arrays);
    else if (header.type === "study") this.hearStudy(header, arrays);
    else if (header.type === "file") {
      this.saving = false;
      keepFile(header.name, header.mime, new Uint8Array(arrays.content.data.buffer, arrays.content.data.byteOffset, header.bytes));
      this.say(`${header.name}: ${write(header.bytes / 1000, 3)} kB`);
    } else if (header.type === "opened") this.hearOpened(header, arrays);
    else if (header.type === "family") this.takeFamily(header, arrays);
    else if (header.type === "ports") Object.assign(this, { ports: header.ports, calibrated: header.calibrated });
    else if (header.type === "error") this.hearError(header);
    if (state) this.refresh();
  }

  /** @param {any} header @param {any} arrays */
  hearTouch(header, arrays) {
    const record = this.records[/** @type {"A"|"B"} */ (header.slot)];
    if (header.part === "begin") {
      if (header.id < record.id) return;
      record.begin(header);
      if (header.live && !this.listening) return;
      if (header.live) { this.own(header.robot); this.play(false); this.setStatus("live"); this.studySoon(); }
      if (header.hand) { this.time = 0; this.setStatus("hand"); }
      return;
    }
    if (header.id !== record.id) return;
    if (header.part === "piece") {
      if (header.scene) record.turn(header.scene, arrays.angle);
      else record.add(header.first, arrays);
      if (this.asked && header.slot === "A" && !header.hand) {
        const from = this.asked;
        this.asked = 0;
        requestAnimationFrame(() => { this.latency.push({ asked: from, first: performance.now() - from }); });
      }
      if (header.hand || header.live) this.time = (record.filled - 1) * record.interval;
      if (header.live) Object.assign(record, { missing: header.missing, damaged: header.damaged, reading: record.judge(header.contact) });
    } else if (header.part === "end") {
      record.ended = true;
      record.hash = header.hash;
      record.mode = header.mode || record.mode;
      if (header.hand) { record.commands = header.commands; this.handOn = false; }
      this.root.dataset.hash = header.hash;
      this.note("whole", header.slot);
      this.setStatus(header.preview ? "preview" : this.plan.alone ? "here" : "exact");
    }
  }

  /** How long after the wish something came [ms]. @param {"whole"|"read"} what @param {string} slot */
  note(what, slot) {
    const last = this.latency[this.latency.length - 1];
    if (last && slot === "A") last[what] = performance.now() - last.asked;
  }

  /** @param {any} header @param {any} arrays */
  hearReading(header, arrays) {
    const record = this.records[/** @type {"A"} */ (header.slot)];
    if (header.id !== record.id) return;
    const step = Math.max(1, Math.round(Math.min(record.total, 380) / arrays.posterior.shape[0]));
    this.note("read", header.slot);
    record.reading = { posterior: arrays.posterior, code: arrays.code, noticed: header.noticed, outside: header.outside || [], step };
  }

  /** @param {any} header @param {any} arrays */
  hearStudy(header, arrays) {
    const doing = this.studying[header.slot];
    if (!doing || header.id !== doing.id) return; // of an earlier antenna or speed
    if (header.part === "doing") {
      Object.assign(doing, { doing: header.doing, share: header.share });
      return;
    }
    this.studies[header.slot] = { ...header, ...arrays, key: doing.key };
    if (header.part === "end") this.studying[header.slot] = null;
    if (this.store.state.mode === "board") {
      if (this.opened) this.open(this.opened);
    } else if (this.store.state.mode === "touch" && !this.plan.alone && !this.isSpatial()) // a standalone page has read it already
      this.send({ type: "touch", slot: header.slot, wish: makeWish(this.store.state, header.slot, false) });
  }

  /** @param {any} header @param {any} arrays */
  hearOpened(header, arrays) {
    if (header.what === "antenna") {
      this.originals[header.antenna.toml] = header.original;
      if (header.original.planes) this.slot = "A";
      this.store.change((s) => {
        s[this.slot] = { ...header.antenna };
        s.mode = "touch";
        if (header.original.planes) leavePlane(s);
      });
      this.say(`${header.antenna.name || "the antenna"} is antenna ${this.slot} now.`);
      return;
    }
    if (header.what === "calibration") {
      this.calibrated = true;
      this.say(`${header.name}: the calibration of ${header.hinges} hinges; recordings and boards may hold capacitance now.`);
      return;
    }
    const record = this.records.A, again = record.name === header.name;
    this.own(header.robot);
    record.begin(header);
    record.add(0, arrays);
    Object.assign(record, { ended: true, source: header.source, rate: header.rate, reading: arrays.posterior ? record.judge(header.contact) : null });
    this.studySoon();
    if (again) return;
    this.time = 0;
    this.say(`${header.name}: ${header.antenna.sensors.length} channels, ${header.total} samples, played back.`);
    this.setStatus("recorded");
    this.play(true);
  }

  /** @param {any} header */
  hearError(header) {
    if (header.of === "family") this.takeFamily({ part: "error" }, {});
    if (header.of === "study") this.studying[header.slot] = null;
    if (header.of === "hand") this.handOn = false;
    if (header.of === "listen") this.listening = "";
    if (header.of === "save") this.saving = false;
    if (header.of === "open" && this.opened && !this.records.A.name) this.opened = null;
    this.say(header.message, true);
    if (["touch", "hand", "listen"].includes(header.of)) this.setStatus("error");
  }

  async greeted() {
    const first = this.catalogue.state || makeState(this.catalogue.first);
    if (!this.restored) {
      this.restored = true;
      const address = this.inPage && !this.plan.alone ? location.hash : ""; // of a standalone page it may be anything
      const found = await decodeState(address, first);
      if (!found && address.length > 1) this.say("This address is cut or damaged. What is shown is the first scene.", true);
      this.store.state = found || first;
      if (this.isSpatial()) leavePlane(this.store.state);
      this.store.before = JSON.stringify(this.store.state);
    }
    if (this.store.state.mode === "board") this.askBoard();
    else this.ask(false);
    this.study(); // decoders that come with feeler are there at once
    if (!this.playing && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
    this.refresh();
  }

  // by hand

  startHand() {
    this.handOn = true;
    this.play(false);
    this.send({ type: "hand", slot: "A", wish: makeWish(this.store.state, "A", false), pace: this.handPace });
    this.setStatus("hand");
  }

  /** @param {number} what @param {number} x @param {number} y @param {number} turn */
  aim(what, x, y, turn) {
    const now = { type: "aim", what, x, y, turn };
    if (!this.nextAim) requestAnimationFrame(() => { this.link.send(this.nextAim); this.nextAim = null; });
    this.nextAim = now;
  }

  endHand() {
    if (!this.handOn) return;
    this.link.send({ type: "aim", what: "end" });
  }

  // objects

  addObject() {
    const { length } = this.records.A.antenna || { length: 42 };
    this.store.change((s) => {
      const left = s.touch.side === "left" ? 1 : -1, k = s.touch.objects.length;
      s.touch.objects.push({ kind: "ball", size: 1.5, x: left * 4, y: Number((length * (0.4 + 0.12 * (k % 4))).toFixed(2)), heading: -90 * left, speed: 0, friction: 1 });
      this.selected = s.touch.objects.length;
    });
  }

  /** @param {number} k */
  removeObject(k) {
    this.selected = -1;
    this.store.change((s) => { s.touch.objects.splice(k, 1); });
  }

  /** @param {number} number @param {number} factor @param {boolean} done */
  resize(number, factor, done) {
    this.store.change((s) => {
      const one = number === 0 ? s.touch : s.touch.objects[number - 1];
      one.size = Number(Math.max(0.2, Math.min(10, one.size * factor)).toPrecision(3));
    }, done);
  }

  // time

  duration() {
    const { A } = this.records;
    return A.hand ? A.span : (A.total || 380) * A.interval;
  }

  /** @param {number} time */
  seek(time) {
    this.time = Math.max(0, Math.min(time, this.duration() - 1));
    this.refresh();
  }

  /** @param {boolean} on */
  play(on) {
    this.playing = on;
    if (on && this.time >= this.duration() - 1.5) this.time = 0;
    this.last = performance.now();
    this.refresh();
  }

  // drawing

  /** What the colours of a tensor span, ± [rad or 1/mm]: of a page of two antennas, one scale for both. */
  findPeak() {
    const { scale } = this.plan;
    if (scale && ["touch", "hand"].includes(this.store.state.mode)) return scale[this.quantity];
    let peak = 0;
    for (const slot of this.store.state.B ? ["A", "B"] : ["A"]) {
      const record = this.records[/** @type {"A"} */ (slot)];
      if (!record.shown) continue;
      if (this.quantity === "angle") peak = Math.max(peak, record.peak);
      else peak = Math.max(peak, findCurvature(record));
    }
    return peak;
  }

  /** @param {string} slot */
  findOriginal(slot) {
    const wish = this.store.state[slot] || this.store.state.A;
    if (wish.toml) return this.originals[wish.toml] || null;
    return this.catalogue ? this.catalogue.presets[wish.preset || "exponential"] : null;
  }

  /** @param {any} found */
  setHover(found) {
    if (JSON.stringify(found) === JSON.stringify(this.hover)) return;
    this.hover = found;
    this.draw();
  }

  /** Whether there is a verdict, a code and a set to show. */
  isLearned() {
    return !this.isSpatial();
  }

  /** Whether the antenna is one in space. */
  isSpatial() {
    const first = this.findOriginal("A"), { A } = this.records;
    return Boolean(first ? first.planes : this.store.state.A.toml && A.antenna && A.antenna.planes);
  }

  /** Whether the study of an antenna is of an earlier one, or of another speed. */
  isStale(slot = "A") {
    return Boolean(this.studies[slot]) && this.studies[slot].key !== keyStudy(this.store.state, slot);
  }

  draw() { this.want(true); }

  refresh() { this.want(true); }

  /** @param {boolean} panels */
  want(panels) {
    this.wants.panels ||= panels;
    if (this.wants.draw) return;
    this.wants.draw = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  /** @param {number} now */
  frame(now) {
    this.wants.draw = false;
    if (this.playing) {
      this.time += Math.min(now - this.last, 100) * this.rate;
      if (this.time >= this.duration() - 1) this.time = 0;
      this.last = now;
    }
    this.colours = readColours(this.root);
    this.views.update(this.wants.panels);
    this.wants.panels = false;
    if (this.playing) this.want(false);
    this.frames += 1;
  }

  /** @param {string} status */
  setStatus(status) {
    this.status = status;
    this.refresh();
  }

  /** @param {string} words @param {boolean} [bad] @param {number} [long] ms that they stay */
  say(words, bad = false, long = bad ? 12_000 : 5000) {
    const note = /** @type {HTMLElement} */ (this.root.querySelector(".note"));
    note.textContent = words;
    note.classList.toggle("bad", bad);
    show(note, true);
    announce(this.root, words);
    clearTimeout(this.pending);
    this.pending = window.setTimeout(() => show(note, false), long);
  }
}

/** What a study depends on. @param {any} state @param {string} slot */
function keyStudy(state, slot) {
  return JSON.stringify([state[slot], state.touch.speed, state.unsure]);
}

/** Greatest curvature of a record [1/mm]. @param {any} record */
function findCurvature(record) {
  if (record.top && record.top.id === record.id && record.top.shown === record.filled) return record.top.value;
  let value = 0;
  for (let s = 0; s < record.index.length; s++)
    for (let k = 0; k < record.shown; k++) value = Math.max(value, Math.abs(record.angle(s, k)) / record.antenna.segments[record.index[s]]);
  record.top = { id: record.id, shown: record.filled, value };
  return value;
}

const STATUS_WORDS = { busy: ["computing", "pieces are shown as they come"], exact: ["exact", "equals feeler.touch bit for bit, as float32"],
  preview: ["preview", "timestep 0.1 ms while you drag; the exact one follows"], recorded: ["recorded", "nothing is computed here"],
  here: ["computed here", "by the engine in this page: feeler's own numbers, to 1e-9 rad"],
  live: ["live", "what the board sends now"], hand: ["in your hand", "the simulation follows the mouse"], error: ["stopped", "see the message; the next change goes on"],
  away: ["server away", "trying again; a server started anew prints a new address"],
  full: ["too many pages", "the server shows eight pages at once: close one, and this page goes on by itself"] };

/** @type {Plan} */
export const STUDIO = { alone: false, rest: STUDY_AFTER, panels: PANELS, header: makeStudioHeader, steps: STEPS };

/** Header, columns of panels, and how they are brought up to date. @param {App} app */
function build(app) {
  const { root } = app;
  const panels = app.plan.panels.map((makeOne) => makeOne(app));
  const header = app.plan.header(app), tour = makeTour(app);
  header.tourButton.addEventListener("click", () => tour.start());
  const columns = ["left", "middle", "right"].map((place) => make("div", { class: place },
    ...panels.filter((panel) => panel.place === place).map((panel) => panel.element)));
  const note = make("p", { class: "note", role: "alert" });
  show(note, false);
  root.append(header.element, tour.element, make("div", { class: "columns" }, ...columns), note,
    make("p", { class: "announce", "aria-live": "polite" }), makeTags(app));

  /** @param {boolean} everything What is written too, not only what moves. */
  function update(everything) {
    if (everything) {
      root.dataset.mode = app.store.state.mode;
      header.update();
      tour.update();
      for (const panel of panels) show(panel.element, panel.isShown());
      show(columns[2], app.isLearned());
    }
    for (const panel of panels) {
      if (panel.redraw) panel.redraw();
      if (everything && panel.isShown()) panel.update();
    }
  }
  app.views = { share: header.share, update };

  root.addEventListener("dragover", (/** @type {DragEvent} */ event) => event.preventDefault());
  root.addEventListener("drop", (/** @type {DragEvent} */ event) => {
    event.preventDefault();
    if (event.dataTransfer && event.dataTransfer.files[0]) openFile(app, event.dataTransfer.files[0]);
  });
  root.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => pressKey(app, event));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.refresh());
}

/** Name, modes and tools. @param {App} app */
function makeStudioHeader(app) {
  const share = makeShare(app);
  const modes = makeChoice("Mode", MODES, () => app.store.state.mode, (mode) => app.store.change((s) => { s.mode = mode; }));
  const tool = (/** @type {string} */ text, /** @type {string} */ name, /** @type {() => void} */ onclick) =>
    make("button", { type: "button", class: "plain", title: name || null, "aria-label": name.replace(/ \(.*/, "") || null, text, onclick });
  const undo = tool("↶", "Undo (Ctrl Z)", () => app.store.undo());
  const redo = tool("↷", "Redo (Ctrl Y)", () => app.store.redo());
  const theme = tool("◐", "Light or dark", () => {
    app.root.dataset.theme = app.colours.dark ? "light" : "dark";
    app.refresh();
  });
  const tourButton = tool("Tour", "", () => {});
  const file = make("input", {
    type: "file", accept: ".toml,.csv,.json", "aria-label": "Open an antenna, a recording or a calibration",
    onchange: () => { openFile(app, file.files[0]); file.value = ""; },
  });
  const open = make("label", { class: "plain file" }, "Open…", file);
  const status = makeStatus(app);
  const element = make("header", {}, make("h1", {}, make("b", { text: "feeler" }), " studio"), modes.element,
    make("div", { class: "tools" }, status.element, undo, redo, open, tourButton, theme, share.element));

  function update() {
    modes.update();
    [...modes.element.children].slice(1).forEach((button) => { button.disabled = app.isSpatial(); });
    undo.disabled = !app.store.past.length;
    redo.disabled = !app.store.future.length;
    status.update();
  }
  return { element, share, tourButton, update };
}

/** What is going on, in a word. @param {App} app */
export function makeStatus(app) {
  const element = make("span", { class: "status", role: "status" });
  function update() {
    const now = app.away || app.status || "busy", [word, title] = STATUS_WORDS[/** @type {"busy"} */ (now)];
    Object.assign(element, { textContent: word, title });
    element.dataset.is = now;
  }
  return { element, update };
}

/** @param {App} app @param {File} file */
async function openFile(app, file) {
  if (!file || app.plan.alone) return;
  if (file.size > 6e6) { app.say(`${file.name} is too large: at most 6 MB.`, true); return; }
  app.say(`Opening ${file.name} …`);
  const opened = { name: file.name, text: await file.text() };
  if (file.name.toLowerCase().endsWith(".csv")) {
    if (app.listening) app.listen("");
    app.opened = opened;
  }
  app.open(opened);
}

/** @param {App} app @param {KeyboardEvent} event */
function pressKey(app, event) {
  const target = /** @type {HTMLElement} */ (event.target), typing = ["INPUT", "SELECT", "TEXTAREA"].includes(target.tagName);
  const command = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
  if (command && key === "z" && !event.shiftKey) app.store.undo();
  else if (command && (key === "y" || (key === "z" && event.shiftKey))) app.store.redo();
  else if (command || event.altKey || typing) return;
  else if (event.key === " " && target.tagName !== "BUTTON" && target.tagName !== "SUMMARY") app.play(!app.playing);
  else if (key === "," || key === ".") { app.play(false); app.seek(app.time + (key === "." ? 1 : -1)); }
  else return;
  event.preventDefault();
}

/** The studio of a local server. @param {HTMLElement} root */
export function startServed(root) {
  const app = new App(root);
  app.inPage = true;
  /** @type {any} */ (root).studio = app;
  app.link = linkServer((header, arrays) => app.hear(header, arrays), (now) => {
    app.away = now === "on" ? "" : now === "full" ? "full" : "away";
    if (app.away && app.saving) app.say("The server went away before the file was written.", true);
    if (app.away) Object.assign(app, { handOn: false, listening: "", saving: false, studying: { A: null, B: null } });
    else app.send({ type: "hello" });
    app.refresh();
  });
  return app;
}

/** The studio in a notebook's cell. @param {{model: any, el: HTMLElement}} host */
export function render({ model, el }) {
  const root = make("div");
  el.append(root);
  const app = new App(root);
  /** @type {any} */ (root).studio = app;
  app.link = linkModel(model, (header, arrays) => app.hear(header, arrays), () => app.send({ type: "hello" }));
  return () => {
    app.send({ type: "stop" });
    app.link.close();
  };
}
