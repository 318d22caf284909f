// The selected tower: its pictures and its explanation.

const unpacked = new Map();

// The points of a tower: n, number of its own, and x, y, z in m from its foot.
function pointsOf(tower) {
  if (!unpacked.has(tower.id)) {
    const script = byId(`points-${tower.id}`), xyz = numbersOf(script);
    for (let i = 0; i < xyz.length; i++) xyz[i] *= data.step_m;
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
  const on = sheet(canvas);
  if (!on) return;
  const { context, width, height, named } = on;
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
  scaleBar(context, width, height, scale, named);
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

function showTower(tower, check) {
  byId("selected").hidden = false;
  byId("detail-title").textContent = `Tower ${tower.id}`;
  byId("tower-state").textContent = check ? "to check" : "found";
  byId("tower-state").className = `state ${check ? "check" : "found"}`;
  byId("tower-place").textContent = `at x ${tower.x.toFixed(2)}, y ${tower.y.toFixed(2)}`;
  entries(byId("doubts"), tower.doubts);
  entries(byId("evidence"), tower.evidence);
  byId("explanation").hidden = !tower.shares.length;
  byId("shares").replaceChildren(...tower.shares.map(([name, share, meaning]) => {
    const row = document.createElement("tr");
    for (const text of [name.replaceAll("_", " "), (100 * share).toFixed(1), meaning]) row.insertCell().textContent = text;
    row.cells[1].className = "number";
    return row;
  }));
  drawViews();
}
