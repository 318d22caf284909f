// The profile of a span: distance along it to the right, elevation upwards; below it, how near
// things are along it.

const BEYOND = 20, KINDS_DRAWN = ["ground", "vegetation", "building", "tower", "wire"];
const FRAME = { left: 52, right: 14, top: 18, bottom: 40 };

// What pixels of the profile mean, for the pointer; null before it is drawn.
let ruler = null;

function drawProfile() {
  const span = spans.get(chosenSpan), canvas = byId("profile"), on = sheet(canvas);
  if (!on) return;
  const series = Object.entries(span.along), strip = series.length ? 92 : 0;
  const area = { x: FRAME.left, y: FRAME.top, w: on.width - FRAME.left - FRAME.right };
  area.h = on.height - FRAME.top - FRAME.bottom - strip - (strip ? 22 : 0);
  const view = fitted(span, area);
  points(on, span, area, view);
  axes(on, area, view, strip ? "" : `along the span [${data.planar}]`);
  cutLine(on, area, view, strip);
  clipped(on.context, area, () => {
    towersAt(on, span, view);
    limits(on, span, view);
    trees(on, span, view);
    wires(on, span, view);
    places(on, span, area, view);
    towerNames(on, span, area, view);
  });
  if (strip) nearness(on, series, { x: area.x, y: area.y + area.h + 22, w: area.w, h: strip }, view);
  ruler = { area, view };
  describe(span, view);
}

// The lowest and highest elevation of a profile. What is high above the line is of no concern to it,
// and stray returns from the air are there.
function heightsOf(span) {
  const { z, of } = pointsAlong(span);
  const tops = [span.from, span.to].map((id) => towers.get(id)).filter(Boolean).map((one) => one.base_m + one.height_m);
  let low = Infinity, high = Math.max(-Infinity, ...tops, ...span.trees.map(({ at, height }) => at[2] + height));
  for (const wire of span.wires) for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    const up = wireAt(wire, share)[2];
    low = Math.min(low, up);
    high = Math.max(high, up + 2);
  }
  for (const kind of ["ground", "vegetation", "building"]) {
    const [from, to] = of.get(kind);
    for (let i = from; i < to; i++) low = Math.min(low, z[i]);
  }
  return [low, high];
}

// The scales of a profile that has all of a span, and where its pixels are.
function fitted(span, area) {
  let [low, high] = heightsOf(span);
  const room = 0.06 * (high - low) + 0.5;
  low -= room;
  high += room;
  const across = span.length + 2 * BEYOND;
  let along = area.w / across, up = area.h / (high - low);
  if (byId("heights").value === "true") along = up = Math.min(along, up);
  const x0 = area.x + (area.w - along * across) / 2, y0 = area.y + area.h - (area.h - up * (high - low)) / 2;
  return {
    along, up, x: (s) => x0 + along * (s + BEYOND), y: (z) => y0 - up * (z - low),
    s: (x) => (x - x0) / along - BEYOND, z: (y) => low + (y0 - y) / up,
  };
}

function points({ context, named }, span, area, view) {
  const { s, z, of } = pointsAlong(span);
  clipped(context, area, () => {
    const side = s.length < 3000 ? 2 : 1.5;
    for (const kind of KINDS_DRAWN) {
      const [from, to] = of.get(kind);
      context.fillStyle = named(colourOf[kind]);
      for (let i = from; i < to; i++) context.fillRect(view.x(s[i]) - side / 2, view.y(z[i]) - side / 2, side, side);
    }
  });
}

function towersAt(on, span, view) {
  const { context, named } = on;
  for (const [id, s] of [[span.from, 0], [span.to, span.length]]) {
    const tower = towers.get(id);
    if (!tower) continue;
    const x = view.x(s);
    context.strokeStyle = named("tower");
    context.lineWidth = 3;
    context.globalAlpha = 0.6;
    stroke(context, [[x, view.y(tower.base_m)], [x, view.y(tower.base_m + tower.height_m)]]);
    context.globalAlpha = 1;
  }
}

// The towers at the ends by name, at the upper border.
function towerNames(on, span, area, view) {
  for (const [id, s] of [[span.from, 0], [span.to, span.length]]) {
    if (!id) continue;
    const text = `tower ${id}`;
    on.context.font = "600 12px system-ui, sans-serif";
    tag(on, area, text, view.x(s) - on.context.measureText(text).width / 2, area.y + 12, "tower");
  }
}

// The limits below the lowest conductor.
function limits({ context, named }, span, view) {
  if (!span.measured) return;
  for (const kind of ["ground", "vegetation"]) {
    const limit = data.line.limits[kind];
    if (!limit) continue;
    const below = [];
    for (let i = 0; i <= 80; i++) {
      const s = i / 80 * span.length;
      const heights = span.wires.map((wire) => wireAbreast(wire, s)?.[2]).filter((z) => z !== undefined);
      if (heights.length) below.push([view.x(s), view.y(Math.min(...heights) - limit)]);
    }
    context.strokeStyle = named(colourOf[kind]);
    context.lineWidth = 1.5;
    context.setLineDash([6, 5]);
    stroke(context, below);
    context.setLineDash([]);
  }
}

function trees({ context, named }, span, view) {
  context.strokeStyle = context.fillStyle = named("fall");
  context.lineWidth = 2;
  for (const { at: [s, , z], height } of span.trees) {
    const x = view.x(s), top = view.y(z + height);
    stroke(context, [[x, view.y(z)], [x, top]]);
    context.beginPath();
    context.arc(x, top, 3.5, 0, 2 * Math.PI);
    context.fill();
  }
}

function wires({ context, named }, span, view) {
  const colours = wireColours(span, named);
  span.wires.forEach((wire, number) => {
    const places = Array.from({ length: 61 }, (_, i) => wireAt(wire, i / 60));
    context.strokeStyle = colours[number];
    context.lineWidth = 2;
    context.setLineDash(DASHES[wire.kind]);
    stroke(context, places.map(([s, , z]) => [view.x(s), view.y(z)]));
  });
  context.setLineDash([]);
}

// What is too near, the nearest of each kind, and the worst with its figure.
function places(on, span, area, view) {
  const { context, named } = on, worst = worstOf(span);
  const line = (place) => stroke(context, [[view.x(place.on[0]), view.y(place.on[2])], [view.x(place.at[0]), view.y(place.at[2])]]);
  context.lineWidth = 1;
  for (const place of span.nearest) {
    context.strokeStyle = named("ink");
    context.setLineDash([2, 2]);
    line(place);
  }
  context.setLineDash([]);
  context.lineWidth = 1.5;
  context.strokeStyle = named("danger");
  for (const place of [...span.dangers].reverse()) {
    line(place);
    context.beginPath();
    context.arc(view.x(place.at[0]), view.y(place.at[2]), 4, 0, 2 * Math.PI);
    context.stroke();
  }
  for (const place of span.nearest) {
    if (place === worst || (worst && place.kind === worst.kind)) continue;
    figure(on, place, area, view, "ink");
  }
  if (!worst) return;
  const colour = tooNear(worst) ? "danger" : "ink";
  context.strokeStyle = named(colour);
  context.lineWidth = 3;
  line(worst);
  const limit = worst.limit === null ? "" : `, limit ${inPlan(worst.limit, 1)}`;
  figure(on, worst, area, view, colour, limit);
}

function figure(on, place, area, view, colour, limit = "") {
  const y = (view.y(place.on[2]) + view.y(place.at[2])) / 2;
  const text = `${inPlan(place.distance)} ${data.planar} to ${place.kind}${limit}`;
  tag(on, area, text, view.x(place.at[0]) + 8, Math.max(area.y + 10, Math.min(y, area.y + area.h - 10)), colour);
}

// Where the section is.
function cutLine({ context, named }, area, view, strip) {
  context.strokeStyle = named("accent");
  context.lineWidth = 1;
  context.setLineDash([3, 3]);
  const x = view.x(cut);
  stroke(context, [[x, area.y], [x, area.y + area.h + (strip ? strip + 22 : 0)]]);
  context.setLineDash([]);
}

function describe(span, view) {
  const worst = worstOf(span);
  const near = worst ? `; nearest ${worst.kind} ${inPlan(worst.distance)} ${data.planar}${worst.limit === null ? "" : `, limit ${inPlan(worst.limit)}`}` : "";
  const dangers = span.dangers.length ? `; ${few(span.dangers.length + span.more, "place")} closer than the limit` : "";
  byId("profile").setAttribute("aria-label", `Profile of span ${span.id}: ${inPlan(span.length, 1)} ${data.planar}, ${few(span.wires.length, "wire")}${near}${dangers}. Left and right arrow keys go along the line.`);
  const times = view.up / view.along;
  const how = Math.abs(times - 1) < 0.01 ? "True to scale." : `Heights are drawn ${times.toFixed(1)} times as large as lengths.`;
  byId("profile-title").textContent = span.line ? `Profile of span ${span.line}.${span.order}` : "Profile of a cable";
  byId("profile-caption").textContent = `${span.from ? `From tower ${span.from}` : "From the left end"} to ${span.to ? `tower ${span.to}` : "the right end"}. ${how}`;
}

// The next span along the same line; null at its end.
function alongFrom(span, by) {
  const own = [...spans.values()].filter((one) => one.line === span.line).sort((a, b) => a.order - b.order);
  return own[own.indexOf(span) + by] ?? null;
}

function listenToProfile() {
  const canvas = byId("profile");
  canvas.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key], inList = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by === undefined && inList === undefined) return;
    event.preventDefault();
    if (inList) return spanList.step(inList);
    const next = alongFrom(spans.get(chosenSpan), by);
    if (next) selectSpan(next.id);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!ruler) return;
    const { view, area } = ruler;
    const inside = event.offsetY >= area.y && event.offsetY <= area.y + area.h;
    const up = inside ? `, elevation ${upwards(view.z(event.offsetY), 1)} ${data.vertical}` : "";
    byId("profile-pointer").textContent = `along ${inPlan(view.s(event.offsetX), 1)} ${data.planar}${up}`;
  });
  canvas.addEventListener("pointerleave", () => { byId("profile-pointer").textContent = ""; });
  canvas.addEventListener("click", (event) => { if (ruler) cutAt(ruler.view.s(event.offsetX)); });
  byId("heights").addEventListener("change", drawProfile);
  byId("cut").addEventListener("input", () => cutAt(Number(byId("cut").value) * data.planar_m));
  for (const limited of document.querySelectorAll("#profile-key .limits"))
    limited.hidden = !Object.keys(data.line.limits).length;
}
