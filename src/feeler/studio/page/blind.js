// @ts-check
import { findDecision } from "./charts.js";
import { make, makePanel, show } from "./dom.js";
import { drawUniform } from "./noise.js";
/** @typedef {import("./studio.js").App} App */
/** A blind round: the object is hidden, you say what touched, then the decoder does; half of the touches with each antenna. */

const ROUND = 10, ANSWERS = ["ball", "box", "triangle"];

/**
 * The touches of a round: an antenna each, and a random object, location and size within what its decoder was trained on.
 * @param {any} config @param {number} seed
 */
export function drawRound({ antennas, speeds, taught, state }, seed) {
  const speed = speeds[0].value;
  return Array.from({ length: ROUND }, (_, k) => {
    const which = k < ROUND / 2 ? 0 : antennas.length - 1, { range } = taught.kept[which][0];
    const between = (/** @type {number[]} */ [low, high], /** @type {number} */ what) => Number((low + (high - low) * drawUniform(seed, k, what)).toPrecision(3));
    const kind = ANSWERS[Math.floor(ANSWERS.length * drawUniform(seed, k, 3))];
    const touch = { ...state.touch, kind, objects: [], side: "left", approach: range.approach, friction: range.friction, speed,
      location: between(range.location, 4), size: between(range.size, 5), seed: seed + k };
    return { which, name: antennas[which].name, A: antennas[which].wish, touch };
  });
}

/** @param {any} config */
export function makeBlindPanel(config) {
  const possible = config.taught && config.taught.kept.every((/** @type {any} */ row) => row[0]);
  return (/** @type {App} */ app) => {
    /** @type {any} */
    let round = null;
    const words = make("p", { role: "status" }), score = make("table", { class: "tally" }), go = make("button", { type: "button", class: "plain strong", onclick: next });
    const buttons = ANSWERS.map((kind) => make("button", { type: "button", class: "plain guess", text: kind, onclick: () => answer(kind) }));
    const choice = make("div", { class: "row" }, ...buttons);
    const noise = possible ? ((180 * config.taught.noise) / Math.PI).toFixed(2) : "";
    const about = make("p", { class: "caption", text: `Five slow touches of each antenna, by a ball, box or triangle of random size at a random location. You and the decoder read the same tensor, with white noise of ${noise}° (SD).` });
    const element = makePanel("Blind round", "blind-panel", words, choice, go, score, about);

    function next() {
      if (!round || round.done) round = { touches: drawRound(config, Math.floor(1e6 * Math.random()) * 16), at: -1, mine: [], its: [], done: false };
      round.at += 1;
      round.done = round.at >= ROUND;
      if (round.done) {
        app.hidden = false;
        app.store.change((s) => Object.assign(s, { A: config.state.A, touch: structuredClone(config.state.touch) }));
        return;
      }
      const { A, touch } = round.touches[round.at];
      app.hidden = true;
      app.store.change((s) => Object.assign(s, { mode: "touch", A, B: null, touch }));
      app.play(true);
    }
    /** @param {string} kind */
    function answer(kind) {
      round.mine[round.at] = kind;
      app.refresh();
    }
    /** What the decoder made of the whole touch; empty until it has read it. */
    function findAnswer() {
      const { reading, ended } = app.records.A, study = app.studies.A;
      return ended && reading && !reading.old && study && !app.isStale() ? findDecision(reading, study).best || "nothing" : "";
    }
    /** A touch that was changed by hand ends the round. */
    function isOwn() {
      if (round.done) return true;
      const { A, touch } = round.touches[round.at], { state } = app.store;
      return state.mode === "touch" && JSON.stringify([state.A, state.touch]) === JSON.stringify([A, touch]);
    }
    function update() {
      if (round && !round.done && !isOwn()) { round = null; app.hidden = false; app.refresh(); }
      const on = round && !round.done, mine = on && round.mine[round.at];
      if (mine && !round.its[round.at]) round.its[round.at] = findAnswer();
      const its = on && round.its[round.at], shown = Boolean(mine && its);
      if (shown && app.hidden) { app.hidden = false; app.refresh(); }
      show(choice, Boolean(on && !mine));
      show(go, !on || shown);
      show(about, !on);
      go.textContent = on ? (round.at + 1 < ROUND ? "Next touch" : "Result") : round ? "Another round" : "Start";
      words.textContent = on ? say(mine, its) : round ? "Touches identified correctly, of five:" : "Can you tell what touched, from the tensor alone?";
      writeScore();
    }
    /** @param {string} mine @param {string} its */
    function say(mine, its) {
      const { name, touch } = round.touches[round.at], first = `Touch ${round.at + 1} of ${ROUND}, ${name} antenna. `;
      if (!mine) return `${first}What touched?`;
      if (!its) return `${first}You say ${mine}. The decoder still reads the touch.`;
      return `${first}It was a ${touch.kind}. You: ${mine}. Decoder: ${its}.`;
    }
    function writeScore() {
      show(score, Boolean(round && round.done));
      if (!round || !round.done) return;
      const count = (/** @type {string[]} */ given, /** @type {number} */ a) => given.filter((one, k) => round.touches[k].which === a && one === round.touches[k].touch.kind).length;
      const numbers = [...new Set(round.touches.map((/** @type {any} */ one) => one.which))];
      score.replaceChildren(make("tr", {}, make("td"), ...["you", "decoder"].map((text) => make("th", { scope: "col", text }))),
        ...numbers.map((a) => make("tr", {}, make("th", { scope: "row", text: config.antennas[a].name }),
          ...[round.mine, round.its].map((given) => make("td", { text: `${count(given, a)} of ${ROUND / 2}` })))));
    }
    return { element, place: "right", isShown: () => Boolean(possible), update };
  };
}
