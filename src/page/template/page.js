// The panel in which an estimate is dragged.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const find = (id) => document.getElementById(id);
const DEGREE = Math.PI / 180;
const SVG = "http://www.w3.org/2000/svg";

const unpacked = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

const state = { task: null, x: 0, y: 0, yaw: 0, heading: 0, follows: true };
let core = null;
let scale = 1;
let middle = [0, 0];
const WIDTH = 640;
const HEIGHT = 460;

function element(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

// From the goal frame to the picture.
const px = ([x, y]) => [WIDTH / 2 + scale * (x - middle[0]), HEIGHT / 2 - scale * (y - middle[1])];
const points = (all) => all.map((point) => px(point).map((v) => v.toFixed(2)).join(",")).join(" ");

function toWorld([x, y]) {
  const { goal } = state.task;
  const [c, s] = [Math.cos(goal.yaw_deg * DEGREE), Math.sin(goal.yaw_deg * DEGREE)];
  return [goal.x + c * x - s * y, goal.y + s * x + c * y];
}

function toGoal([x, y]) {
  const { goal } = state.task;
  const [c, s] = [Math.cos(goal.yaw_deg * DEGREE), Math.sin(goal.yaw_deg * DEGREE)];
  const [dx, dy] = [x - goal.x, y - goal.y];
  return [c * dx + s * dy, -s * dx + c * dy];
}

const number = (id) => Number(find(id).value);

// The spread in the goal frame, as the core takes it.
function spread() {
  if (find("kind").value === "bounded") {
    return { translation: number("sx"), yaw: number("syaw") * DEGREE };
  }
  const sigma = [number("sx"), number("sy"), number("syaw") * DEGREE];
  const [xy, xa, ya] = ["rxy", "rxa", "rya"].map(number);
  const r = [1, xy, xa, xy, 1, ya, xa, ya, 1];
  return { covariance: r.map((value, k) => value * sigma[Math.floor(k / 3)] * sigma[k % 3]) };
}

// A covariance of the goal frame in the world's axes.
function turned(c) {
  const turn = state.task.goal.yaw_deg * DEGREE;
  const j = [Math.cos(turn), -Math.sin(turn), 0, Math.sin(turn), Math.cos(turn), 0, 0, 0, 1];
  const times = (a, b, transposed) =>
    Array.from({ length: 9 }, (_, k) => {
      const [row, column] = [Math.floor(k / 3), k % 3];
      const other = (i) => (transposed ? b[3 * column + i] : b[3 * i + column]);
      return [0, 1, 2].reduce((sum, i) => sum + a[3 * row + i] * other(i), 0);
    });
  const made = times(times(j, c, false), j, true);
  // Symmetric to the last bit.
  for (const [a, b] of [[1, 3], [2, 6], [5, 7]]) made[b] = made[a];
  return made;
}

// The outline of the pose-set on the floor.
function outline(told, radiusSquared) {
  if (!told.covariance) {
    return ring((angle) => [told.translation * Math.cos(angle), told.translation * Math.sin(angle)]);
  }
  const [a, b, , , d] = told.covariance;
  const along = Math.sqrt(Math.max(a, 0));
  const across = along > 0 ? b / along : 0;
  const rest = Math.sqrt(Math.max(d - across * across, 0));
  const radius = Math.sqrt(radiusSquared);
  return ring((angle) => {
    const [u, v] = [radius * Math.cos(angle), radius * Math.sin(angle)];
    return [along * u, across * u + rest * v];
  });
}

function ring(at) {
  return Array.from({ length: 64 }, (_, k) => {
    const [x, y] = at((2 * Math.PI * k) / 64);
    return [state.x + x, state.y + y];
  });
}

function section() {
  const { headings, polygons } = state.task.sections;
  let best = 0;
  headings.forEach((heading, k) => {
    if (Math.abs(heading - state.heading) < Math.abs(headings[best] - state.heading)) best = k;
  });
  return { heading: headings[best], polygons: polygons[best] ?? [] };
}

function draw() {
  const started = performance.now();
  const told = spread();
  const here = toWorld([state.x, state.y]);
  const yaw = (state.task.goal.yaw_deg + state.yaw) * DEGREE;
  const world = told.covariance ? { covariance: turned(told.covariance) } : told;
  let verdict = null;
  if (core && state.task.judge) {
    verdict = core.examine(state.task.judge.judge, [...here, yaw], world);
  }
  const took = performance.now() - started;

  const picture = find("panel");
  const part = section();
  const paths = part.polygons.map((ring) => `M${points(pairs(ring))}Z`).join("");
  find("set").setAttribute("d", paths);
  find("cross").setAttribute("d", `M${px([0, 0])}m-7 0h14m-7 -7v14`);
  const radius = state.task.judge ? state.task.judge.radiusSquared : 0;
  find("poses").setAttribute("points", points(outline(told, radius)));
  const [x, y] = px([state.x, state.y]);
  find("robot").setAttribute("transform", `translate(${x} ${y}) rotate(${-state.yaw})`);
  picture.dataset.verdict = verdict === null ? "none" : verdict.permit ? "permit" : "deny";
  find("at").textContent = 
    `Section of S at ${part.heading.toFixed(2)}° from the goal's heading; the picture is ${(WIDTH / scale).toPrecision(3)} m wide`;
  const worst = verdict?.worst ? toGoal(verdict.worst) : null;
  const mark = find("worst");
  mark.toggleAttribute("hidden", worst === null);
  mark.setAttribute("visibility", worst ? "visible" : "hidden");
  if (worst) {
    const turn = verdict.worst[2] / DEGREE - state.task.goal.yaw_deg;
    const [wx, wy] = px(worst);
    mark.setAttribute("transform", `translate(${wx} ${wy}) rotate(${-turn})`);
  }
  say(verdict, worst, took);
}

function pairs(flat) {
  const all = [];
  for (let k = 0; k + 1 < flat.length; k += 2) all.push([flat[k], flat[k + 1]]);
  return all;
}

function say(verdict, worst, took) {
  const cells = { verdict: "–", reason: "–", margin: "–", "worst-pose": "–", took: "–" };
  if (verdict) {
    const reason = core.reason(verdict.reason);
    cells.verdict = verdict.permit ? "PERMIT" : "DENY";
    if (verdict.status !== OK) cells.reason = `these numbers are refused (status ${verdict.status})`;
    else if (!verdict.permit) cells.reason = `${reason.name}: ${reason.meaning}`;
    if (verdict.marginQ16 !== null) {
      const shown = Math.floor((verdict.marginQ16 / 65536) * 1000) / 1000;
      cells.margin = `${shown.toFixed(3)} (${verdict.marginQ16} / 65536)`;
    }
    if (worst) {
      const turn = Math.round((verdict.worst[2] / DEGREE - state.task.goal.yaw_deg) * 1000) / 1000;
      const near = ((((turn + 180) % 360) + 360) % 360) - 180;
      cells["worst-pose"] = `${worst[0].toFixed(4)} m, ${worst[1].toFixed(4)} m, ${near.toFixed(2)}° from the goal`;
    }
    cells.took = `${took.toFixed(2)} ms`;
  }
  for (const [id, text] of Object.entries(cells)) find(id).textContent = text;
  find("verdict").className = verdict ? cells.verdict.toLowerCase() : "";
}

function moved() {
  find("x").value = state.x.toFixed(4);
  find("y").value = state.y.toFixed(4);
  find("yaw").value = state.yaw.toFixed(2);
  if (find("follows").checked) turnTo(state.yaw);
  draw();
}

function turnTo(heading) {
  state.heading = heading;
  find("heading").value = heading;
}

function choose(name) {
  state.task = data.tasks.find((task) => task.name === name);
  const { task } = state;
  if (core && !task.judge && task.table) task.judge = core.judge(unpacked(task.table));
  const [x, y] = [task.window.x, task.window.y];
  scale = 0.92 * Math.min(WIDTH / (x[1] - x[0]), HEIGHT / (y[1] - y[0]));
  middle = [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2];
  const { headings } = task.sections;
  find("heading").min = headings[0] ?? 0;
  find("heading").max = headings[headings.length - 1] ?? 0;
  [state.x, state.y, state.yaw] = task.start.at;
  find("kind").value = "gaussian";
  find("sx").value = task.start.sigma[0];
  find("sy").value = task.start.sigma[1];
  find("syaw").value = task.start.sigma[2];
  for (const id of ["rxy", "rxa", "rya"]) find(id).value = 0;
  kind();
  moved();
}

function kind() {
  const bounded = find("kind").value === "bounded";
  for (const id of ["sy", "rxy", "rxa", "rya"]) find(id).disabled = bounded;
}

// Where a pointer is, in the goal frame.
function pointed(event) {
  const box = find("panel").getBoundingClientRect();
  const x = ((event.clientX - box.left) / box.width) * WIDTH;
  const y = ((event.clientY - box.top) / box.height) * HEIGHT;
  return [middle[0] + (x - WIDTH / 2) / scale, middle[1] - (y - HEIGHT / 2) / scale];
}

function listen() {
  const robot = find("robot");
  let held = null;
  robot.addEventListener("pointerdown", (event) => {
    const [x, y] = pointed(event);
    held = event.target.classList.contains("turn") ? "turn" : [state.x - x, state.y - y];
    robot.setPointerCapture(event.pointerId);
    robot.focus();
    event.preventDefault();
  });
  robot.addEventListener("pointermove", (event) => {
    if (held === null) return;
    const [x, y] = pointed(event);
    if (held === "turn") state.yaw = Math.atan2(y - state.y, x - state.x) / DEGREE;
    else [state.x, state.y] = [x + held[0], y + held[1]];
    moved();
  });
  robot.addEventListener("lostpointercapture", () => (held = null));
  robot.addEventListener("keydown", (event) => {
    const step = (event.shiftKey ? 40 : 8) / scale;
    const turn = event.shiftKey ? 5 : 1;
    const keys = {
      ArrowLeft: [-step, 0, 0],
      ArrowRight: [step, 0, 0],
      ArrowUp: [0, step, 0],
      ArrowDown: [0, -step, 0],
      "[": [0, 0, turn],
      "]": [0, 0, -turn],
      "{": [0, 0, 5],
      "}": [0, 0, -5],
    };
    const by = keys[event.key];
    if (!by) return;
    event.preventDefault();
    state.x += by[0];
    state.y += by[1];
    state.yaw += by[2];
    moved();
  });
  for (const id of ["x", "y", "yaw"]) {
    find(id).addEventListener("input", () => {
      state[id] = number(id);
      if (id === "yaw" && find("follows").checked) turnTo(state.yaw);
      draw();
    });
  }
  for (const id of ["sx", "sy", "syaw", "rxy", "rxa", "rya"]) find(id).addEventListener("input", draw);
  find("kind").addEventListener("change", () => {
    kind();
    draw();
  });
  find("heading").addEventListener("input", () => {
    find("follows").checked = false;
    state.heading = number("heading");
    draw();
  });
  find("follows").addEventListener("change", moved);
  find("task").addEventListener("change", () => choose(find("task").value));
}

function frame() {
  const picture = find("panel");
  element("path", { id: "set", "fill-rule": "evenodd" }, picture);
  element("path", { id: "cross" }, picture);
  element("polygon", { id: "poses" }, picture);
  const worst = element("g", { id: "worst", visibility: "hidden" }, picture);
  element("path", { d: "M-7 -7L7 7M7 -7L-7 7M0 0H22" }, worst);
  const robot = element(
    "g",
    {
      id: "robot",
      tabindex: "0",
      role: "application",
      "aria-label": "The estimate. Arrow keys move it, [ and ] turn it, with Shift farther.",
    },
    picture,
  );
  element("circle", { r: 11 }, robot);
  element("path", { d: "M0 0H34" }, robot);
  element("circle", { class: "turn", cx: 40, cy: 0, r: 8 }, robot);
}

async function begin() {
  if (data.tasks.length === 0) {
    find("without").textContent = "No task of this site can be shown: the table below says why.";
    return;
  }
  frame();
  listen();
  try {
    core = await Core.of(unpacked(data.core));
    find("without").hidden = true;
  } catch (error) {
    find("without").textContent =
      `Without WebAssembly the core cannot run here (${error.message}): the pictures below are whole, verdicts are missing.`;
  }
  choose(data.tasks[0].name);
  document.body.dataset.ready = "yes";
}

begin();
