// The panel in which an estimate is dragged.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const find = (id) => document.getElementById(id);
const DEGREE = Math.PI / 180;
const SVG = "http://www.w3.org/2000/svg";

const unpacked = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// `asked` is the core's last input, and `verdict` its answer: null if the core was not called.
const state = { number: 0, task: null, x: 0, y: 0, yaw: 0, heading: 0, asked: null, verdict: null };
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

// Converts a point of the goal frame to the picture.
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

const wrapped = (degrees, from) => from + ((((degrees - from) % 360) + 360) % 360);

// The allowed values of the fields.
const any = () => true;
const LIMITS = {
  x: [any, "a number"],
  y: [any, "a number"],
  yaw: [any, "a number"],
  sx: [(v) => v > 0, "above 0"],
  sy: [(v) => v > 0, "above 0"],
  syaw: [(v) => v > 0, "above 0"],
  rxy: [(v) => Math.abs(v) < 1, "between -1 and 1"],
  rxa: [(v) => Math.abs(v) < 1, "between -1 and 1"],
  rya: [(v) => Math.abs(v) < 1, "between -1 and 1"],
  inflation: [(v) => v >= 1 && v <= 4096, "from 1 to 4096"],
};

// Returns the numbers of the fields, which are the input of the core, and a message on the first invalid field.
function given() {
  const numbers = {};
  let fault = null;
  for (const [id, [allows, what]] of Object.entries(LIMITS)) {
    const field = find(id);
    numbers[id] = field.value.trim() === "" ? NaN : Number(field.value);
    const good = field.disabled || (Number.isFinite(numbers[id]) && allows(numbers[id]));
    field.setAttribute("aria-invalid", String(!good));
    if (!good) fault ??= `${document.querySelector(`label[for="${id}"]`).textContent} must be ${what}`;
  }
  return { numbers, fault };
}

// Returns the spread in the goal frame, as the core takes it.
// An inflation is rounded up to its unit, as in the gate. The gate rounds the inflated values up, by at most a
// micrometre or an angle's unit; here that much is added before the inflation.
function spread(n) {
  const raw = Math.ceil(n.inflation * 65536);
  const plain = raw === 65536;
  if (find("kind").value === "bounded") {
    const root = Math.ceil(Math.sqrt(raw * 65536)) / 65536;
    const grown = (value, unit) => (plain ? value : (value + unit) * root + unit);
    return { translation: grown(n.sx, 1e-6), yaw: grown(n.syaw * DEGREE, (2 * Math.PI) / 2 ** 24) };
  }
  const factor = plain ? 1 : (raw / 65536) * (1 + 2 ** -22);
  const sigma = [n.sx, n.sy, n.syaw * DEGREE];
  const r = [1, n.rxy, n.rxa, n.rxy, 1, n.rya, n.rxa, n.rya, 1];
  return { covariance: r.map((value, k) => value * sigma[Math.floor(k / 3)] * sigma[k % 3] * factor) };
}

// Converts a covariance of the goal frame to the world's axes.
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

// Returns the outline of the pose-set on the floor.
function outline(uncertainty, radiusSquared) {
  if (!uncertainty.covariance) {
    return ring((angle) => [uncertainty.translation * Math.cos(angle), uncertainty.translation * Math.sin(angle)]);
  }
  const [a, b, , , d] = uncertainty.covariance;
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

// Returns the section to draw for a heading: the nearest one, or none beyond the range of the sections.
function section() {
  const { headings, polygons } = state.task.sections;
  const [first, last] = [headings[0], headings[headings.length - 1]];
  let heading = wrapped(state.heading, first);
  if (heading - 360 > first - 1e-6) heading -= 360;
  const shown = `${wrapped(state.heading, -180).toFixed(2)}°`;
  if (!(heading <= last + 1e-6)) {
    return { polygons: [], text: `No section at ${shown} from the goal's heading: S is drawn from ${first.toFixed(2)}° to ${last.toFixed(2)}°` };
  }
  let best = 0;
  headings.forEach((other, k) => {
    if (Math.abs(other - heading) < Math.abs(headings[best] - heading)) best = k;
  });
  const off = Math.abs(headings[best] - heading) > 0.005 ? `, the nearest to ${shown}` : "";
  return { polygons: polygons[best], text: `Section of S at ${headings[best].toFixed(2)}° from the goal's heading${off}` };
}

// After any error, no verdict remains visible.
function draw() {
  try {
    drawn();
  } catch (error) {
    state.verdict = null;
    find("panel").dataset.verdict = "none";
    say(null, null, 0, `no verdict: ${error.message}`);
  }
}

function drawn() {
  state.verdict = null;
  state.asked = null;
  const { numbers, fault } = given();
  let verdict = null;
  let uncertainty = null;
  let took = 0;
  if (!fault) {
    [state.x, state.y, state.yaw] = [numbers.x, numbers.y, numbers.yaw];
    if (find("follows").checked) turnTo(state.yaw);
    const started = performance.now();
    uncertainty = spread(numbers);
    const pose = [...toWorld([state.x, state.y]), (state.task.goal.yaw_deg + state.yaw) * DEGREE];
    const world = uncertainty.covariance ? { covariance: turned(uncertainty.covariance) } : uncertainty;
    if (core && state.task.judge) {
      verdict = core.examine(state.task.judge.judge, pose, world);
      state.asked = { pose, ...world };
      state.verdict = verdict;
    }
    took = performance.now() - started;
  }

  const picture = find("panel");
  const part = section();
  const paths = part.polygons.map((ring) => `M${points(pairs(ring))}Z`).join("");
  axes();
  find("set").setAttribute("d", paths);
  find("cross").setAttribute("d", `M${px([0, 0])}m-7 0h14m-7 -7v14`);
  const radius = state.task.judge ? state.task.judge.radiusSquared : 0;
  find("poses").setAttribute("points", uncertainty ? points(outline(uncertainty, radius)) : "");
  const [x, y] = px([state.x, state.y]);
  find("robot").setAttribute("transform", `translate(${x} ${y}) rotate(${-state.yaw})`);
  picture.dataset.verdict = verdict === null ? "none" : verdict.permit ? "permit" : "deny";
  find("heading").setAttribute("aria-valuetext", part.text);
  find("at").textContent = `${part.text}; the picture is ${(WIDTH / scale).toPrecision(3)} m wide`;
  find("confidence").textContent = radius
    ? `a set by a covariance holds the true pose with probability ${data.epsilon}: ${Math.sqrt(radius).toFixed(3)} sigma`
    : "–";
  const worst = verdict?.worst ? toGoal(verdict.worst) : null;
  const mark = find("worst");
  mark.toggleAttribute("hidden", worst === null);
  mark.setAttribute("visibility", worst ? "visible" : "hidden");
  if (worst) {
    const turn = verdict.worst[2] / DEGREE - state.task.goal.yaw_deg;
    const [wx, wy] = px(worst);
    mark.setAttribute("transform", `translate(${wx} ${wy}) rotate(${-turn})`);
  }
  say(verdict, worst, took, fault ?? state.task.why);
}

// Draws the axes with their ticks. Text is 12 px high, however narrow the panel is.
function axes() {
  const wide = find("panel").getBoundingClientRect().width;
  const unit = wide > 0 ? WIDTH / wide : 1;
  const least = (50 * unit) / scale;
  const decade = 10 ** Math.floor(Math.log10(least));
  const step = decade * [1, 2, 5, 10].find((digit) => digit * decade >= least * (1 - 1e-9));
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const group = find("axes");
  group.replaceChildren();
  group.setAttribute("font-size", 12 * unit);
  group.setAttribute("stroke-width", 3 * unit);
  let marks = "";
  const label = (text, x, y, anchor) => {
    element("text", { x, y, "text-anchor": anchor }, group).textContent = text;
  };
  const ends = [WIDTH, HEIGHT].map((size, axis) => [middle[axis] - size / 2 / scale, middle[axis] + size / 2 / scale]);
  ends.forEach(([low, high], axis) => {
    for (let k = Math.ceil(low / step); k * step <= high; k += 1) {
      const value = k * step;
      const text = value.toFixed(digits).replace("-", "\u2212").replace(/^\u2212(0(\.0*)?)$/, "$1");
      const at = px(axis === 0 ? [value, middle[1]] : [middle[0], value])[axis];
      if (axis === 0) {
        if (at < 60 * unit || at > WIDTH - 60 * unit) continue;
        marks += `M${at.toFixed(2)} ${HEIGHT}v${(-7 * unit).toFixed(2)}`;
        label(text, at, HEIGHT - 10 * unit, "middle");
      } else {
        if (at < 34 * unit || at > HEIGHT - 34 * unit) continue;
        marks += `M0 ${at.toFixed(2)}h${(7 * unit).toFixed(2)}`;
        label(text, 10 * unit, at + 4 * unit, "start");
      }
    }
  });
  label("x, m", WIDTH - 8 * unit, HEIGHT - 10 * unit, "end");
  label("y, m", 8 * unit, 16 * unit, "start");
  element("path", { d: marks, "stroke-width": 1.2 * unit }, group);
}

function pairs(flat) {
  const all = [];
  for (let k = 0; k + 1 < flat.length; k += 2) all.push([flat[k], flat[k + 1]]);
  return all;
}

let telling = null;

function say(verdict, worst, took, why) {
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
  } else if (why) {
    cells.reason = why;
  }
  for (const [id, text] of Object.entries(cells)) {
    if (find(id).textContent !== text) find(id).textContent = text;
  }
  // Announce the verdict when the estimate has stopped moving.
  clearTimeout(telling);
  telling = setTimeout(() => {
    const [x, y, yaw] = ["x", "y", "yaw"].map((id) => find(id).value);
    const announced = `${cells.verdict}, ${cells.reason}; margin ${cells.margin.split(" ")[0]}; x ${x} m, y ${y} m, yaw ${yaw} degrees`;
    if (find("told").textContent !== announced) find("told").textContent = announced;
  }, 600);
  find("verdict").className = verdict ? cells.verdict.toLowerCase() : "";
}

// The fields are the input of the core: digits that they do not show are dropped.
function moved() {
  const digits = Math.min(9, Math.max(4, Math.ceil(Math.log10(scale))));
  find("x").value = state.x.toFixed(digits);
  find("y").value = state.y.toFixed(digits);
  find("yaw").value = wrapped(state.yaw, -180).toFixed(2);
  draw();
}

function turnTo(heading) {
  state.heading = heading;
  const first = Number(find("heading").min);
  find("heading").value = wrapped(heading, first);
}

function choose(number) {
  try {
    chosen(number);
  } catch (error) {
    state.verdict = null;
    find("panel").dataset.verdict = "none";
    say(null, null, 0, `no verdict: ${error.message}`);
  }
}

function chosen(number) {
  state.number = number;
  state.task = data.tasks[number];
  find("task").value = String(number);
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
  find("inflation").value = 1;
  find("follows").checked = true;
  kind();
  moved();
}

function kind() {
  const bounded = find("kind").value === "bounded";
  for (const id of ["sy", "rxy", "rxa", "rya"]) find(id).disabled = bounded;
}

// Returns the position of a pointer in the goal frame.
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
  for (const id of Object.keys(LIMITS)) find(id).addEventListener("input", draw);
  find("kind").addEventListener("change", () => {
    kind();
    draw();
  });
  find("heading").addEventListener("input", () => {
    find("follows").checked = false;
    state.heading = Number(find("heading").value);
    draw();
  });
  find("follows").addEventListener("change", moved);
  find("task").addEventListener("change", () => choose(Number(find("task").value)));
  addEventListener("resize", draw);
  // A browser may restore old values of the fields, so reset fields and verdict together.
  addEventListener("pageshow", (event) => event.persisted || choose(state.number));
}

function frame() {
  const picture = find("panel");
  element("path", { id: "set", "fill-rule": "evenodd" }, picture);
  element("g", { id: "axes", "aria-hidden": "true" }, picture);
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
  choose(0);
  document.body.dataset.ready = "yes";
}

begin();
