// @ts-check
import { KIND_COLOURS, SLOT_COLOURS } from "./colours.js";
import { make, makeChoice, makePanel, makeSlider, show, write } from "./dom.js";
import { findHandles, makeEditor, readCurve, sumCompliance } from "./editor.js";
import { leavePlane } from "./state.js";
import { findTag } from "./tags.js";
/** @typedef {import("./studio.js").App} App */
/** @typedef {import("./panels.js").Panel} Panel */
/** Panels of controls: what antenna, what touch. */

const SHAPES = {
  ball: "M12 4a8 8 0 1 0 .01 0z",
  box: "M4.5 4.5h15v15h-15z",
  triangle: "M12 19.5L3.5 5h17z",
  wall: "M2 3h20v18h-20z",
};

/** @param {string} kind */
export function makeIcon(kind) {
  const space = "http://www.w3.org/2000/svg", svg = document.createElementNS(space, "svg"), path = document.createElementNS(space, "path");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", SHAPES[/** @type {"ball"} */ (kind)]);
  path.style.fill = KIND_COLOURS[/** @type {"ball"} */ (kind)];
  svg.append(path);
  return svg;
}

/** @param {App} app */
export function makeAntennaPanel(app) {
  const editor = makeEditor(app);
  const wish = () => app.store.state[app.slot] || app.store.state.A;
  const change = (/** @type {(one: any) => void} */ how, done = true) => app.store.change((/** @type {any} */ s) => how(s[app.slot] || s.A), done);
  const slots = makeChoice("Antenna", [["A", "A"], ["B", "B"]], () => app.slot, (slot) => {
    if (slot === "B" && !app.store.state.B) app.store.change((/** @type {any} */ s) => { s.B = { preset: s.A.preset === "exponential" ? "matched" : "exponential" }; });
    app.slot = slot;
    app.draw();
  });
  const drop = make("button", { type: "button", class: "plain small", text: "hide B", onclick: () => {
    app.slot = "A";
    app.store.change((/** @type {any} */ s) => { s.B = null; });
  } });
  const swap = make("button", { type: "button", class: "plain small", text: "swap", onclick: () => app.store.change((/** @type {any} */ s) => { [s.A, s.B] = [s.B, s.A]; }) });
  const presets = make("select", { "aria-label": "Preset", onchange: () => {
    const spatial = Boolean(app.catalogue.presets[presets.value].planes);
    if (spatial) app.slot = "A";
    app.store.change((/** @type {any} */ s) => {
      if (spatial) leavePlane(s);
      const one = s[app.slot] || s.A;
      for (const key of Object.keys(one)) delete one[key];
      one.preset = presets.value;
    });
  } });
  const inSpace = make("p", { class: "caption", text: "An antenna in space: drag its picture to turn it. By hand, own antenna, antenna B, "
    + "further objects, handles, spikes and the reading stay in the plane and are switched off." });
  const quantity = makeChoice("Quantity that the handles change", [["stiffness", "Stiffness"], ["damping", "Damping"]], () => app.editing, (value) => { app.editing = value; app.draw(); });
  const unit = make("span", { class: "unit" });
  const gradient = makeSlider({
    label: "Stiffness gradient", min: 0, max: 6, step: 0.05, say: (v) => (v < 0.03 ? "uniform" : `base ${write(10 ** v, 2)} × tip`),
    read: () => {
      const handles = findHandles(wish(), app.findOriginal(app.slot), "stiffness");
      return Math.max(0, Math.log10(handles[0][1] / handles[handles.length - 1][1]));
    },
    take: (value, done) => change((one) => tilt(one, value), done),
  });
  const length = makeSlider({ label: "Length", min: 10, max: 120, log: true, unit: "mm", tag: "length",
    read: () => wish().length || (app.findOriginal(app.slot) || { length: 42 }).length, take: (v, done) => change((one) => { one.length = v; }, done) });
  const sensors = makeSlider({ label: "Sensors", min: 1, max: 140, step: 1, tag: "n_sensors",
    read: () => wish().sensors || (app.findOriginal(app.slot) || { sensors: [] }).sensors.length, say: (v) => String(Math.round(v)),
    take: (v, done) => change((one) => { one.sensors = Math.round(v); }, done) });
  const matched = make("input", { type: "checkbox", onchange: () => change((one) => { one.matched = matched.checked; }) });
  const reset = make("button", { type: "button", class: "plain small", text: "reset to the preset", title: "undo all changes of this antenna",
    onclick: () => change((one) => { for (const key of Object.keys(one)) if (key !== "preset" && key !== "toml") delete one[key]; }) });
  const facts = make("dl", { class: "facts" });

  /** Tilt the logarithm about its middle; a level antenna keeps its compliance. @param {any} one @param {number} decades */
  function tilt(one, decades) {
    const handles = findHandles(one, app.findOriginal(app.slot), "stiffness").map((pair) => [...pair]);
    const now = Math.log10(handles[0][1] / handles[handles.length - 1][1]);
    const middle = (Math.log10(handles[0][1]) + Math.log10(handles[handles.length - 1][1])) / 2;
    for (const pair of handles) {
      const line = middle + (0.5 - pair[0]) * now, off = now > 0.05 ? Math.log10(pair[1]) - line : 0;
      pair[1] = Number((10 ** (middle + (0.5 - pair[0]) * decades + off * (now > 0.05 ? decades / now : 0))).toPrecision(4));
    }
    one.stiffness = handles;
    one.matched = true;
  }

  function update() {
    const names = Object.keys(app.catalogue ? app.catalogue.presets : {}), one = wish();
    if (presets.options.length !== names.length + 1) {
      presets.replaceChildren(...names.map((name) => make("option", { value: name, text: name })), make("option", { value: "", text: "from a file", disabled: true }));
    }
    presets.value = one.toml ? "" : one.preset || "exponential";
    slots.update();
    quantity.update();
    const spatial = app.isSpatial();
    show(inSpace, spatial);
    for (const part of planar) show(part, !spatial);
    slots.element.children[1].disabled = spatial;
    show(drop, Boolean(app.store.state.B));
    show(swap, Boolean(app.store.state.B));
    unit.textContent = app.editing === "stiffness" ? "N·mm/rad" : "N·mm·ms/rad";
    for (const slider of [gradient, length, sensors]) slider.update();
    length.element.dataset.tag = findTag(one, "length", 0);
    sensors.element.dataset.tag = findTag(one, "sensors", 0);
    matched.checked = Boolean(one.matched);
    show(reset, Boolean(one.stiffness || one.damping || one.length || one.sensors));
    element.style.setProperty("--slot", SLOT_COLOURS[/** @type {"A"} */ (app.slot)]);
    if (!spatial) editor.redraw();
    sayFacts(one);
  }

  /** @param {any} one */
  function sayFacts(one) {
    const first = app.findOriginal(app.slot);
    if (!first) return;
    const k = readCurve(one, first, "stiffness"), mode = app.records[app.slot].mode;
    const towards = first.planes ? ", towards x" : "";
    const rows = [
      [`stiffest${towards}`, `${write(Math.max(...k))} N·mm/rad`, findTag(one, "stiffness", 0)],
      [`softest${towards}`, `${write(Math.min(...k))} N·mm/rad`, findTag(one, "stiffness", 1)],
      [`compliance Σ 1/k${towards}`, `${write(sumCompliance(k))} rad/(N·mm)`, "derived"],
      ["first mode, damped", mode ? (mode.frequency ? `${write(mode.frequency * 1e3)} Hz` : "does not swing") : "–", "derived"],
      ["damping ratio", mode ? write(mode.damping_ratio) : "–", "derived"],
    ];
    const text = rows.flat().join();
    if (facts.dataset.now === text) return;
    facts.dataset.now = text;
    facts.replaceChildren(...rows.flatMap(([name, value, tag]) => [make("dt", { text: name }), make("dd", { text: value, "data-tag": tag, tabindex: "0" })]));
  }

  const handles = make("div", { class: "row spread" }, quantity.element, unit), keep = make("label", { class: "check" }, matched, "keep the total compliance Σ 1/k");
  const planar = [editor.element, gradient.element, handles, keep];
  const element = makePanel("Antenna", "antenna-panel",
    make("div", { class: "row" }, slots.element, presets), inSpace,
    make("div", { class: "row beside" }, swap, drop),
    editor.element, gradient.element, reset,
    make("details", {}, make("summary", { text: "Advanced" }), handles, keep, length.element, sensors.element, facts));
  return /** @type {Panel} */ ({ element, place: "left", isShown: () => true, update });
}

/** @param {App} app */
export function makeTouchPanel(app) {
  const touch = () => app.store.state.touch;
  const set = (/** @type {string} */ name, /** @type {any} */ value, done = true) => app.store.change((/** @type {any} */ s) => { s.touch[name] = value; }, done);
  const kinds = makeChoice("Object", /** @type {any} */ (Object.keys(SHAPES).map((kind) => [kind, makeIcon(kind), kind])), () => touch().kind, (kind) => set("kind", kind));
  const side = makeChoice("Side it comes from", [["left", "↓", "from above in the picture (the antenna's left)"], ["right", "↑", "from below in the picture (the antenna's right)"]], () => touch().side, (value) => set("side", value));
  const slide = (/** @type {string} */ name, /** @type {any} */ more) => makeSlider({ ...more, read: () => touch()[name], take: (v, done) => set(name, v, done) });
  const sliders = [
    slide("size", { label: "Size", min: 0.3, max: 8, log: true, say: (/** @type {number} */ v) => `${touch().kind === "ball" ? "radius" : "half-width"} ${write(v)} mm`, tag: "size", marks: [1.5, 3] }),
    slide("location", { label: "Place", min: 0.05, max: 1, step: 0.005, say: (/** @type {number} */ v) => `${write(v, 3)} of the length`, marks: [0.5, 0.6, 0.7, 0.8, 0.9], tag: "location" }),
    slide("speed", { label: "Speed", min: 0.02, max: 1, log: true, unit: "m/s", marks: [0.06, 0.3, 0.6], tag: "speed" }),
  ];
  const others = [
    slide("approach", { label: "Approach", min: 30, max: 150, step: 1, unit: "°", tag: "own" }),
    slide("friction", { label: "Friction", min: 0, max: 2, step: 0.05, tag: "friction" }),
    slide("duration", { label: "Recorded time", min: 60, max: 1000, step: 10, unit: "ms", tag: "duration" }),
  ];
  const azimuth = slide("azimuth", { label: "Azimuth", min: -180, max: 180, step: 5, unit: "°", tag: "own" });
  const list = make("ul", { class: "objects" });
  const add = make("button", { type: "button", class: "plain small", text: "+ another object", onclick: () => app.addObject() });
  const more = make("details", {}, make("summary", { text: "Advanced" }), ...others.map((it) => it.element));

  function update() {
    kinds.update();
    side.update();
    for (const slider of [...sliders, azimuth, ...others]) slider.update();
    show(azimuth.element, app.isSpatial());
    sliders[0].element.classList.toggle("off", touch().kind === "wall");
    list.replaceChildren(...touch().objects.map((/** @type {any} */ item, /** @type {number} */ k) => {
      const kind = make("select", { "aria-label": `Shape of object ${k + 2}`, onchange: () => app.store.change((/** @type {any} */ s) => { s.touch.objects[k].kind = kind.value; }) },
        ...Object.keys(SHAPES).map((name) => make("option", { value: name, text: name, selected: name === item.kind })));
      return make("li", {}, kind, make("span", { text: `${write(item.size, 2)} mm` }),
        make("button", { type: "button", class: "plain small", "aria-label": `Turn object ${k + 2} by 15 degrees`, text: "↻", onclick: () => app.store.change((/** @type {any} */ s) => { s.touch.objects[k].heading = ((s.touch.objects[k].heading + 195) % 360) - 180; }) }),
        make("button", { type: "button", class: "plain small", "aria-label": `Take object ${k + 2} away`, text: "×", onclick: () => app.removeObject(k) }));
    }));
    show(add, touch().objects.length < 8 && !app.isSpatial());
  }
  const element = makePanel("Touch", "touch-panel", make("div", { class: "row" }, kinds.element, side.element),
    ...sliders.map((it) => it.element), azimuth.element, list, add, more);
  return /** @type {Panel} */ ({ element, place: "left", isShown: () => app.store.state.mode !== "board", update });
}
