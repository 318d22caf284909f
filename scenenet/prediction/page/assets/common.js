"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const towers = new Map(data.towers.map((tower) => [tower.id, tower]));
const spans = new Map((data.line?.spans ?? []).map((span) => [span.id, span]));

// What the page says of a wire, a place and a tree, by name.
const wireOf = ([id, kind, of, s, t, z, farS, farT, farZ, c, blowout, sag, rmse, seen]) =>
  ({ id, kind, of, start: [s, t, z], end: [farS, farT, farZ], c, blowout, sag, rmse, seen });
const placeOf = ([kind, distance, vertical, points, note, wire, s, t, z, onS, onT, onZ]) => ({
  kind, distance, vertical, points, note, wire, at: [s, t, z], on: [onS, onT, onZ],
  limit: data.line.limits[kind] ?? null,
});
const treeOf = ([s, t, z, height, distance, margin, wire]) => ({ at: [s, t, z], height, distance, margin, wire });
for (const span of spans.values()) {
  span.wires = span.wires.map(wireOf);
  for (const name of ["nearest", "dangers"]) span[name] = span[name].map(placeOf);
  span.trees = span.trees.map(treeOf);
}

const byId = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

// What is selected. Towers and spans each have a list, of which ``mode`` says which one is shown.
let chosen = null, chosenSpan = null, mode = spans.size ? "spans" : "towers";

// The largest of 1, 2, 5, 10, 20, ... that is not above a number.
function round(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  // The logarithm may be rounded up to the next power.
  return [5, 2, 1, 0.5].find((step) => step * power <= number) * power;
}

// A length of a round number as text, without rounding errors.
const plain = (number) => String(Number(number.toPrecision(12)));

// Lengths in m as text, in the units of the survey.
const inPlan = (metres, decimals = 2) => (metres / data.planar_m).toFixed(decimals);
const upwards = (metres, decimals = 2) => (metres / data.vertical_m).toFixed(decimals);

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

function entries(list, sentences) {
  list.replaceChildren(...sentences.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  list.hidden = !sentences.length;
}

// Fill a table with rows of cells; a number, or a text that begins like one, is to the right.
function cells(body, rows) {
  body.replaceChildren(...rows.map((row) => {
    const made = document.createElement("tr");
    for (const text of row) {
      const cell = made.insertCell();
      cell.textContent = text;
      if (/^[-−\d]/.test(text)) cell.className = "number";
    }
    return made;
  }));
}

// A canvas that is as sharp as the screen, with its context, its size in px and the colours of the
// page by name; null where it is not shown.
function sheet(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return null;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const context = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
  context.scale(ratio, ratio);
  return { context, width, height, named: (name) => style.getPropertyValue(`--${name}`).trim() };
}

// The numbers of two bytes that a script element holds.
function numbersOf(script) {
  const bytes = Uint8Array.from(atob(script.textContent), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer), numbers = new Float32Array(bytes.length / 2);
  for (let i = 0; i < numbers.length; i++) numbers[i] = view.getInt16(2 * i, true);
  return numbers;
}

// A bar of a round length at the lower left.
function scaleBar(context, width, height, scale, named) {
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
  context.textAlign = "left";
  context.fillText(`${plain(length)} ${data.planar}`, 14 + long, height - 8);
}
