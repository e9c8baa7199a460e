// @ts-check
/** Colours: those of the page follow light and dark, those of tensors are the same on both. */

const MAGMA = ["000004", "0b0924", "20114b", "3b0f70", "57157e", "721f81", "8c2981", "a8327d", "c43c75", "de4968", "f1605d",
  "fa7f5e", "fe9f6d", "febf84", "fddea0", "fcfdbf"];
const COOL = ["000004", "04142e", "08284f", "0b3f73", "105998", "1c76b6", "3694cb", "60b1da", "93cde7", "cbe6f2"];
const DIVERGING = ["0b4f8a", "3f86bd", "93bfdc", "dfe8ec", "f6efe6", "f4cfa8", "e5965b", "c75b28", "8a2f10"];

/** @param {string[]} stops @param {number} n */
function spread(stops, n) {
  const table = new Uint8Array(3 * n);
  for (let k = 0; k < n; k++) {
    const at = (k / (n - 1)) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2), share = at - low;
    for (let c = 0; c < 3; c++) {
      const a = parseInt(stops[low].slice(2 * c, 2 * c + 2), 16), b = parseInt(stops[low + 1].slice(2 * c, 2 * c + 2), 16);
      table[3 * k + c] = Math.round(a + share * (b - a));
    }
  }
  return table;
}

export const HOT = spread(MAGMA, 256), COLD = spread(COOL, 256), BOTH = spread(DIVERGING, 256);
export const SLOT_COLOURS = { A: "#e07b2e", B: "#2f86c4" };
export const KIND_COLOURS = { ball: "#0f8f6b", box: "#c2548f", triangle: "#c98a00", wall: "#7a7f87" };

/** Dashes of the same kinds, for who cannot discriminate these colours. @type {Object<string, number[]>} */
export const KIND_DASHES = { ball: [], box: [8, 4], triangle: [2, 3], wall: [] };

/** A colour of a table as text. @param {Uint8Array} table @param {number} share @param {number} [alpha] */
export function pick(table, share, alpha = 1) {
  const k = 3 * Math.max(0, Math.min(255, Math.round(255 * share)));
  return `rgba(${table[k]},${table[k + 1]},${table[k + 2]},${alpha})`;
}

/** The page's own colours as they are now. @param {HTMLElement} root */
export function readColours(root) {
  const style = getComputedStyle(root);
  const take = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
  return { ink: take("ink"), soft: take("soft"), line: take("line"), card: take("card"), accent: take("accent"),
    stage: take("stage"), body: take("body"), solid: take("solid"), rim: take("rim"), page: take("page"),
    dark: take("dark") === "1" };
}
