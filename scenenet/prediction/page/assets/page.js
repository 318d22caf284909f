"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const towers = new Map(data.towers.map((tower) => [tower.id, tower]));
const byId = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
let chosen = null;

// The largest of 1, 2, 5, 10, 20, ... that is not above a number.
function round(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  // The logarithm may be rounded up to the next power.
  return [5, 2, 1, 0.5].find((step) => step * power <= number) * power;
}

// A length of a round number as text, without rounding errors.
const plain = (number) => String(Number(number.toPrecision(12)));

// The list: a row for each tower, of which the filter hides some.

const body = document.querySelector("#towers tbody");
const rows = [...body.rows];
const rowOf = new Map(rows.map((row) => [Number(row.dataset.tower), row]));
const markerOf = new Map(
  [...document.querySelectorAll("#world .tower")].map((mark) => [Number(mark.dataset.tower), mark]));
const texts = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));
const visible = () => [...body.rows].filter((row) => !row.hidden).map((row) => Number(row.dataset.tower));

function sortBy(heading) {
  const column = heading.cellIndex;
  const falling = heading.getAttribute("aria-sort") === "ascending";
  for (const other of heading.parentNode.cells) other.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
  const numeric = heading.classList.contains("number");
  const value = (row) => {
    const text = row.cells[column].textContent.trim();
    return numeric ? Number(text) : text;
  };
  const entries = rows.map((row, place) => ({ row, place, value: value(row) }));
  entries.sort((a, b) => {
    const order = numeric ? a.value - b.value : a.value.localeCompare(b.value);
    return (falling ? -order : order) || a.place - b.place;
  });
  body.append(...entries.map((entry) => entry.row));
}

function filter() {
  const wanted = byId("filter").value.trim().toLowerCase(), state = byId("state").value;
  let n = 0;
  for (const row of rows) {
    const shown = texts.get(row).includes(wanted) && (!state || row.classList.contains(state));
    row.hidden = !shown;
    markerOf.get(Number(row.dataset.tower)).classList.toggle("off", !shown);
    n += shown;
  }
  byId("shown").textContent = `${n} of ${rows.length} shown`;
  showSteps();
}

// Select a tower in the list, on the map and in the pictures.
function select(id, { focus = false, centre = false, address = true } = {}) {
  if (!towers.has(id)) return;
  if (chosen !== null) {
    rowOf.get(chosen).removeAttribute("aria-current");
    rowOf.get(chosen).querySelector("button").tabIndex = -1;
  }
  chosen = id;
  const row = rowOf.get(id), button = row.querySelector("button");
  row.setAttribute("aria-current", "true");
  button.tabIndex = 0;
  if (focus) button.focus({ preventScroll: true });
  showRow(row);
  plan.show(id, centre);
  showTower(towers.get(id), row.classList.contains("check"));
  showSteps();
  if (address) history.replaceState(null, "", `#tower-${id}`);
}

// Scroll the list, and not the page, until a row is in view.
function showRow(row) {
  const frame = byId("towers"), head = frame.querySelector("thead").offsetHeight;
  const top = row.offsetTop - head, bottom = row.offsetTop + row.offsetHeight;
  if (top < frame.scrollTop) frame.scrollTop = top;
  else if (bottom > frame.scrollTop + frame.clientHeight) frame.scrollTop = bottom - frame.clientHeight;
}

// Go on in the list by a number of rows.
function step(by, options) {
  const ids = visible(), at = ids.indexOf(chosen);
  if (!ids.length) return;
  const to = at < 0 ? 0 : Math.max(0, Math.min(ids.length - 1, at + by));
  select(ids[to], options);
}

function showSteps() {
  const ids = visible();
  byId("before").disabled = !ids.length || ids[0] === chosen;
  byId("after").disabled = !ids.length || ids.at(-1) === chosen;
}

// The map: pixels = scale * place + shift; places count from the north-west corner.

const plan = {
  svg: byId("plan"), world: byId("world"), scale: 1, x: 0, y: 0,

  size() { return [this.svg.clientWidth, this.svg.clientHeight]; },

  fit() {
    const [width, height] = this.size(), room = 50;
    this.scale = Math.min((width - 2 * room) / data.width, (height - 2 * room) / data.height);
    this.x = (width - this.scale * data.width) / 2;
    this.y = (height - this.scale * data.height) / 2;
    this.draw();
  },

  place(tower) { return [tower.x - data.west, data.north - tower.y]; },

  pixels(tower) {
    const [x, y] = this.place(tower);
    return [this.scale * x + this.x, this.scale * y + this.y];
  },

  zoom(factor, px, py) {
    const [width, height] = this.size();
    px ??= width / 2;
    py ??= height / 2;
    const scale = Math.max(1e-4, Math.min(200 * data.planar_m, this.scale * factor));
    this.x = px - (px - this.x) * scale / this.scale;
    this.y = py - (py - this.y) * scale / this.scale;
    this.scale = scale;
    this.draw();
  },

  // Bring a tower into view; in its middle with ``centre``.
  show(id, centre) {
    const [x, y] = this.pixels(towers.get(id)), [width, height] = this.size(), room = 40;
    if (centre || x < room || y < room || x > width - room || y > height - room) {
      this.x += width / 2 - x;
      this.y += height / 2 - y;
    }
    this.draw();
  },

  draw() {
    this.world.setAttribute("transform", `translate(${this.x} ${this.y}) scale(${this.scale})`);
    this.drawGrid();
    this.drawOver();
  },

  drawGrid() {
    const [width, height] = this.size();
    const apart = round(220 / this.scale), grid = byId("grid");
    const west = data.west - this.x / this.scale, north = data.north + this.y / this.scale;
    let lines = "";
    const labels = [];
    for (let x = Math.ceil(west / apart) * apart; x < west + width / this.scale; x += apart) {
      const px = (x - west) * this.scale;
      lines += `M${px} 0V${height}`;
      if (px > 60 && px < width - 90) labels.push([px + 3, height - 5, plain(x)]);
    }
    for (let y = Math.ceil((north - height / this.scale) / apart) * apart; y < north; y += apart) {
      const py = (north - y) * this.scale;
      lines += `M0 ${py}H${width}`;
      if (py > 20 && py < height - 20) labels.push([4, py - 3, plain(y)]);
    }
    grid.replaceChildren(element("path", { d: lines }), ...labels.map(label));
  },

  drawOver() {
    const [width, height] = this.size(), over = [];
    if (chosen !== null) {
      const [x, y] = this.pixels(towers.get(chosen));
      const left = x > width - 130, name = label([x + (left ? -15 : 15), y + 5, String(chosen)]);
      if (left) name.setAttribute("text-anchor", "end");
      over.push(element("circle", { cx: x, cy: y, r: 11 }), name);
    }
    const length = round(140 / this.scale), long = length * this.scale, right = width - 14;
    const bar = `M${right - long} ${height - 34}v8h${long}v-8`;
    const named = label([right, height - 40, `${plain(length)} ${data.planar}`]);
    named.setAttribute("text-anchor", "end");
    const north = label([width - 22, 46, "N"]);
    north.setAttribute("text-anchor", "middle");
    over.push(element("path", { class: "bar", d: bar }), named, north,
      element("path", { class: "arrow", d: `M${width - 22} 8l7 22l-7 -5l-7 5z` }));
    byId("over").replaceChildren(...over);
  },

  // The visible tower nearest to a pixel, up to some pixels away.
  near(px, py) {
    let best = null, least = 18;
    for (const id of visible()) {
      const [x, y] = this.pixels(towers.get(id)), apart = Math.hypot(x - px, y - py);
      if (apart < least) [best, least] = [id, apart];
    }
    return best;
  },

  // The next tower from the selected one towards the right (1, 0), the top (0, -1) and so on.
  towards(dx, dy) {
    if (chosen === null) return visible()[0] ?? null;
    const [x0, y0] = this.place(towers.get(chosen));
    let best = null, least = Infinity;
    for (const id of visible()) {
      const [x, y] = this.place(towers.get(id));
      const ahead = (x - x0) * dx + (y - y0) * dy, apart = Math.hypot(x - x0, y - y0);
      if (id === chosen || ahead < 0.5 * apart) continue;
      if (apart < least) [best, least] = [id, apart];
    }
    return best;
  },
};

function element(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function label([x, y, text]) {
  const made = element("text", { x, y });
  made.textContent = text;
  return made;
}

function listenToMap() {
  const held = new Map();
  let moved = 0;
  const at = (event) => {
    const box = plan.svg.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  plan.svg.addEventListener("pointerdown", (event) => {
    plan.svg.setPointerCapture(event.pointerId);
    held.set(event.pointerId, at(event));
    moved = held.size > 1 ? Infinity : 0;
  });
  plan.svg.addEventListener("pointermove", (event) => {
    const [px, py] = at(event);
    const x = data.west + (px - plan.x) / plan.scale, y = data.north - (py - plan.y) / plan.scale;
    byId("pointer").textContent = `x ${x.toFixed(1)}, y ${y.toFixed(1)} ${data.planar}`;
    if (!held.has(event.pointerId)) return;
    const [qx, qy] = held.get(event.pointerId);
    const other = [...held].find(([id]) => id !== event.pointerId);
    held.set(event.pointerId, [px, py]);
    moved += Math.hypot(px - qx, py - qy);
    if (other) {
      const [ox, oy] = other[1];
      plan.zoom(Math.hypot(px - ox, py - oy) / Math.max(1, Math.hypot(qx - ox, qy - oy)), ox, oy);
    } else if (moved > 3) {
      plan.x += px - qx;
      plan.y += py - qy;
      plan.draw();
    }
  });
  const release = (event) => held.delete(event.pointerId);
  plan.svg.addEventListener("pointerup", (event) => {
    release(event);
    const id = moved > 3 ? null : plan.near(...at(event));
    if (id !== null) select(id);
  });
  plan.svg.addEventListener("pointercancel", release);
  plan.svg.addEventListener("pointerleave", () => { byId("pointer").textContent = ""; });
  plan.svg.addEventListener("wheel", (event) => {
    if (document.activeElement !== plan.svg && !event.ctrlKey) return;
    event.preventDefault();
    plan.zoom(Math.exp(-event.deltaY / 400), ...at(event));
  }, { passive: false });
  plan.svg.addEventListener("keydown", (event) => {
    const ways = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const factor = { "+": 1.5, "=": 1.5, "-": 1 / 1.5 }[event.key];
    if (!ways[event.key] && !factor) return;
    event.preventDefault();
    if (factor) plan.zoom(factor);
    const id = ways[event.key] ? plan.towards(...ways[event.key]) : null;
    if (id !== null) select(id);
  });
}

// The selected tower: its pictures and its explanation.

const unpacked = new Map();

// The points of a tower: n, number of its own, and x, y, z in m from its foot.
function pointsOf(tower) {
  if (!unpacked.has(tower.id)) {
    const script = byId(`points-${tower.id}`);
    const bytes = Uint8Array.from(atob(script.textContent), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer), xyz = new Float32Array(bytes.length / 2);
    for (let i = 0; i < xyz.length; i++) xyz[i] = view.getInt16(2 * i, true) * data.step_m;
    unpacked.set(tower.id, { xyz, n: xyz.length / 3, own: Number(script.dataset.own) });
  }
  return unpacked.get(tower.id);
}

// What each view shows of a point (x, y, z), and what its picture is called.
function viewsOf(tower) {
  const known = tower.bearings.length > 0;
  const bearing = known ? tower.bearings[0] : 0, angle = bearing * Math.PI / 180;
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const towards = `${bearing.toFixed(0)}°`;
  return {
    plan: { of: (x, y) => [x, y], level: true, title: "In plan, north is up" },
    along: {
      of: (x, y, z) => [x * c - y * s, z],
      title: known ? `Profile across the line: looking along it, towards ${towards}` : "Profile, looking north",
    },
    across: {
      of: (x, y, z) => [x * s + y * c, z],
      title: known ? `Profile along the line: ${towards} is to the right` : "Profile, north is to the right",
    },
  };
}

function drawView(canvas, tower, view) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const context = canvas.getContext("2d"), colour = getComputedStyle(document.documentElement);
  const named = (name) => colour.getPropertyValue(`--${name}`).trim();
  context.scale(ratio, ratio);
  const { xyz, n, own } = pointsOf(tower);
  const u = new Float32Array(n), v = new Float32Array(n);
  for (let i = 0; i < n; i++) [u[i], v[i]] = view.of(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  // The plan shows all points. A profile shows the whole tower, and of its surroundings the nearer
  // ones, because it is narrow.
  const furthest = (all) => all.reduce((most, one) => Math.max(most, Math.abs(one)), 3);
  const reach = view.level ? Math.max(furthest(u), furthest(v)) : furthest(u) / 1.6;
  const low = view.level ? -reach : -0.12 * tower.height_m - 2;
  const high = view.level ? reach : 1.12 * tower.height_m + 1;
  const room = 22, scale = Math.min((height - 2 * room) / (high - low), (width - 16) / (2 * reach));
  const px = (across) => width / 2 + scale * across;
  const py = (up) => height / 2 - scale * (up - (low + high) / 2);
  const dots = (from, to, side) => {
    for (let i = from; i < to; i++) context.fillRect(px(u[i]) - side / 2, py(v[i]) - side / 2, side, side);
  };
  context.fillStyle = named("other");
  dots(own, n, 1.5);
  context.fillStyle = named("tower");
  dots(0, own, 2);
  const length = round(width / 3 / scale / data.planar_m), long = length * data.planar_m * scale;
  context.strokeStyle = context.fillStyle = named("ink");
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(8, height - 14);
  context.lineTo(8, height - 8);
  context.lineTo(8 + long, height - 8);
  context.lineTo(8 + long, height - 14);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.fillText(`${plain(length)} ${data.planar}`, 14 + long, height - 8);
  if (view.level) {
    context.beginPath();
    context.moveTo(width - 16, 6);
    context.lineTo(width - 10, 24);
    context.lineTo(width - 22, 24);
    context.fill();
    context.fillText("N", width - 20, 38);
  }
  canvas.setAttribute("aria-label", `${view.title}: tower ${tower.id} with ${own} points of its own and ${n - own} around it`);
  canvas.nextElementSibling.textContent = view.title;
}

function drawViews() {
  if (chosen === null) return;
  const tower = towers.get(chosen);
  for (const [name, view] of Object.entries(viewsOf(tower))) drawView(byId(`view-${name}`), tower, view);
}

function entries(list, sentences) {
  list.replaceChildren(...sentences.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  list.hidden = !sentences.length;
}

function showTower(tower, check) {
  byId("selected").hidden = false;
  byId("detail-title").textContent = `Tower ${tower.id}`;
  byId("tower-state").textContent = check ? "to check" : "found";
  byId("tower-state").className = `state ${check ? "check" : "found"}`;
  byId("tower-place").textContent = `at x ${tower.x.toFixed(2)}, y ${tower.y.toFixed(2)}`;
  entries(byId("doubts"), tower.doubts);
  entries(byId("evidence"), tower.evidence);
  byId("receipt").hidden = !tower.shares.length;
  byId("shares").replaceChildren(...tower.shares.map(([name, share, meaning]) => {
    const row = document.createElement("tr");
    for (const text of [name.replaceAll("_", " "), (100 * share).toFixed(1), meaning]) row.insertCell().textContent = text;
    row.cells[1].className = "number";
    return row;
  }));
  drawViews();
}

// What the reader does.

for (const heading of document.querySelectorAll("#towers thead th"))
  heading.querySelector("button").addEventListener("click", () => sortBy(heading));
body.addEventListener("click", (event) => {
  const row = event.target.closest("tr");
  if (row) select(Number(row.dataset.tower), { focus: true });
});
byId("towers").addEventListener("keydown", (event) => {
  if (!event.target.closest("tbody")) return;
  const by = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity }[event.key];
  if (by === undefined) return;
  event.preventDefault();
  step(by, { focus: true });
});
byId("filter").addEventListener("input", filter);
byId("state").addEventListener("change", filter);
byId("before").addEventListener("click", () => step(-1));
byId("after").addEventListener("click", () => step(1));
byId("zoom-in").addEventListener("click", () => plan.zoom(1.5));
byId("zoom-out").addEventListener("click", () => plan.zoom(1 / 1.5));
byId("zoom-all").addEventListener("click", () => plan.fit());
byId("zoom-tower").addEventListener("click", () => {
  if (chosen === null) return;
  plan.scale = Math.max(plan.scale, 3 * data.planar_m);
  plan.show(chosen, true);
});
listenToMap();
let wide = 0;
new ResizeObserver(() => {
  if (plan.svg.clientWidth === wide) return;
  wide = plan.svg.clientWidth;
  plan.fit();
}).observe(plan.svg);
new ResizeObserver(drawViews).observe(byId("view-plan"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawViews);
addEventListener("hashchange", () => fromAddress());

function fromAddress() {
  const id = Number(location.hash.replace("#tower-", ""));
  if (towers.has(id) && id !== chosen) select(id, { address: false });
}

plan.fit();
filter();
fromAddress();
if (chosen === null && rows.length) select(Number(rows[0].dataset.tower), { address: false });
