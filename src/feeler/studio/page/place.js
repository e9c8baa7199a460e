// @ts-check
/** Where an object starts so that it touches `lead` ms after time 0: feeler.objects.trials and sweep, in closed form. */

const ROOM = 1e-12; // mm, left at the lead
const SLACK = 1e-5; // mm; planes only say what may be near

/** @typedef {[number, number]} Span Distances back along the motion between which something overlaps. */

/** Sine and cosine of degrees, exact at quarter turns. @param {number} degrees @returns {[number, number]} */
function turnDegrees(degrees) {
  const quarter = Math.round(degrees / 90), rest = ((degrees - 90 * quarter) * Math.PI) / 180, s = Math.sin(rest), c = Math.cos(rest);
  return /** @type {[number, number]} */ ([[s, c], [c, -s], [-s, -c], [-c, s]][((quarter % 4) + 4) % 4].map((x) => x + 0));
}

/** A shape of half-width 1 mm at another size. @param {any} shape @param {number} size */
export function scaleShape(shape, size) {
  const grow = (/** @type {number[]} */ values) => values.map((value) => size * value);
  return {
    ...shape, rounding: size * shape.rounding, rims: shape.rims.map((/** @type {number[][]} */ rim) => rim.map(grow)),
    parts: shape.parts.map((/** @type {any} */ part) => ({ ...part, corners: grow(part.corners), box: grow(part.box) })),
    planes: shape.planes.map((/** @type {number[]} */ [x, y, distance]) => [x, y, size * distance + SLACK]),
  };
}

/** An antenna at rest: points, and the direction of each segment. @param {{length: Float64Array, rest: Float64Array, radius: Float64Array}} c */
export function layOut({ length, rest, radius }) {
  const points = [[0, 0]], arc = [0], heading = [];
  let turn = 0;
  for (let k = 0; k < length.length; k++) {
    turn += rest[k];
    heading.push(turn);
    points.push([points[k][0] + length[k] * Math.sin(turn), points[k][1] + length[k] * Math.cos(turn)]);
    arc.push(arc[k] + length[k]);
  }
  const even = radius.every((r) => r === radius[0]) && rest.every((angle, k) => k === 0 || angle === 0);
  const capsules = even ? [[points[0], points[points.length - 1], radius[0]]]
    : heading.map((_, k) => [points[k], points[k + 1], radius[k]]); // a straight antenna of one radius counts as one segment
  return { points, arc, heading, capsules };
}

/**
 * Place, direction and velocity of an object that meets an antenna at a share of its length.
 * @param {any} rest As `layOut` gives it. @param {any} shape
 * @param {{location: number, approach: number, side: string, speed: number, lead: number}} touch
 */
export function placeObject(rest, shape, touch) {
  const arc = touch.location * rest.arc[rest.arc.length - 1];
  let n = rest.arc.findIndex((/** @type {number} */ at) => at >= arc * (1 - 1e-12)) - 1;
  n = Math.max(0, Math.min(n < 0 ? Infinity : n, rest.heading.length - 1));
  const [ax, ay] = rest.points[n], [bx, by] = rest.points[n + 1], share = (arc - rest.arc[n]) / (rest.arc[n + 1] - rest.arc[n]);
  const x = ax + share * (bx - ax), y = ay + share * (by - ay);
  const forward = turnDegrees((rest.heading[n] * 180) / Math.PI + (touch.side === "left" ? 1 : -1) * touch.approach);
  const [touching, again] = shape.unbounded ? [findFlat(rest, x, y, forward), Infinity] : findTouching(rest, shape, x, y, forward);
  const back = touching + ROOM + touch.speed * touch.lead;
  if (!(again > back)) throw new Error("The object misses the antenna, or would touch another part of it first. Move it elsewhere.");
  return { x: x - back * forward[0], y: y - back * forward[1], forward, velocity: [touch.speed * forward[0], touch.speed * forward[1]] };
}

/** How far back a face without end just touches. @param {any} rest @param {number} x @param {number} y @param {number[]} forward */
function findFlat(rest, x, y, forward) {
  const ahead = rest.capsules.flatMap((/** @type {any} */ [a, b, radius]) => [a, b].map(([px, py]) =>
    (px - x) * forward[0] + (py - y) * forward[1] - radius));
  return -Math.min(...ahead);
}

/**
 * How far back a shape just touches (where the overlap that holds distance 0 ends, or else the next one), and touches again.
 * @param {any} rest @param {any} shape @param {number} x @param {number} y @param {number[]} forward
 */
function findTouching(rest, shape, x, y, forward) {
  /** @type {Span[]} */
  const spans = [];
  const turn = (/** @type {number[]} */ [px, py]) => [-(px - x) * forward[0] - (py - y) * forward[1], (py - y) * forward[0] - (px - x) * forward[1]];
  for (const [start, end, radius] of rest.capsules)
    for (const part of shape.parts) spans.push(crossPart(turn(start), turn(end), radius + shape.rounding, part.corners));
  let touching = NaN;
  for (const [low, high] of spans) if (low <= 0 && !(high <= touching)) touching = high;
  for (let joined = true; joined;) { // overlaps that join on further back
    joined = false;
    for (const [low, high] of spans) if (low <= touching && touching < high) { touching = high; joined = true; }
  }
  const again = spans.reduce((least, [low, high]) => (high > touching ? Math.min(least, low) : least), Infinity);
  return [Number.isNaN(touching) ? Infinity : touching, Number.isNaN(touching) ? -Infinity : again];
}

/** @param {number[]} a @param {number[]} b @param {number} reach @param {number[]} corners @returns {Span} */
function crossPart(a, b, reach, corners) {
  /** @type {Span} */
  let span = [Infinity, -Infinity];
  const n = corners.length / 2, at = (/** @type {number[]} */ p, /** @type {number} */ k) => [p[0] + corners[2 * k], p[1] - corners[2 * k + 1]];
  for (let k = 0; k < n; k++) {
    const j = k + 1 < n ? k + 1 : 0;
    span = crossCapsule(at(a, k), at(b, k), reach, span);
    if (n > 1) span = crossCapsule(at(b, k), at(b, j), reach, crossCapsule(at(a, k), at(a, j), reach, span));
  }
  return span;
}

/** @param {number[]} a @param {number[]} b @param {number} radius @param {Span} span @returns {Span} */
function crossCapsule(a, b, radius, [low, high]) {
  for (const [u, w] of [a, b]) {
    if (Math.abs(w) > radius) continue;
    const half = Math.sqrt((radius - w) * (radius + w));
    low = Math.min(low, u - half);
    high = Math.max(high, u + half);
  }
  const du = b[0] - a[0], dw = b[1] - a[1];
  if (dw === 0) return [low, high];
  const share = radius / Math.sqrt(du * du + dw * dw);
  for (const sign of [-1, 1]) { // the two straight sides
    const u = a[0] + sign * dw * share, w = a[1] - sign * du * share, t = -w / dw;
    if (t < 0 || t > 1) continue;
    low = Math.min(low, u + t * du);
    high = Math.max(high, u + t * du);
  }
  return [low, high];
}
