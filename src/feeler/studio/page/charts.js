// @ts-check
import { HOT, KIND_COLOURS, KIND_DASHES, SLOT_COLOURS, pick } from "./colours.js";
import { drawMoment, findPointer, make, makeCanvas, makeChoice, makePanel, show, write } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** @typedef {import("./panels.js").Panel} Panel */
/** What is made of the tensor: the decoder's verdict over time, the code, and how far a set of touches spreads. */

const SURE = 0.9;

const OUTSIDE = "outside", WORDS = "outside what this decoder was trained on";

/** Probability of each answer, the kinds and "outside" (answer, time), from a posterior (time, answer). @param {any} reading @param {any} study */
function addKinds(reading, study) {
  if (reading.kinds && reading.kindsOf === study) return reading.kinds;
  const [samples, classes] = reading.posterior.shape;
  /** @type {Object<string, Float32Array>} */
  const kinds = {};
  for (let c = 0; c < classes; c++) {
    const kind = study.answers[c];
    kinds[kind] ||= new Float32Array(samples);
    for (let k = 0; k < samples; k++) kinds[kind][k] += reading.posterior.data[k * classes + c];
  }
  reading.kinds = kinds;
  reading.kindsOf = study;
  return kinds;
}

/** The kinds' probabilities, without "outside". @param {any} reading @param {any} study */
const listKinds = (reading, study) => Object.entries(addKinds(reading, study)).filter(([kind]) => kind !== OUTSIDE);

/**
 * What the decoder says at a sample: the likeliest answer, when it became sure of it, and of what it had been sure `before`, if it is no longer.
 * @param {any} reading @param {any} study @param {number} sample
 */
export function readVerdict(reading, study, sample) {
  const kinds = addKinds(reading, study), factor = reading.step || 1, none = /** @type {{kind: string, at: number}|null} */ (null);
  const at = Math.max(0, Math.min(Math.round(sample / factor), reading.posterior.shape[0] - 1));
  let best = "", probability = 0, before = none;
  for (const [kind, values] of Object.entries(kinds)) if (values[at] > probability) { best = kind; probability = values[at]; }
  if (reading.noticed < 0 || sample < reading.noticed) return { best: "", probability: 0, since: -1, decided: -1, before };
  const count = (/** @type {number} */ k) => Math.max(0, k * factor - reading.noticed);
  let decided = -1;
  for (let k = at; k >= 0 && kinds[best][k] >= SURE; k--) decided = k;
  for (let k = Math.ceil(reading.noticed / factor); k < (decided < 0 ? at : decided) && !before; k++)
    for (const [kind, values] of Object.entries(kinds)) if (values[k] >= SURE && (decided < 0 || kind !== best)) before = { kind, at: count(k) };
  return { best, probability, since: sample - reading.noticed, decided: decided < 0 ? -1 : count(decided), before };
}

/** When a kind is decided for good, in samples after contact; −1 never. @param {any} reading @param {any} study */
export function findDecision(reading, study) {
  return readVerdict(reading, study, reading.posterior.shape[0] * (reading.step || 1) - 1);
}

/** On what a decoder was trained, and how well it does on held-out touches. @param {any} study */
export function describeDecoder(study) {
  if (!study || !study.range) return "";
  const { range, scores, noise } = study, to = (/** @type {number[]} */ [low, high], /** @type {number} */ factor = 1) =>
    (low === high ? write(factor * low, 3) : `${write(factor * low, 3)} to ${write(factor * high, 3)}`);
  return `Trained on one ball, box or triangle from either side, at ${to(range.location, 100)} % of the length, half-width ${to(range.size)} mm, ${to(range.speed)} m/s, ` +
    `${write(range.approach)}°, friction ${write(range.friction)}. It allows for white noise of ${((180 * noise) / Math.PI).toFixed(2)}° (SD) on each reading. ` +
    `Accuracy on ${scores.n} held-out touches: ${Math.round(100 * scores.noisy)} % with that noise, ${Math.round(100 * scores.clean)} % without; ` +
    `${Math.round(100 * scores.confidently_wrong)} % confidently wrong.`;
}

/** @param {App} app */
export function makeVerdictPanel(app) {
  const words = make("p", { class: "verdict", role: "status" });
  const legend = make("div", { class: "legend" });
  for (const kind of ["ball", "box", "triangle"]) {
    const line = { ball: "solid", box: "dashed", triangle: "dotted" }[kind];
    const mark = make("i", { class: "line" });
    mark.style.borderTop = `3px ${line} ${KIND_COLOURS[/** @type {"ball"} */ (kind)]}`;
    legend.append(make("span", {}, mark, kind));
  }
  const thin = make("span", { text: "thin: B" });
  legend.append(thin);
  const { canvas, redraw } = makeCanvas({ class: "chart", role: "img", "aria-label": "Probability of each shape over time" }, draw);

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const colours = app.colours, left = 30, bottom = 16, high = h - bottom - 6, wide = w - left - 54, end = app.duration();
    c.font = "11px system-ui, sans-serif";
    for (const share of [0, 0.5, SURE, 1]) {
      const y = 6 + high * (1 - share);
      c.strokeStyle = colours.line;
      c.setLineDash(share === SURE ? [4, 3] : []);
      c.beginPath();
      c.moveTo(left, y);
      c.lineTo(left + wide, y);
      c.stroke();
      c.setLineDash([]);
      c.fillStyle = colours.soft;
      c.textAlign = "right";
      if (share !== SURE) c.fillText(String(share), left - 5, y + 4);
    }
    c.textAlign = "left";
    c.fillText("0 ms", left, h - 3);
    c.textAlign = "right";
    c.fillText(`${Math.round(end)}`, left + wide, h - 3);
    const slots = app.store.state.B ? ["B", "A"] : ["A"];
    for (const slot of slots) {
      const reading = app.records[slot].reading, study = app.studies[slot];
      if (!reading || !study) continue;
      const step = reading.step || 1;
      for (const [kind, values] of listKinds(reading, study)) {
        c.strokeStyle = KIND_COLOURS[/** @type {"ball"} */ (kind)];
        c.globalAlpha = reading.old ? 0.3 : slot === "B" ? 0.75 : 1;
        c.lineWidth = slot === "A" ? 2 : 1.4;
        c.setLineDash(KIND_DASHES[kind]);
        c.beginPath();
        /** @type {Float32Array} */ (values).forEach((p, k) => {
          const x = left + (wide * k * step) / end, y = 6 + high * (1 - p);
          if (k) c.lineTo(x, y);
          else c.moveTo(x, y);
        });
        c.stroke();
      }
      c.globalAlpha = 1;
      c.setLineDash([]);
      if (slot === "A") nameEnds(c, listKinds(reading, study), left + wide + 5, (p) => 10 + high * (1 - p), colours);
    }
    drawMoment(c, colours.accent, left + (wide * app.time) / end, 4, 6 + high);
    say();
  }

  /** The kind at the end of each curve, one below the other. @param {CanvasRenderingContext2D} c @param {[string, Float32Array][]} kinds @param {number} x @param {(p: number) => number} place @param {any} colours */
  function nameEnds(c, kinds, x, place, colours) {
    const ends = kinds.map(([kind, values]) => ({ kind, y: place(values[values.length - 1]) })).sort((a, b) => b.y - a.y);
    c.textAlign = "left";
    c.fillStyle = colours.ink;
    let lowest = Infinity;
    for (const { kind, y } of ends) {
      lowest = Math.min(y, lowest - 12);
      c.fillText(kind, x, lowest);
    }
  }

  function say() {
    const { reading } = app.records.A, study = app.studies.A;
    if (app.records.A.hand) {
      setWords("", "No verdict by hand: the decoder knows steady touches only.");
      return;
    }
    if (!reading || !study) {
      setWords("", app.studying.A ? `training on random touches: ${Math.round(100 * app.studying.A.share)} %` : "No decoder yet for this antenna and speed.");
      return;
    }
    if (reading.old || app.isStale()) {
      setWords("", "Not read yet: what is drawn faintly is of another touch, antenna or speed.");
      return;
    }
    const found = readVerdict(reading, study, Math.round(app.time));
    const before = found.before ? ` · before, ${found.before.kind === OUTSIDE ? WORDS : found.before.kind} from ${found.before.at} ms` : "";
    if (found.since < 0) setWords("no touch noticed yet", "");
    else if (found.best === OUTSIDE) setWords(WORDS, (reading.outside || []).join("; ") || `no touch of its training is this close${before}`);
    else if (found.probability >= SURE) setWords(found.best, `${found.probability.toFixed(2)} · decided ${found.decided} ms after contact${before}`);
    else setWords("not sure yet", `perhaps a ${found.best}, ${found.probability.toFixed(2)}${before}`);
  }

  /** @param {string} first @param {string} second */
  function setWords(first, second) {
    const text = `${first}|${second}`;
    if (words.dataset.now === text) return;
    words.dataset.now = text;
    words.replaceChildren(make("b", { text: first }), make("span", { text: second }));
  }

  const unsure = makeChoice("How well the decoder knows the speed", [["0", "exactly"], ["0.02", "± 2 %"], ["0.1", "± 10 %"]], () => String(app.store.state.unsure),
    (value) => app.store.change((/** @type {any} */ s) => { s.unsure = Number(value); }));
  const about = make("p", { class: "caption" });
  const row = make("details", { class: "unsure" }, make("summary", { text: "Advanced" }), make("span", { class: "caption", text: "speed known to" }), unsure.element);
  const element = makePanel("Verdict", "verdict-panel", make("div", { class: "stack" }, words, canvas, legend, row, about));
  function update() {
    about.textContent = describeDecoder(app.studies.A);
    show(about, Boolean(about.textContent));
    element.classList.toggle("old", app.isStale() || app.records.A.hand);
    unsure.update();
    show(thin, Boolean(app.store.state.B));
    show(row, !app.plan.alone); // a standalone page was made for one of them
  }
  return /** @type {Panel} */ ({ element, place: "right", isShown: () => app.isLearned(), update, redraw });
}

/** @param {App} app */
export function makeCodePanel(app) {
  const { canvas, redraw } = makeCanvas({ class: "chart code", role: "img", "aria-label": "Bases and the code of this touch" }, draw);
  /** @type {Object<string, HTMLCanvasElement>} */
  const kept = {};

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const colours = app.colours, study = app.studies.A, reading = app.records.A.reading;
    if (!study || !study.bases) return;
    const [n, sensors, lags] = study.bases.shape, high = (h - 14) / n, wide = Math.min(64, w * 0.24), left = wide + 14;
    let top = 0;
    if (reading && reading.code) for (const value of reading.code.data) top = Math.max(top, value);
    c.font = "11px system-ui, sans-serif";
    for (let m = 0; m < n; m++) {
      const y = m * high;
      c.imageSmoothingEnabled = false;
      c.drawImage(paintBasis(study, m, sensors, lags), 0, y + 2, wide, high - 6);
      c.strokeStyle = colours.line;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(left, y + high - 4);
      c.lineTo(w - 6, y + high - 4);
      c.stroke();
      if (!reading || !reading.code || reading.code.shape[0] !== n) continue;
      const samples = reading.code.shape[1], end = app.duration();
      c.fillStyle = SLOT_COLOURS.A + (reading.old ? "44" : "bb");
      c.beginPath();
      c.moveTo(left, y + high - 4);
      for (let k = 0; k < samples; k++)
        c.lineTo(left + ((w - 6 - left) * k) / end, y + high - 4 - ((high - 8) * reading.code.data[m * samples + k]) / (top || 1));
      c.lineTo(left + ((w - 6 - left) * samples) / end, y + high - 4);
      c.fill();
    }
    drawMoment(c, colours.accent, left + ((w - 6 - left) * app.time) / app.duration(), 0, h - 14);
    c.fillStyle = colours.soft;
    c.fillText(`bases, ${lags} ms`, 0, h - 2);
    c.textAlign = "right";
    c.fillText("when each is played", w - 6, h - 2);
    c.textAlign = "left";
  }

  /** @param {any} study @param {number} m @param {number} sensors @param {number} lags */
  function paintBasis(study, m, sensors, lags) {
    const key = `${study.key} ${m}`;
    if (kept[m] && kept[m].dataset.key === key) return kept[m];
    const picture = document.createElement("canvas");
    picture.width = lags;
    picture.height = sensors;
    picture.dataset.key = key;
    const c = /** @type {CanvasRenderingContext2D} */ (picture.getContext("2d")), from = m * sensors * lags;
    const values = study.bases.data.subarray(from, from + sensors * lags);
    let top = 1e-12;
    for (const value of values) top = Math.max(top, value);
    for (let s = 0; s < sensors; s++)
      for (let k = 0; k < lags; k++) {
        c.fillStyle = pick(HOT, values[s * lags + k] / top);
        c.fillRect(k, sensors - 1 - s, 1, 1);
      }
    kept[m] = picture;
    return picture;
  }

  const element = makePanel("Code", "code-panel", canvas);
  return /** @type {Panel} */ ({
    element, place: "right", isShown: () => app.isLearned() && Boolean(app.studies.A && app.studies.A.bases) && app.store.state.mode !== "board",
    update: () => element.classList.toggle("old", app.isStale() || app.records.A.hand), redraw,
  });
}

const INDEX_LABELS = { nmi: "NMI", pearson: "Pearson", ssim: "SSIM" };

/** @param {App} app */
export function makeSetPanel(app) {
  let index = "nmi";
  /** @type {{row: number, column: number}|null} */
  let over = null;
  const choice = makeChoice("Index of similarity", Object.entries(INDEX_LABELS), () => index, (value) => { index = value; update(); });
  const numbers = make("p", { class: "numbers" });
  const { canvas, redraw } = makeCanvas({
    class: "matrix", tabindex: "0", role: "application", "aria-label": "Similarity of thirty touches; arrow keys move, Enter shows that touch",
  }, draw);
  const pair = makeCanvas({ class: "pair", role: "img", "aria-label": "Both tensors of the pair" }, drawPair);
  const caption = make("p", { class: "caption", "aria-live": "polite" });

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function draw(c, w, h) {
    const study = app.studies.A, matrix = study && study[`similarity ${index}`];
    if (!matrix) return;
    const n = matrix.shape[0], size = Math.min(w, h) / n;
    let low = Infinity, top = -Infinity;
    for (let k = 0; k < n * n; k++) if (k % (n + 1)) { low = Math.min(low, matrix.data[k]); top = Math.max(top, matrix.data[k]); }
    for (let i = 0; i < n; i++)
      for (let j = 0; j < n; j++) {
        c.fillStyle = i === j ? app.colours.line : pick(HOT, (matrix.data[i * n + j] - low) / (top - low || 1));
        c.fillRect(j * size, i * size, size + 0.5, size + 0.5);
      }
    const now = findNow(study);
    for (const [place, colour] of /** @type {[any, string][]} */ ([[over, app.colours.accent], [now >= 0 ? { row: now, column: -1 } : null, SLOT_COLOURS.A]])) {
      if (!place) continue;
      c.strokeStyle = colour;
      c.lineWidth = 2;
      if (place.column < 0) c.strokeRect(0.5, place.row * size, n * size - 1, size);
      else c.strokeRect(place.column * size, place.row * size, size, size);
    }
  }

  /** The touch of the set that is shown. @param {any} study */
  function findNow(study) {
    const touch = app.store.state.touch;
    return study.labels.findIndex((/** @type {any[]} */ [kind, size, location]) => kind === touch.kind && size === touch.size && Math.abs(location - touch.location) < 1e-6);
  }

  /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
  function drawPair(c, w, h) {
    const study = app.studies.A;
    if (!study || !study.tensors || !over) return;
    const [, sensors, samples] = study.tensors.shape, wide = (w - 8) / 2;
    [over.row, over.column].forEach((trial, side) => {
      const from = trial * sensors * samples, dx = wide / samples, dy = h / sensors;
      for (let s = 0; s < sensors; s++)
        for (let k = 0; k < samples; k++) {
          c.fillStyle = pick(HOT, study.tensors.data[from + s * samples + k] / study.peak);
          c.fillRect(side * (wide + 8) + k * dx, h - (s + 1) * dy, dx + 0.5, dy + 0.5);
        }
    });
  }

  function sayPair() {
    const study = app.studies.A;
    if (!study || !over) {
      caption.textContent = "Rows and columns are the paper's 30 touches; a bright pair is felt alike. Click a pair to see it.";
      return;
    }
    const name = (/** @type {number} */ k) => `${study.labels[k][0]} ${study.labels[k][1]} mm at ${study.labels[k][2]} L`;
    const matrix = study[`similarity ${index}`], value = matrix.data[over.row * matrix.shape[0] + over.column];
    caption.textContent = `${name(over.row)}  ·  ${name(over.column)}: ${INDEX_LABELS[/** @type {"nmi"} */ (index)]} ${write(value, 3)}`;
  }

  /** @param {any} place */
  function point(place) {
    over = place;
    redraw();
    show(pair.canvas, Boolean(over && app.studies.A && app.studies.A.tensors));
    pair.redraw();
    sayPair();
  }

  /** @param {MouseEvent} event */
  function find(event) {
    const study = app.studies.A;
    if (!study) return null;
    const [x, y] = findPointer(event, canvas), n = study.labels.length, size = Math.min(canvas.clientWidth, canvas.clientHeight) / n;
    const row = Math.floor(y / size), column = Math.floor(x / size);
    return row < n && column < n && row >= 0 && column >= 0 ? { row, column } : null;
  }

  function choose() {
    if (!over) return;
    const [kind, size, location] = app.studies.A.labels[over.row];
    app.store.change((/** @type {any} */ s) => Object.assign(s.touch, { kind, size, location, speed: app.studies.A.speed }));
  }
  canvas.addEventListener("pointermove", (event) => point(find(event)));
  canvas.addEventListener("click", choose);
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0] }[event.key];
    const n = app.studies.A ? app.studies.A.labels.length : 0;
    if (step && n) point({ row: ((over ? over.row : 0) + step[0] + n) % n, column: ((over ? over.column : 0) + step[1] + n) % n });
    else if (event.key === "Enter") choose();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });

  function update() {
    element.classList.toggle("old", app.isStale());
    choice.update();
    const parts = ["A", "B"].filter((slot) => app.studies[slot] && app.studies[slot].averages && (slot === "A" || app.store.state.B)).map((slot) => {
      const dot = make("i");
      dot.style.background = SLOT_COLOURS[/** @type {"A"} */ (slot)];
      return make("span", { "data-tag": "own" }, dot, `${slot}: ${app.isStale(slot) ? "–" : write(app.studies[slot].averages[index], 2)}`);
    });
    numbers.replaceChildren(make("span", { text: "closest match, mean" }), ...parts);
    redraw();
    sayPair();
  }
  show(pair.canvas, false);
  const element = makePanel("Set", "set-panel", make("div", { class: "set" }, choice.element, numbers, canvas, pair.canvas, caption));
  return /** @type {Panel} */ ({ element, place: "right", isShown: () => app.isLearned() && Boolean(app.studies.A && app.studies.A.labels), update });
}
