// @ts-check
/** Small things that every panel is made of. They know nothing of antennae. */

/**
 * An element with properties, event listeners (`onclick`), attributes and children.
 * @param {string} tag @param {Object<string, any>} [given] @param {...(Node|string|null|undefined|false)} children
 * @returns {any}
 */
export function make(tag, given = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.className = value;
    else if (name === "text") element.textContent = value;
    else if (name in element && !name.includes("-") && name !== "list") /** @type {any} */ (element)[name] = value;
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child) element.append(child);
  return element;
}

/** Show or hide. @param {HTMLElement} element @param {boolean} wanted */
export function show(element, wanted) {
  element.hidden = !wanted;
}

/** A whole number as an exponent. @param {number} power */
export function raise(power) {
  return String(power).replace(/[-\d]/g, (d) => (d === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(d)]));
}

/** A number with three digits, and words for units. @param {number} value @param {number} [digits] */
export function write(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) {
    const [digitsPart, power] = value.toExponential(digits - 1).split("e");
    return `${Number(digitsPart)}·10${raise(Number(power))}`;
  }
  return String(Number(value.toPrecision(digits)));
}

/**
 * A canvas as sharp as the screen; `draw(context, width, height)` is called in CSS pixels whenever it has to be.
 * @param {Object<string, any>} given @param {(c: CanvasRenderingContext2D, w: number, h: number) => void} draw
 */
export function makeCanvas(given, draw) {
  const canvas = /** @type {HTMLCanvasElement} */ (make("canvas", given));
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const redraw = () => {
    const width = canvas.clientWidth, height = canvas.clientHeight, ratio = window.devicePixelRatio || 1;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    draw(context, width, height);
  };
  new ResizeObserver(() => redraw()).observe(canvas);
  return { canvas, redraw };
}

/** The upright line of the moment that is shown. @param {CanvasRenderingContext2D} c @param {string} colour @param {number} x @param {number} top @param {number} bottom */
export function drawMoment(c, colour, x, top, bottom) {
  c.strokeStyle = colour;
  c.lineWidth = 1.5;
  c.beginPath();
  c.moveTo(x, top);
  c.lineTo(x, bottom);
  c.stroke();
}

/** A finger on a grip drags it; anywhere else it scrolls the page. @param {HTMLCanvasElement} canvas @param {(at: any) => any} find */
export function keepGrips(canvas, find) {
  canvas.addEventListener("touchstart", (event) => {
    const found = find(event.touches[0]);
    if (found !== undefined && found !== null && found !== -1) event.preventDefault();
  }, { passive: false });
}

/** Where the pointer is in an element, in CSS pixels. @param {MouseEvent} event @param {HTMLElement} element */
export function findPointer(event, element) {
  const box = element.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

/**
 * A labelled slider; logarithmic where `log` is set.
 * @param {{label: string, min: number, max: number, log?: boolean, step?: number, unit?: string, tag?: string,
 *   read: () => number, take: (value: number, done: boolean) => void, say?: (value: number) => string, marks?: number[]}} it
 */
export function makeSlider(it) {
  const to = (/** @type {number} */ v) => (it.log ? Math.log10(v) : v);
  const from = (/** @type {number} */ v) => (it.log ? Number((10 ** v).toPrecision(3)) : Number(v.toPrecision(6)));
  const shown = make("output", { class: "value" });
  const input = make("input", {
    type: "range", min: to(it.min), max: to(it.max), step: it.log ? 0.001 : it.step || 0.01, "aria-label": it.label,
    oninput: () => { it.take(from(Number(input.value)), false); },
    onchange: () => { it.take(from(Number(input.value)), true); },
  });
  const marks = make("div", { class: "marks", "aria-hidden": "true" });
  for (const mark of it.marks || []) {
    const place = make("i");
    place.style.left = `${(100 * (to(mark) - to(it.min))) / (to(it.max) - to(it.min))}%`;
    marks.append(place);
  }
  const element = make("div", { class: "slider", "data-tag": it.tag },
    make("span", { class: "name", text: it.label }), shown, input, marks);
  const update = () => {
    const value = it.read();
    if (document.activeElement !== input || Math.abs(to(value) - Number(input.value)) > 0.002) input.value = String(to(value));
    shown.textContent = it.say ? it.say(value) : `${write(value)}${it.unit ? " " + it.unit : ""}`;
    input.setAttribute("aria-valuetext", shown.textContent);
  };
  return { element, update };
}

/**
 * Buttons of which one is pressed.
 * @param {string} label @param {[string, string|Node, string?][]} choices
 * @param {() => string} read @param {(v: string) => void} take
 */
export function makeChoice(label, choices, read, take) {
  const buttons = choices.map(([value, face, title]) => make("button", {
    type: "button", class: "chip", title: title || null, "aria-label": typeof face === "string" ? null : title || value,
    onclick: () => take(value),
  }, face));
  const element = make("div", { class: "choice", role: "group", "aria-label": label }, ...buttons);
  const update = () => buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(choices[k][0] === read())));
  return { element, update };
}

/** A titled section. @param {string} title @param {string} name @param {...(Node|null)} children @returns {HTMLElement} */
export function makePanel(title, name, ...children) {
  return make("section", { class: `panel ${name}`, "aria-label": title }, make("h2", { text: title }), ...children);
}

/** A word to screen readers. @param {HTMLElement} root @param {string} words */
export function announce(root, words) {
  const line = root.querySelector(".announce");
  if (line) line.textContent = words;
}
