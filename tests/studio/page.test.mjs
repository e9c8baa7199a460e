// Pure parts of the page, held against what Python made of the same (given.json). Run by test_units.py.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { findDecision, readVerdict } from "./charts.js";
import { Decoder, findOnset, findOutside, readTemplates } from "./decoder.js";
import { raise, write } from "./dom.js";
import { findHandles, readCurve, sumCompliance } from "./editor.js";
import { drawRound } from "./blind.js";
import { Host, grade } from "./host.js";
import { computeAccuracy } from "./living.js";
import { drawNormal } from "./noise.js";
import { TouchRecord, unpack } from "./record.js";
import { Nerve, SENSILLUM } from "./spikes.js";
import { Store, decodeState, encodeState, makeState, makeWish } from "./state.js";
import { findTag } from "./tags.js";

const given = JSON.parse(readFileSync(new URL("./given.json", import.meta.url)));
const near = (a, b, off = 1e-6) => assert.ok(Math.abs(a - b) <= off * Math.max(1, Math.abs(b)), `${a} is not ${b}`);
const read = (text) => { const raw = Buffer.from(text, "base64"); return raw.buffer.slice(raw.byteOffset, raw.byteOffset + raw.length); };

test("a message is unpacked as Python packed it", () => {
  const [header, arrays] = unpack(read(given.packed.content));
  assert.equal(header.part, "piece");
  for (const [name, { shape, values }] of Object.entries(given.packed.arrays)) {
    assert.deepEqual(arrays[name].shape, shape);
    assert.deepEqual([...arrays[name].data], values);
  }
});

test("curves and their compliance are the antenna's that Python makes of the same wish", () => {
  for (const { wish, original, stiffness, damping } of given.curves) {
    readCurve(wish, original, "stiffness").forEach((k, n) => near(k / stiffness[n], 1, 1e-9));
    readCurve(wish, original, "damping").forEach((c, n) => near(c / damping[n], 1, 1e-9));
    near(sumCompliance(stiffness), stiffness.reduce((sum, k) => sum + 1 / k, 0));
  }
  assert.deepEqual(findHandles({}, given.curves[0].original, "damping"), given.curves[0].original.handles.damping);
});

/** 2 classes of a ball, 1 of a box; each row a sample. */
function makeReading(step = 1) {
  const rows = [[0.3, 0.3, 0.4], [0.3, 0.3, 0.4], [0.1, 0.1, 0.8], [0.5, 0.45, 0.05], [0.2, 0.2, 0.6], [0.5, 0.42, 0.08], [0.6, 0.35, 0.05]];
  return { posterior: { shape: [7, 3], data: new Float32Array(rows.flat()) }, noticed: 2 * step, step };
}
const study = { answers: ["ball", "ball", "box"] };

test("a verdict is the likeliest kind's, and decided since it stayed sure, counted from contact", () => {
  for (const step of [1, 2, 5]) {
    const say = (k) => readVerdict(makeReading(step), study, k * step);
    assert.deepEqual(say(1), { best: "", probability: 0, since: -1, decided: -1, before: null });
    assert.equal(say(2).best, "box");
    near(say(2).probability, 0.8);
    assert.deepEqual([say(2).since, say(2).decided], [0, -1]);
    assert.equal(say(3).best, "ball");
    near(say(3).probability, 0.95);
    assert.deepEqual([say(3).since, say(3).decided], [step, step]);
    assert.deepEqual([say(4).best, say(4).decided], ["box", -1]);
    assert.deepEqual([say(6).since, say(6).decided], [4 * step, 3 * step]); // not since the first time
    assert.equal(findDecision(makeReading(step), study).decided, 3 * step);
    assert.deepEqual([say(3).before, say(4).before], [null, { kind: "ball", at: step }]); // what was decided is not taken back without a word
  }
  const reading = makeReading();
  readVerdict(reading, study, 6);
  const other = { answers: ["box", "ball", "ball"] };
  assert.equal(readVerdict(reading, other, 2).best, "ball"); // sums are not kept from the other study
});

const ANTENNA = { name: "a", length: 6, segments: [1, 2, 3], sensors: [2, 3], radius: 0.2, rest: [0.1, 0, 0], stiffness: [3, 2, 1], damping: [1, 1, 1] };
const HEADER = { id: 4, antenna: ANTENNA, rims: [[]], total: 5, preview: false, interval: 1 };

/** Angles that tell their sample and hinge. */
function makePiece(first, n, scale = 1) {
  const angle = Array.from({ length: n }, (_, k) => [0, 1, 2].map((h) => scale * (0.01 * (first + k) + 0.1 * h))).flat();
  return { angle: { shape: [n, 3], data: new Float32Array(angle) }, base: { shape: [n, 3], data: new Float32Array(3 * n) } };
}

test("a record gives each sensor its own hinge and sample, in whatever pieces they come", () => {
  const record = new TouchRecord();
  record.begin(HEADER);
  record.add(0, makePiece(0, 2));
  assert.deepEqual([record.filled, record.shown], [2, 2]);
  record.add(2, makePiece(2, 3));
  for (let k = 0; k < 5; k++) { near(record.angle(0, k), 0.1 + 0.01 * k); near(record.angle(1, k), 0.2 + 0.01 * k); }
  near(record.peak, 0.24);
  const turn = [0.02, 0.14, 0.36], points = record.points(2), x = [0], y = [0];
  turn.forEach((phi, k) => { x.push(x[k] + ANTENNA.segments[k] * Math.sin(phi)); y.push(y[k] + ANTENNA.segments[k] * Math.cos(phi)); });
  x.forEach((value, k) => { near(points[2 * k], value); near(points[2 * k + 1], y[k]); });
  near(record.tip(2)[1], y[3]);
});

test("nothing of the touch before is left once another is whole, and at once where the antenna is another", () => {
  const record = new TouchRecord(), mode = { frequency: 0.02, damping_ratio: 0.5 };
  record.begin(HEADER);
  record.add(0, makePiece(0, 5, 3));
  near(record.tip(0)[1], Math.cos(0) + 2 * Math.cos(0.3) + 3 * Math.cos(0.9));
  Object.assign(record, { mode, reading: makeReading() });
  record.begin({ ...HEADER, id: 5 });
  assert.equal(record.reading.old, true);
  assert.deepEqual(record.mode, mode); // the same antenna rings as it did
  record.add(0, makePiece(0, 5));
  near(record.peak, 0.24);
  near(record.tip(0)[1], Math.cos(0) + 2 * Math.cos(0.1) + 3 * Math.cos(0.3));
  record.begin({ ...HEADER, id: 6, antenna: { ...ANTENNA, damping: [1, 1, 2] } });
  assert.equal(record.mode, null);
  record.begin({ ...HEADER, id: 7, total: 4 });
  assert.deepEqual([record.shown, record.peak, record.reading], [0, 0, null]);
});

test("a live record drops its oldest samples and keeps the order and the clock of the others", () => {
  const record = new TouchRecord();
  record.begin({ ...HEADER, live: true, interval: 4, total: 8 });
  for (let first = 0; first < 20; first += 5) {
    const piece = makePiece(first, 5);
    piece.posterior = { shape: [5, 2], data: new Float32Array(10).fill(0.5) };
    record.add(first, piece);
  }
  assert.ok(record.filled <= 8 && record.dropped + record.filled === 20);
  for (let k = 0; k < record.filled; k++) near(record.angle(0, k), 0.1 + 0.01 * (record.dropped + k));
  const judged = record.judge(17);
  assert.deepEqual([judged.noticed, judged.step], [4 * (17 - record.dropped), 4]);
  assert.equal(record.judge(-1).noticed, -1);
});

test("a state travels in an address, is undone and redone, and makes its own wish", async () => {
  const state = makeState({ preset: "linear" });
  Object.assign(state, { mode: "board", B: { preset: "matched" }, unsure: 0.1 });
  state.touch.location = 0.61;
  assert.deepEqual(await decodeState(`#s=${await encodeState(state)}`, makeState({})), state);
  assert.equal(await decodeState("#s=nonsense", makeState({})), null);
  for (const part of [{ A: null }, { A: [1] }, { touch: 3 }])
    assert.equal(await decodeState(`#s=${await encodeState({ ...state, ...part })}`, makeState({})), null);
  const odd = await decodeState(`#s=${await encodeState({ ...state, B: 7, mode: "wall", touch: { objects: "many" } })}`, makeState({}));
  assert.deepEqual([odd.B, odd.mode, odd.touch.objects], [null, "touch", []]);
  const store = new Store(state, () => {});
  store.change((s) => { s.touch.speed = 0.2; }, false);
  store.change((s) => { s.touch.speed = 0.3; });
  store.undo();
  assert.equal(store.state.touch.speed, 0.06);
  store.redo();
  assert.equal(store.state.touch.speed, 0.3);
  store.undo();
  store.change((s) => { s.touch.speed = 0.4; });
  store.redo(); // what was undone before a new change is gone
  assert.equal(store.state.touch.speed, 0.4);
  store.undo();
  assert.equal(store.state.touch.speed, 0.06);
  store.redo();
  assert.equal(store.state.touch.speed, 0.4);
  assert.deepEqual(makeWish(store.state, "B", true), { antenna: { preset: "matched" }, ...store.state.touch, preview: true });
});

test("a standalone page draws each object at its own size", () => {
  const unit = { rounding: 0, rims: [[[1, 0], [0, 1]]], parts: [], planes: [], unbounded: false };
  const host = Object.assign(Object.create(Host.prototype), { config: { shapes: { ball: unit, box: unit } } });
  const said = host.describe({ drawn: ANTENNA }, { kind: "ball", size: 2, objects: [{ kind: "box", size: 3 }, { kind: "ball", size: 5 }] });
  assert.deepEqual(said.rims, [2, 3, 5].map((size) => [[[size, 0], [0, size]]]));
});

test("a decoder judges as feeler's does: a touch, one between two kinds, its mirror image, one like none and nothing", async () => {
  const { taught, felt, noticed, posterior } = given.decoder, decoder = new Decoder(taught, await readTemplates(taught.templates));
  const read = felt.map((one) => decoder.decode({ n: 7, samples: 60, data: Float64Array.from(one) }));
  assert.deepEqual(read.map((one) => one.noticed), noticed);
  read.forEach((one, k) => one.posterior.forEach((value, j) => near(value, posterior[k][j], 1e-3)));
  assert.deepEqual([...read[1].posterior], [...read[2].posterior]); // to the last bit
  assert.deepEqual([read[0], read[3]].map((one) => one.posterior.at(-1)), [0, 1]); // "outside"
  assert.equal(noticed[4], -1);
  const unsure = posterior[1].filter((value) => value > 0.05 && value < 0.95);
  assert.ok(unsure.length > 20);
});

test("what of a touch lies outside the training is said in the words of feeler", () => {
  const { taught, wishes } = given.decoder;
  for (const [wish, words] of wishes) assert.deepEqual(findOutside(taught.range, wish), words);
  assert.deepEqual(wishes.map(([, words]) => words.length), [0, 0, 2, 1, 2, 1, 1]);
});

test("the page's own engine gives feeler's angles without friction, with little and with much", () => {
  const { config, touches } = given.host, slippery = touches.slice(-3);
  assert.deepEqual(slippery.map(({ wish }) => wish.friction), [0, 0.4, 2.5]);
  for (const { wish, angle } of slippery) {
    const found = [], host = new Host(config, (header, arrays) => { if (header.part === "piece") found.push(...arrays.angle.data); });
    host.take({ type: "touch", slot: "A", id: 1, wish });
    while (host.work(50) >= 0);
    assert.ok(angle.flat().some((value) => Math.abs(value) > 1e-3));
    angle.flat().forEach((value, k) => near(found[k], value, 2e-7));
  }
});

test("another gradient keeps total compliance and damping over stiffness, and the own one keeps all", () => {
  const n = 9, own = Float64Array.from({ length: 16 * n }, (_, k) => 1 + k), rate = -0.3;
  for (let k = 0; k < n; k++) { own[3 * n + k] = 5 * Math.exp(-0.1 * k); own[4 * n + k] = 0.2 + k; }
  const found = grade(own, rate), sum = (rows) => rows.slice(3 * n, 4 * n).reduce((total, k) => total + 1 / k, 0);
  near(sum(found), sum(own), 1e-12);
  for (let k = 0; k < n; k++) near(found[4 * n + k] / found[3 * n + k], own[4 * n + k] / own[3 * n + k], 1e-12);
  for (let k = 1; k < n; k++) near(Math.log(found[3 * n + k] / found[3 * n + k - 1]), rate, 1e-12);
  grade(own, -0.1).forEach((value, k) => near(value, own[k], 1e-12));
});

test("accuracy of the ideal observer: certain without noise, Φ(d/2σ) for two, chance for identical touches", () => {
  const products = (rows) => rows.flatMap((a) => rows.map((b) => a.reduce((sum, value, k) => sum + value * b[k], 0)));
  const two = products([[1, 0, 0.5], [-1, 0, 0.5]]); // 2 apart
  assert.equal(computeAccuracy(two, [1e-6, 1e-6], 5), 1);
  near(computeAccuracy(two, [1, 1], 4000), 0.8413, 0.015);
  near(computeAccuracy(two, [0.5, 2], 4000), (0.9772 + 0.6915) / 2, 0.015);
  near(computeAccuracy(products([[1, 2], [1, 2], [1, 2]]), [1, 1, 1], 1000), 1 / 3, 0.03);
});

test("noise is standard normal, white, and follows from its numbers", () => {
  const all = Array.from({ length: 40_000 }, (_, k) => drawNormal(7, k % 200, Math.floor(k / 200))), mean = (of) => of.reduce((a, b) => a + b, 0) / of.length;
  near(mean(all), 0, 0.02);
  near(mean(all.map((x) => x * x)), 1, 0.03);
  for (const lag of [1, 200]) near(mean(all.slice(lag).map((x, k) => x * all[k])), 0, 0.02);
  assert.equal(drawNormal(7, 3, 4), all[4 * 200 + 3]);
});

test("a blind round has five touches of each antenna, within what the decoder was trained on, and another seed gives others", () => {
  const range = { location: [0.45, 0.95], size: [1.2, 3.5], approach: 90, friction: 1 }, taught = { kept: [[{ range }], [{ range }]] };
  const config = { antennas: ["graded", "uniform"].map((name) => ({ name, wish: { name } })), speeds: [{ value: 0.06 }, { value: 0.6 }], taught, state: { touch: { lead: 5 } } };
  const round = drawRound(config, 160);
  assert.deepEqual(round.map((one) => one.which), [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
  for (const { touch } of round) {
    assert.ok(touch.location >= 0.45 && touch.location <= 0.95 && touch.size >= 1.2 && touch.size <= 3.5 && touch.speed === 0.06);
    assert.ok(["ball", "box", "triangle"].includes(touch.kind));
  }
  assert.equal(new Set(round.map(({ touch }) => touch.seed)).size, 10);
  assert.notDeepEqual(drawRound(config, 176), round);
});

test("the resting level follows a slow drift, and contact is the third sample in a row beyond it", () => {
  const felt = Array.from({ length: 900 }, (_, k) => (k < 300 ? 0 : 0.003)); // 0.003 is below the onset
  const { at, level } = findOnset({ n: 1, samples: 904, data: Float64Array.from([...felt, 0.5, 0.5, 0.5, 0.5]) }, 0.004);
  assert.equal(at, 902);
  near(level[0], 0.003 * (1 - (1 - 1 / 300) ** 600), 1e-6); // as a mean over 300 samples that fades
  assert.equal(findOnset({ n: 1, samples: 903, data: Float64Array.from([...felt, 0.5, 0.5, 0.003]) }, 0.004).at, -1);
  assert.equal(findOnset({ n: 1, samples: 906, data: Float64Array.from([...felt, 0.5, 0.5, 0.003, 0.5, 0.5, 0.003]) }, 0.004).at, -1); // none of four is the third in a row
});

/** @param {number} [seed] */
function hear(seed) {
  const nerve = new Nerve(3, 0.7, 30, seed), rates = given.nerve.bent.map((row) => { nerve.push((s) => row[s]); return [...nerve.rate]; });
  return { nerve, rates };
}

test("sensilla answer as those of feeler.spikes", () => {
  assert.deepEqual(SENSILLUM, given.nerve.sensillum);
  const { rates, nerve } = hear();
  assert.ok(nerve.greatest > 50);
  rates.forEach((row, k) => row.forEach((rate, unit) => near(rate, given.nerve.rates[k][unit], 1e-9)));
});

test("spikes are as many as the rates say, in their order and place, and the same again", () => {
  const expected = Array.from({ length: 6 }, (_, unit) => given.nerve.rates.reduce((sum, row) => sum + row[unit] * 0.7e-3, 0));
  const counts = new Array(6).fill(0), runs = 400;
  for (let seed = 1; seed <= runs; seed++)
    for (const { unit, time } of hear(7919 * seed).nerve.spikes) {
      counts[unit] += 1 / runs;
      assert.ok(given.nerve.rates[Math.ceil(time / 0.7 - 1e-9)][unit] > 0, "a spike where the rate is 0");
    }
  counts.forEach((count, unit) => assert.ok(Math.abs(count - expected[unit]) <= 5 * Math.sqrt(expected[unit] / runs), `${count} is not ${expected[unit]}`));
  assert.ok(Math.min(...expected) > 0.5);
  assert.deepEqual(hear().nerve.spikes, hear().nerve.spikes);
  const busy = new Nerve(1, 20, 30); // several spikes within a sample
  for (const bend of [0, 0.05, 0.1, 0.1, 0.1]) busy.push(() => bend);
  const times = busy.spikes.filter(({ unit }) => unit === 0).map(({ time }) => time);
  assert.ok(times.length > 8);
  times.slice(1).forEach((time, k) => assert.ok(time > times[k], "spikes run backwards"));
  const lost = new Nerve(1, 1, 30);
  for (const bend of [0, 0.02, NaN, 0.02]) lost.push(() => bend);
  assert.ok(Number.isFinite(lost.rate[0]));
  assert.equal(lost.coarse, false);
  lost.push(() => 3);
  assert.equal(lost.coarse, true);
});
