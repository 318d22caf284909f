// The selected span: what is near it, its conductors, and a section across it.

const unpackedSpans = new Map();

// The points of a span: s along it, t to its left and z, all in m, and from which to which one they
// are of each kind.
function pointsAlong(span) {
  if (!unpackedSpans.has(span.id)) {
    const script = byId(`span-points-${span.id}`), packed = numbersOf(script);
    const { step, along, low, beside } = script.dataset, n = packed.length / 3;
    const [s, t, z] = [new Float32Array(n), new Float32Array(n), new Float32Array(n)];
    for (let i = 0; i < n; i++) {
      s[i] = packed[3 * i] * step + Number(along);
      t[i] = packed[3 * i + 1] * step;
      z[i] = packed[3 * i + 2] * step + Number(low);
    }
    const of = new Map();
    let from = 0;
    script.dataset.counts.split(" ").forEach((count, kind) => {
      of.set(data.line.kinds[kind], [from, from + Number(count)]);
      from += Number(count);
    });
    unpackedSpans.set(span.id, { s, t, z, of, beside: Number(beside) });
  }
  return unpackedSpans.get(span.id);
}

// The place (s, t, z) of a wire at a share of its length: a catenary that wind moves aside.
function wireAt(wire, share) {
  const [[s, t, z], [farS, farT, farZ], c] = [wire.start, wire.end, wire.c];
  const length = Math.hypot(farS - s, farT - t);
  const lowest = length / 2 - c * Math.asinh((farZ - z) / (2 * c * Math.sinh(length / (2 * c))));
  const up = c * (Math.cosh((share * length - lowest) / c) - Math.cosh(lowest / c));
  const aside = 4 * wire.blowout * share * (1 - share) / length;
  return [
    s + share * (farS - s) - aside * (farT - t), t + share * (farT - t) + aside * (farS - s), z + up,
  ];
}

// The place of a wire abreast of a place along the span; null where it does not reach.
function wireAbreast(wire, along) {
  const share = (along - wire.start[0]) / (wire.end[0] - wire.start[0]);
  return share >= -1e-9 && share <= 1 + 1e-9 ? wireAt(wire, share) : null;
}

const middleOf = (wire) => wireAt(wire, 0.5)[1];
const colourOf = { ground: "ground", vegetation: "plant", building: "building", wire: "wire", tower: "tower" };

// A colour for each wire, from that of the left side of the line to that of its right side.
function wireColours(span, named) {
  const beside = span.wires.map(middleOf), most = Math.max(...beside.map(Math.abs), 0.5);
  const parts = (name) => [1, 3, 5].map((at) => parseInt(named(name).slice(at, at + 2), 16));
  const [left, middle, right] = ["left", "middle", "right"].map(parts);
  return beside.map((t) => {
    const share = Math.abs(t) / most, far = t > 0 ? left : right;
    return `rgb(${middle.map((part, i) => Math.round(part + share * (far[i] - part))).join(" ")})`;
  });
}

const DASHES = { conductor: [], "earth wire": [7, 4], cable: [2, 3] };

// The worst place of a span; null where nothing is near.
function worstOf(span) {
  const margin = (place) => place.limit === null ? place.distance : place.distance - place.limit;
  const places = [...span.nearest, ...span.dangers];
  return places.length ? places.reduce((a, b) => (margin(b) < margin(a) ? b : a)) : null;
}

const tooNear = (place) => place.limit !== null && place.distance < place.limit;

// Where the section across the span is, in m along it, and what is within SLAB m of it is in it.
let cut = 0;
const SLAB = 4;

function drawSection() {
  const span = spans.get(chosenSpan), on = sheet(byId("section"));
  if (!on) return;
  const { context, width, height, named } = on, { s, t, z, of, beside } = pointsAlong(span);
  const wires = span.wires.map((wire) => wireAbreast(wire, cut));
  const inside = [];
  for (let i = 0; i < s.length; i++) if (Math.abs(s[i] - cut) <= SLAB) inside.push(i);
  const [low, high] = sectionHeights(span, wires.filter(Boolean), inside), room = 8;
  const scale = Math.min((width - 2 * room) / (2 * beside), (height - 30) / (high - low));
  const px = (left) => width / 2 - scale * left, py = (up) => height - 24 - scale * (up - low);
  for (const [kind, [from, to]] of of) {
    context.fillStyle = named(colourOf[kind]);
    for (const i of inside) if (i >= from && i < to) context.fillRect(px(t[i]) - 1, py(z[i]) - 1, 2, 2);
  }
  const colours = wireColours(span, named);
  wires.forEach((at, number) => {
    if (!at) return;
    for (const kind of ["vegetation", "ground"]) {
      if (!data.line.limits[kind]) continue;
      context.strokeStyle = named(colourOf[kind]);
      context.setLineDash([4, 4]);
      context.lineWidth = 1;
      context.beginPath();
      // Only what is below a wire may be too near it as ground.
      context.arc(px(at[1]), py(at[2]), scale * data.line.limits[kind], 0, kind === "ground" ? Math.PI : 2 * Math.PI);
      context.stroke();
    }
    context.setLineDash([]);
    context.fillStyle = colours[number];
    context.beginPath();
    context.arc(px(at[1]), py(at[2]), 4, 0, 2 * Math.PI);
    context.fill();
  });
  for (const place of [...span.nearest, ...span.dangers])
    if (Math.abs(place.at[0] - cut) <= SLAB) {
      context.strokeStyle = named(tooNear(place) ? "danger" : "ink");
      context.lineWidth = 1.5;
      context.beginPath();
      context.moveTo(px(place.on[1]), py(place.on[2]));
      context.lineTo(px(place.at[1]), py(place.at[2]));
      context.stroke();
    }
  scaleBar(context, width, height, scale, named);
  const looking = span.to ? `towards tower ${span.to}` : "along the line";
  byId("section").setAttribute("aria-label", `Section across the span at ${inPlan(cut, 1)} ${data.planar}, looking ${looking}`);
  byId("section-caption").textContent = `Section across the line, looking ${looking}: points up to ${inPlan(SLAB, 0)} ${data.planar} before and behind it${span.nearest.some((p) => p.limit !== null) ? "; dashed: limits around the conductors" : ""}`;
  byId("cut-at").textContent = `${inPlan(cut, 1)} ${data.planar}`;
}

// The lowest and highest elevation of a section: the ground, and some m above its wires.
function sectionHeights(span, wires, inside) {
  const { z, of } = pointsAlong(span), [from, to] = of.get("ground"), above = data.line.limits.vegetation ?? 0;
  const ups = wires.map((at) => at[2]), ground = inside.filter((i) => i >= from && i < to).map((i) => z[i]);
  if (!ups.length) return heightsOf(span);
  const high = Math.max(...ups) + Math.max(4, above) + 2;
  return [Math.min(...ups.map((up) => up - 8), ...ground) - 2, high];
}

// Go to a place along the span with the section.
function cutAt(along) {
  const slider = byId("cut");
  slider.value = along / data.planar_m;
  cut = Math.max(0, Math.min(along, spans.get(chosenSpan).length));
  drawSection();
  drawProfile();
}

function drawSpan() {
  if (mode !== "spans" || chosenSpan === null) return;
  drawProfile();
  drawSection();
}

const few = (number, what) => `${number} ${what}${number === 1 ? "" : "s"}`;

// A tower at an end of a span: a button that goes there, if the page lists it.
function towerLink(before, id) {
  if (!id) return [`${before} no tower`];
  if (!towers.has(id)) return [`${before} tower ${id}`];
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = `tower ${id}`;
  button.addEventListener("click", () => selectTower(id));
  return [`${before} `, button];
}

function showSpan(span, row) {
  byId("span-selected").hidden = false;
  byId("span-title").textContent = `Span ${span.id}`;
  const state = ["danger", "check", "found"].find((name) => row.classList.contains(name));
  byId("span-state").textContent = row.querySelector(".state").textContent;
  byId("span-state").className = `state ${state}`;
  const lines = [...spans.values()].filter((one) => one.line === span.line).length;
  const where = span.line ? `line ${span.line}, span ${span.order} of ${lines}` : "cable of no line";
  const turn = Math.abs(span.angle) < 0.5 ? "" : `; the line turns ${Math.abs(span.angle).toFixed(0)}° to the ${span.angle > 0 ? "right" : "left"} at its end`;
  byId("span-place").textContent = `${where}, ${inPlan(span.length, 1)} ${data.planar} long${turn}`;
  byId("span-towers").replaceChildren(...towerLink("from", span.from), ...towerLink(" to", span.to));
  entries(byId("span-doubts"), span.doubts);
  fillTables(span);
  const worst = worstOf(span);
  byId("cut").max = span.length / data.planar_m;
  byId("cut").value = (cut = Math.max(0, Math.min(worst ? worst.on[0] : span.length / 2, span.length))) / data.planar_m;
  drawSpan();
}

function fillTables(span) {
  const limit = (value) => value === null ? "none" : inPlan(value), at = (place) => inPlan(place.on[0], 1);
  byId("near").hidden = !span.nearest.length;
  byId("near-none").hidden = span.nearest.length > 0;
  cells(byId("near").tBodies[0], span.nearest.map((place) => [
    place.kind, inPlan(place.distance), upwards(place.vertical), limit(place.limit), String(place.wire), at(place)]));
  byId("dangers").hidden = !span.dangers.length;
  cells(byId("dangers").querySelector("tbody"), span.dangers.map((place) => [
    place.note ? `${place.kind} (${place.note})` : place.kind, inPlan(place.distance),
    inPlan(place.distance - place.limit), String(place.points), String(place.wire), at(place)]));
  byId("trees").hidden = !span.trees.length;
  cells(byId("trees").querySelector("tbody"), span.trees.map((tree) => [
    upwards(tree.height), inPlan(tree.distance), inPlan(tree.margin), String(tree.wire), inPlan(tree.at[0], 1)]));
  for (const [part, number, layer] of [["dangers", span.more, "clearances"], ["trees", span.more_trees, "fall_trees"]]) {
    const more = byId(part).querySelector(".more");
    more.hidden = !number;
    more.textContent = `${number} more in the layer ${layer} of the GeoPackage`;
  }
  cells(byId("wires").tBodies[0], span.wires.map((wire) => [
    String(wire.id), wire.of > 1 ? `${wire.kind}, bundle of ${wire.of}` : wire.kind, inPlan(middleOf(wire), 1),
    upwards(wire.sag), inPlan(wire.c, 0), inPlan(wire.rmse, 3), `${(100 * wire.seen).toFixed(0)} %`]));
  const units = data.planar === data.vertical ? `in ${data.planar}` : `in ${data.planar}, heights in ${data.vertical}`;
  document.querySelector("#span-selected .units").textContent = `Lengths ${units}. "at": along the span from its start. "c": catenary parameter. "seen": share of the length with points.`;
}
