// @ts-check
/** White noise and random draws that follow from a seed alone, so that engine and page have the same. */

/** Mixes the bits of a whole number. @param {number} n */
function mix32(n) {
  let x = Math.imul(n ^ (n >>> 16), 0x7feb352d);
  x = Math.imul(x ^ (x >>> 15), 0x846ca68b);
  return (x ^ (x >>> 16)) >>> 0;
}

/** Uniform in (0, 1) from whole numbers. @param {...number} from */
export function drawUniform(...from) {
  return (from.reduce((sum, n) => mix32((sum ^ (n + 0x9e3779b9)) >>> 0), 0x1234567) + 0.5) / 4294967296;
}

/** Standard normal from whole numbers (Box and Muller). @param {...number} from */
export function drawNormal(...from) {
  return Math.sqrt(-2 * Math.log(drawUniform(...from, 1))) * Math.cos(2 * Math.PI * drawUniform(...from, 2));
}
