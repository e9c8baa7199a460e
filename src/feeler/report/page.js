"use strict";
// Tables of claims that can be filtered.
for (const box of document.querySelectorAll(".filter")) {
  const rows = [...box.nextElementSibling.querySelectorAll("tbody tr")], [pick, words] = box.querySelectorAll("select, input");
  const filter = () => {
    let shown = 0;
    for (const row of rows) {
      const fits = (!pick.value || row.dataset.verdict === pick.value) && row.textContent.toLowerCase().includes(words.value.toLowerCase());
      row.hidden = !fits;
      row.style.display = fits ? "" : "none";
      shown += fits;
    }
    box.querySelector("[role=status]").textContent = `${shown} of ${rows.length}`;
  };
  box.hidden = false;
  pick.addEventListener("input", filter);
  words.addEventListener("input", filter);
}
// Who wants no motion gets the still.
if (matchMedia("(prefers-reduced-motion: reduce)").matches)
  for (const film of document.querySelectorAll("video[autoplay]")) { film.autoplay = false; film.pause(); }
// Only what needs it can be reached to be panned by the keyboard.
const setPans = () => { for (const pan of document.querySelectorAll(".pan")) pan.tabIndex = pan.scrollWidth > pan.clientWidth ? 0 : -1; };
addEventListener("resize", setPans);
addEventListener("load", setPans);
// A link into a closed part opens it.
const reveal = () => {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  for (const inner of target.querySelectorAll(":scope > details")) inner.open = true;
  for (let one = target.closest("details"); one; one = one.parentElement.closest("details")) one.open = true;
  target.scrollIntoView();
};
addEventListener("hashchange", reveal);
addEventListener("load", reveal);
// Values under the pointer: the picture's own colours, read back through its colour scale.
const tip = document.body.appendChild(Object.assign(document.createElement("div"), { id: "tip", hidden: true }));
const read = (picture) => {
  if (!picture.pixels) {
    const canvas = Object.assign(document.createElement("canvas"), { width: picture.naturalWidth, height: picture.naturalHeight });
    picture.pixels = canvas.getContext("2d", { willReadFrequently: true });
    picture.pixels.drawImage(picture, 0, 0);
  }
  return picture.pixels;
};
const findValue = (panel, [r, g, b]) => {
  let best = -1, least = 40;
  for (let k = 0; k < panel.colours.length; k += 3) {
    const off = Math.abs(panel.colours[k] - r) + Math.abs(panel.colours[k + 1] - g) + Math.abs(panel.colours[k + 2] - b);
    if (off < least) { least = off; best = k / 3; }
  }
  return best < 0 ? null : panel.values[best];
};
const say = (picture, event) => {
  const box = picture.getBoundingClientRect(), x = (event.clientX - box.left) / box.width, y = 1 - (event.clientY - box.top) / box.height;
  for (const panel of picture.panels) {
    const [left, bottom, wide, high] = panel.box, u = (x - left) / wide, v = (y - bottom) / high;
    if (u < 0 || u > 1 || v < 0 || v > 1) continue;
    const pixel = read(picture).getImageData(Math.floor(x * picture.naturalWidth), Math.floor((1 - y) * picture.naturalHeight), 1, 1).data;
    const value = findValue(panel, pixel);
    if (value === null) return "";
    let a = panel.x[0] + u * (panel.x[1] - panel.x[0]), b = panel.y[0] + v * (panel.y[1] - panel.y[0]), where = "";
    const grid = panel.grid;
    if (grid) {
      const column = Math.floor((a + 0.5) / grid.wide), row = Math.floor((b + 0.5) / grid.high);
      a = grid.start + grid.step * Math.floor(a + 0.5 - column * grid.wide);
      b = grid.sensors - Math.floor(b + 0.5 - row * grid.high);
      if (b < 1) return "";
      where = `${grid.rows[row]}${grid.columns[column] ? ", " + grid.columns[column] : ""}: `;
    }
    return `${where}sensor ${Math.round(b)}, ${a.toFixed(0)} ms: ${Number(value.toPrecision(2))} ${panel.unit}`;
  }
  return "";
};
for (const picture of document.querySelectorAll("img[data-hover]")) {
  picture.panels = JSON.parse(picture.dataset.hover);
  picture.addEventListener("pointermove", (event) => {
    const words = say(picture, event);
    tip.hidden = !words;
    tip.textContent = words;
    const left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8);
    tip.style.cssText = `left:${left}px;top:${event.clientY + 16}px`;
  });
  picture.addEventListener("pointerleave", () => { tip.hidden = true; });
}
