// Touches in space that are turned by hand: dragging or arrow keys turn, the slider sets the time.
// The eye stands at `turn` around y, along which the antenna rests, and `rise` above its side.
const project = (view, [x, y, z]) => {
  const side = x * Math.cos(view.turn) + z * Math.sin(view.turn);
  const away = -x * Math.sin(view.turn) + z * Math.cos(view.turn);
  const up = y * Math.cos(view.rise) - away * Math.sin(view.rise);
  return [view.left + view.scale * side, view.top - view.scale * up];
};
const drawLine = (pen, view, points, colour, width) => {
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  points.forEach((point, k) => (k ? pen.lineTo(...project(view, point)) : pen.moveTo(...project(view, point))));
  pen.stroke();
};
const drawAxes = (pen, view, reach) => {
  pen.font = "12px sans-serif";
  pen.fillStyle = "#555";
  const long = Math.round(reach / 4) || reach / 4;
  for (const [name, end] of [["x", [long, 0, 0]], ["y", [0, long, 0]], ["z", [0, 0, long]]]) {
    drawLine(pen, view, [[0, 0, 0], end], "#999", 1);
    pen.fillText(name, ...project(view, end.map((value) => 1.15 * value)));
  }
  pen.fillText(`axes: ${long} mm`, 12, 20);
};
const drawScene = (pen, view, scene, now) => {
  pen.clearRect(0, 0, view.width, view.height);
  drawAxes(pen, view, scene.reach);
  const shift = scene.shift[now];
  for (const line of scene.lines) {
    drawLine(pen, view, line.map((point) => point.map((value, k) => value + shift[k])), scene.object, 0.6);
  }
  const points = scene.points[now];
  pen.lineCap = "round";
  scene.bend[now].forEach((level, k) => drawLine(pen, view, [points[k], points[k + 1]], scene.colours[level], 3));
};
const startTurnable = (figure) => {
  const canvas = figure.querySelector("canvas"), scene = JSON.parse(canvas.dataset.scene), pen = canvas.getContext("2d");
  const slider = figure.querySelector("input"), said = figure.querySelector("output"), play = figure.querySelector("button");
  const { width, height } = canvas, scale = (0.8 * height) / scene.reach;
  const view = { turn: 0.6, rise: 0.35, width, height, scale, left: width / 2, top: 0.9 * height };
  let timer = 0;
  const draw = () => {
    drawScene(pen, view, scene, +slider.value);
    said.textContent = `${scene.time[+slider.value]} ms`;
  };
  const turn = (sideways, upwards) => {
    view.turn += sideways;
    view.rise = Math.max(-1.5, Math.min(1.5, view.rise + upwards));
    draw();
  };
  canvas.addEventListener("pointermove", (event) => event.buttons && turn(0.01 * event.movementX, 0.01 * event.movementY));
  canvas.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (way) { event.preventDefault(); turn(...way); }
  });
  slider.addEventListener("input", draw);
  play.addEventListener("click", () => {
    play.textContent = timer ? "▶" : "■";
    timer = timer ? clearInterval(timer) : setInterval(() => { slider.value = (+slider.value + 1) % scene.time.length; draw(); }, 40);
  });
  draw();
};
for (const figure of document.querySelectorAll(".turnable")) startTurnable(figure);
