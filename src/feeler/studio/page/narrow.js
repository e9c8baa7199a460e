// @ts-check
/**
 * Where the capsules of a chain touch convex parts, as feeler.physics.chain.contact finds it: in the object's own frame, with
 * `put(x, y, nx, ny, distance)` for every contact. A part is {kind, corners: [x, y, x, y, …], box: [low x, low y, high x, high y]}.
 */

const LEAST = 1e-15; // MuJoCo's mjMINVAL

/** @typedef {(x: number, y: number, nx: number, ny: number, distance: number) => void} Put */

/**
 * Contacts of one segment from (px, py) along (ex, ey).
 * @param {{parts: any[], rounding: number}} shape @param {number} px @param {number} py @param {number} ex @param {number} ey
 * @param {number} radius @param {Put} put
 */
export function touchParts(shape, px, py, ex, ey, radius, put) {
  const lowX = Math.min(px, px + ex), highX = Math.max(px, px + ex), lowY = Math.min(py, py + ey), highY = Math.max(py, py + ey);
  for (const part of shape.parts) {
    const box = part.box;
    if (lowX > box[2] + radius || highX < box[0] - radius || lowY > box[3] + radius || highY < box[1] - radius) continue;
    if (part.kind === "ball") touchBall(px, py, ex, ey, radius, part.corners[0], part.corners[1], shape.rounding, put);
    else if (part.kind === "box") touchBox(px, py, ex, ey, radius, shape.rounding, part.corners, put);
    else touchPolygon(px, py, ex, ey, radius, shape.rounding, part.corners, put);
  }
}

/** @param {number} value @param {number} low @param {number} high */
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/**
 * Closest point of the segment to the ball's centre.
 * @param {number} px @param {number} py @param {number} ex @param {number} ey @param {number} radius
 * @param {number} bx @param {number} by @param {number} ball @param {Put} put
 */
function touchBall(px, py, ex, ey, radius, bx, by, ball, put) {
  const t = clamp(((bx - px) * ex + (by - py) * ey) / (ex * ex + ey * ey), 0, 1);
  const dx = px + t * ex - bx, dy = py + t * ey - by, centre = Math.sqrt(dx * dx + dy * dy), distance = centre - ball - radius;
  if (distance >= 0) return;
  const nx = centre > LEAST ? dx / centre : 1, ny = centre > LEAST ? dy / centre : 0, reach = ball + 0.5 * distance;
  put(bx + reach * nx, by + reach * ny, nx, ny, distance);
}

/**
 * MuJoCo's capsule–box test in the plane: the closest point of the core, and a sensible second one.
 * @param {number} px @param {number} py @param {number} ex @param {number} ey @param {number} radius @param {number} grown
 * @param {number[]} k Corners, counter-clockwise from the lower one of the leading face. @param {Put} put
 */
function touchBox(px, py, ex, ey, radius, grown, k, put) {
  const sx = 0.5 * (k[2] - k[4]), sy = 0.5 * (k[3] - k[1]), mx = 0.5 * (k[2] + k[4]), my = 0.5 * (k[3] + k[1]);
  const hx = -0.5 * ex, hy = -0.5 * ey, x = px - hx - mx, y = py - hy - my;
  const beside = Math.abs(x * hy - y * hx), width = sx * Math.abs(hy) + sy * Math.abs(hx);
  if (beside > width && (beside - width) ** 2 > (radius + grown) ** 2 * (hx * hx + hy * hy) * (1 + 1e-12)) return;
  const [first, second] = findBoxPoints(x, y, hx, hy, sx, sy);
  touchBoxSphere(x + first * hx, y + first * hy, radius, grown, sx, sy, mx, my, put);
  if (second > -3) touchBoxSphere(x + (first + second) * hx, y + (first + second) * hy, radius, grown, sx, sy, mx, my, put);
}

/**
 * Position of the closest point of the core, and how much further along the core the second lies (−4: none).
 * @param {number} x @param {number} y @param {number} hx @param {number} hy @param {number} sx @param {number} sy
 */
function findBoxPoints(x, y, hx, hy, sx, sy) {
  let best = Infinity, first = 0, face = -1, corner = -1, atEnd = 0;
  for (const end of [-1, 1]) {
    const ox = Math.max(Math.abs(x + end * hx) - sx, 0), oy = Math.max(Math.abs(y + end * hy) - sy, 0), square = ox * ox + oy * oy;
    if ((ox > 0 && oy > 0) || square >= best) continue;
    best = square;
    first = atEnd = end;
    face = ox > 0 ? 0 : oy > 0 ? 1 : -1;
  }
  const core = hx * hx + hy * hy;
  for (let k = 0; k < 4; k++) {
    const kx = k & 1 ? sx : -sx, ky = k & 2 ? sy : -sy, t = clamp(((kx - x) * hx + (ky - y) * hy) / core, -1, 1);
    const dx = kx - x - t * hx, dy = ky - y - t * hy, square = dx * dx + dy * dy;
    if (square < best - LEAST) { best = square; first = t; corner = k; }
  }
  if (corner >= 0) return [first, findSecondFromCorner(first, corner, hx, hy, sx, sy)];
  return [first, face < 0 ? -4 : findSecondFromFace(x, y, hx, hy, sx, sy, atEnd, face)];
}

/** @param {number} first @param {number} corner @param {number} hx @param {number} hy @param {number} sx @param {number} sy */
function findSecondFromCorner(first, corner, hx, hy, sx, sy) {
  const across = Number(hx > 0 !== ((corner & 1) !== 0)) + 2 * Number(hy > 0 !== ((corner & 2) !== 0));
  if (across !== 1 && across !== 2) return -4; // the core points to or from the corner
  const alongX = Math.abs(hx) > Math.abs(hy), forward = across === (alongX ? 1 : 2);
  const limit = alongX ? (2 * sx) / Math.abs(hx) : (2 * sy) / Math.abs(hy);
  const second = Math.min(forward ? 1 - first : 1 + first, limit);
  return forward ? second : -second;
}

/**
 * @param {number} x @param {number} y @param {number} hx @param {number} hy @param {number} sx @param {number} sy
 * @param {number} atEnd @param {number} face
 */
function findSecondFromFace(x, y, hx, hy, sx, sy, atEnd, face) {
  const sign = -atEnd, ex = x - sign * hx, ey = y - sign * hy;
  const [size, at, half] = face === 0 ? [sy, ey, hy] : [sx, ex, hx];
  let second = 2;
  for (const side of [size, -size]) {
    const reach = ((side - at) / half) * sign;
    if (reach > 0 && reach < second) second = reach;
  }
  return second * sign;
}

/**
 * @param {number} x @param {number} y @param {number} radius @param {number} grown @param {number} sx @param {number} sy
 * @param {number} mx @param {number} my @param {Put} put
 */
function touchBoxSphere(x, y, radius, grown, sx, sy, mx, my, put) {
  const kx = clamp(x, -sx, sx), ky = clamp(y, -sy, sy), dx = x - kx, dy = y - ky;
  const gap = Math.sqrt(dx * dx + dy * dy), depth = gap - radius - grown;
  if (depth >= 0) return;
  if (gap > LEAST) {
    const nx = dx / gap, ny = dy / gap, middle = grown + 0.5 * depth;
    put(mx + kx + middle * nx, my + ky + middle * ny, nx, ny, depth);
    return;
  }
  let best = sx + x, nx = -1, ny = 0;
  if (sx - x < best) { best = sx - x; nx = 1; ny = 0; }
  if (sy + y < best) { best = sy + y; nx = 0; ny = -1; }
  if (sy - y < best) { best = sy - y; nx = 0; ny = 1; }
  best += grown;
  const back = -0.5 * (radius - best);
  put(mx + x + back * nx, my + y + back * ny, nx, ny, -best - radius);
}

/**
 * Closest points of the core and one convex part; where the core is inside, the shallowest way out.
 * @param {number} px @param {number} py @param {number} ex @param {number} ey @param {number} radius @param {number} grown
 * @param {number[]} corners @param {Put} put
 */
function touchPolygon(px, py, ex, ey, radius, grown, corners, put) {
  let found = separate(px, py, ex, ey, radius + grown, corners);
  if (found[0] - radius - grown >= 0) return;
  if (found[0] > 0) found = findClosest(px, py, ex, ey, corners);
  const [depth, ax, ay, nx, ny] = found, distance = depth - radius - grown;
  if (distance >= 0) return;
  const reach = grown + 0.5 * distance;
  put(ax + reach * nx, ay + reach * ny, nx, ny, distance);
}

/**
 * Greatest separation along a normal of either shape, its point on the part, the normal; one beyond `clear` ends the search.
 * @param {number} px @param {number} py @param {number} ex @param {number} ey @param {number} clear @param {number[]} corners
 */
function separate(px, py, ex, ey, clear, corners) {
  const n = corners.length / 2;
  let best = -Infinity, bx = 0, by = 0, bnx = 1, bny = 0;
  for (let k = 0; k < n; k++) {
    const j = k + 1 < n ? k + 1 : 0, kx = corners[2 * k], ky = corners[2 * k + 1];
    const dx = corners[2 * j] - kx, dy = corners[2 * j + 1] - ky, length = Math.sqrt(dx * dx + dy * dy);
    const nx = dy / length, ny = -dx / length, near = nx * (px - kx) + ny * (py - ky), far = near + nx * ex + ny * ey;
    const gap = near < far ? near : far, t = near < far ? 0 : 1;
    if (gap <= best) continue;
    best = gap; bnx = nx; bny = ny;
    bx = px + t * ex - gap * nx;
    by = py + t * ey - gap * ny;
    if (gap > clear) return [best, bx, by, bnx, bny];
  }
  const length = Math.sqrt(ex * ex + ey * ey);
  for (const sign of [-1, 1]) {
    const nx = (sign * ey) / length, ny = (-sign * ex) / length;
    let deepest = -Infinity, at = 0;
    for (let k = 0; k < n; k++) {
      const reach = nx * (corners[2 * k] - px) + ny * (corners[2 * k + 1] - py);
      if (reach > deepest) { deepest = reach; at = k; }
    }
    if (-deepest > best) { best = -deepest; bnx = nx; bny = ny; bx = corners[2 * at]; by = corners[2 * at + 1]; }
  }
  return [best, bx, by, bnx, bny];
}

/**
 * Distance of two separate shapes, the closest point on the part, and the normal towards the core.
 * @param {number} px @param {number} py @param {number} ex @param {number} ey @param {number[]} corners
 */
function findClosest(px, py, ex, ey, corners) {
  const n = corners.length / 2;
  let best = Infinity, bx = 0, by = 0, cx = 0, cy = 0;
  const take = (/** @type {number} */ qx, /** @type {number} */ qy, /** @type {number} */ fx, /** @type {number} */ fy) => {
    const square = (qx - fx) ** 2 + (qy - fy) ** 2;
    if (square < best) { best = square; bx = fx; by = fy; cx = qx; cy = qy; }
  };
  for (let k = 0; k < n; k++) {
    const j = k + 1 < n ? k + 1 : 0, kx = corners[2 * k], ky = corners[2 * k + 1];
    const dx = corners[2 * j] - kx, dy = corners[2 * j + 1] - ky;
    const t = clamp(((kx - px) * ex + (ky - py) * ey) / (ex * ex + ey * ey), 0, 1);
    take(px + t * ex, py + t * ey, kx, ky);
    for (const end of [0, 1]) {
      const qx = px + end * ex, qy = py + end * ey, s = clamp(((qx - kx) * dx + (qy - ky) * dy) / (dx * dx + dy * dy), 0, 1);
      take(qx, qy, kx + s * dx, ky + s * dy);
    }
  }
  const gap = Math.sqrt(best);
  return [gap, bx, by, (cx - bx) / gap, (cy - by) / gap];
}
