// @ts-check
import { make, makeCanvas, makeChoice, makePanel, makeSlider, show, write } from "./dom.js";
import { drawNormal } from "./noise.js";
/** @typedef {import("./studio.js").App} App */
/** A living figure: accuracy against noise of an antenna whose stiffness falls as steeply as you set, from thirty touches that are computed here. */

export const GRADIENTS = [0, -0.02, -0.04, -0.06, -0.0827, -0.11, -0.15]; // per joint, at one total compliance; the fifth is the paper's
const PUBLISHED = 4, DRAWS = 60, LEVELS = 25;
const SPANS = { absolute: [1e-3, 1], relative: [0.03, 10] };

/** The lower triangle L of a symmetric matrix G = L Lᵀ, row after row. @param {ArrayLike<number>} g @param {number} n */
function factor(g, n) {
  const lower = new Float64Array(n * n);
  let most = 0;
  for (let k = 0; k < n; k++) most = Math.max(most, g[k * n + k]);
  for (let j = 0; j < n; j++)
    for (let i = j; i < n; i++) {
      let sum = g[i * n + j] + (i === j ? 1e-12 * most : 0);
      for (let k = 0; k < j; k++) sum -= lower[i * n + k] * lower[j * n + k];
      lower[i * n + j] = i === j ? Math.sqrt(Math.max(sum, 0)) : lower[j * n + j] > 0 ? sum / lower[j * n + j] : 0;
    }
  return lower;
}

/**
 * Share of noisy touches that the ideal observer in white noise, which knows each touch's tensor, identifies: the nearest tensor.
 * All that it needs of the tensors t are their products t·t′, since the noise reaches it through n·t alone.
 * @param {ArrayLike<number>} products (touch, touch) @param {ArrayLike<number>} spread SD of the noise on each touch @param {number} draws
 */
export function computeAccuracy(products, spread, draws) {
  const n = spread.length, lower = factor(products, n), given = new Float64Array(n);
  let correct = 0;
  for (let d = 0; d < draws; d++)
    for (let i = 0; i < n; i++) {
      const normal = Float64Array.from({ length: n }, (_, k) => drawNormal(d, i, k));
      for (let c = 0; c < n; c++) {
        let noise = 0;
        for (let k = 0; k <= c; k++) noise += lower[c * n + k] * normal[k];
        given[c] = products[i * n + c] + spread[i] * noise - products[c * n + c] / 2;
      }
      const best = Math.max(...given), near = given.filter((value) => value >= best - 1e-9 * Math.abs(best)).length;
      if (given[i] >= best - 1e-9 * Math.abs(best)) correct += 1 / near;
    }
  return correct / (draws * n);
}

/** Noise levels and accuracies of a family's member. @param {{products: ArrayLike<number>, peaks: number[]}} found @param {"absolute"|"relative"} kind */
function makeCurve({ products, peaks }, kind) {
  const [low, high] = SPANS[kind];
  return Array.from({ length: LEVELS }, (_, k) => {
    const noise = low * (high / low) ** (k / (LEVELS - 1));
    return [noise, computeAccuracy(products, peaks.map((peak) => noise * (kind === "relative" ? peak : 1)), DRAWS)];
  });
}

/** @param {any} config */
export function makeLivingPanel(config) {
  return (/** @type {App} */ app) => {
    /** @type {any[]} */
    const curves = GRADIENTS.map(() => null);
    let at = PUBLISHED, asked = -1, share = 0, kind = /** @type {"absolute"|"relative"} */ ("absolute");
    const { stiffness } = config.antennas[0].drawn, n = stiffness.length;
    const slider = makeSlider({ label: "Stiffness at the base over that at the tip", min: 0, max: GRADIENTS.length - 1, step: 1, read: () => at,
      take: (value) => { at = Math.round(value); ask(); }, say: (value) => `${write(Math.exp(-GRADIENTS[Math.round(value)] * (n - 1)), 2)} : 1` });
    const choice = makeChoice("Kind of noise", [["absolute", "absolute", "the same SD on every reading"], ["relative", "relative", "a share of each touch's own peak"]],
      () => kind, (value) => { kind = /** @type {"absolute"} */ (value); app.refresh(); });
    const begin = make("button", { type: "button", class: "plain strong", text: "Compute thirty touches", onclick: ask });
    const bar = make("progress", { max: 1, value: 0, "aria-label": "Touches computed" }), words = make("p", { class: "caption", role: "status" });
    const { canvas, redraw } = makeCanvas({ class: "chart living", role: "img", "aria-label": "Accuracy against noise" }, draw);
    const element = makePanel("Your gradient", "living-panel", make("div", { class: "row spread" }, choice.element), slider.element, begin, bar, canvas, words);

    function ask() {
      const missing = [at, 0].find((k) => !curves[k]); // the uniform antenna is computed too, to compare with
      if (asked < 0 && missing !== undefined) { asked = missing; share = 0; app.send({ type: "family", k: asked, rate: GRADIENTS[asked] }); }
      app.refresh();
    }
    app.takeFamily = (/** @type {any} */ header, /** @type {any} */ arrays) => {
      if (header.part === "doing") share = header.share;
      else {
        if (header.part === "end") curves[header.k] = { products: arrays.products.data, peaks: [...arrays.peaks.data] };
        asked = -1;
        if (header.part === "end") ask();
      }
    };

    /** @param {number} k */
    function find(k) {
      const one = curves[k];
      if (!one) return null;
      one[kind] ||= makeCurve(one, kind);
      return one[kind];
    }

    /** @param {CanvasRenderingContext2D} c @param {number} w @param {number} h */
    function draw(c, w, h) {
      const left = 40, bottom = 30, top = 6, wide = w - left - 10, high = h - top - bottom, [low, most] = SPANS[kind], { colours } = app;
      const x = (/** @type {number} */ noise) => left + (wide * Math.log(noise / low)) / Math.log(most / low), y = (/** @type {number} */ p) => top + high * (1 - p);
      c.font = "11px system-ui, sans-serif";
      c.fillStyle = colours.soft;
      c.strokeStyle = colours.line;
      c.textAlign = "right";
      for (const p of [0, 0.5, 1]) { line(c, [[left, y(p)], [left + wide, y(p)]]); c.fillText(`${100 * p} %`, left - 4, y(p) + 4); }
      c.textAlign = "center";
      for (const noise of [0.001, 0.01, 0.1, 1, 10]) if (noise >= low && noise <= most) c.fillText(String(noise), x(noise), h - 16);
      c.fillText(kind === "absolute" ? "noise SD on each reading [rad]" : "noise SD over the touch's own peak", left + wide / 2, h - 3);
      c.setLineDash([2, 3]);
      line(c, [[left, y(1 / 30)], [left + wide, y(1 / 30)]]); // chance
      const styles = [[0, colours.soft, [5, 3], "uniform"], [PUBLISHED, colours.ink, [], "paper's"], [at, colours.accent, [], "yours"]];
      for (const [k, colour, dash] of /** @type {any[]} */ (styles)) {
        const curve = find(k);
        if (!curve) continue;
        c.strokeStyle = colour;
        c.setLineDash(dash);
        c.lineWidth = k === at ? 2.5 : 1.5;
        line(c, curve.map((/** @type {number[]} */ [noise, p]) => [x(noise), y(p)]));
      }
      c.setLineDash([]);
      c.lineWidth = 1;
    }

    /** Noise at which half of the touches are identified. @param {number[][]} curve */
    function findHalf(curve) {
      const k = curve.findIndex(([, p]) => p < 0.5);
      if (k < 1) return NaN;
      const [[a, p], [b, q]] = [curve[k - 1], curve[k]];
      return a * (b / a) ** ((p - 0.5) / (p - q));
    }

    function update() {
      slider.update();
      choice.update();
      const any = curves.some(Boolean), now = find(at), level = find(0), unit = kind === "absolute" ? "rad" : "of the peak";
      show(begin, !any && asked < 0);
      show(bar, asked >= 0);
      show(canvas, any);
      bar.value = share;
      const half = (/** @type {number[][]|null} */ curve) => (curve ? `${write(findHalf(curve), 2)} ${unit}` : "…");
      words.textContent = any
        ? `Half of thirty slow touches are identified at a noise of ${half(now)} with your gradient (orange), ${half(level)} with uniform stiffness (dashed)${at === PUBLISHED ? "; yours is the paper's" : ""}. ` +
          `Ideal observer, ${config.state.touch.duration} ms of each touch; one total compliance, damping in proportion to stiffness; dotted: chance. A classifier that learns from few touches does worse, and held-out locations or sizes are harder.`
        : "How steep should the gradient be? Thirty touches (six objects at five locations) are computed in this page for the gradient that you set, in some seconds.";
    }
    return { element, place: "right", isShown: () => true, update, redraw };
  };
}

/** @param {CanvasRenderingContext2D} c @param {number[][]} points */
function line(c, points) {
  c.beginPath();
  points.forEach(([x, y], k) => (k ? c.lineTo(x, y) : c.moveTo(x, y)));
  c.stroke();
}
