"use strict";

// A click on a heading sorts the table by its column: numbers by value, text alphabetically, missing
// values last.
for (const table of document.querySelectorAll("table")) {
  const body = table.tBodies[0];
  table.querySelectorAll("thead button").forEach((button, column) => {
    button.addEventListener("click", () => {
      const heading = button.closest("th");
      const falling = heading.getAttribute("aria-sort") === "ascending";
      for (const other of table.querySelectorAll("th")) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
      const value = (row) => {
        const text = row.cells[column].textContent.trim();
        const number = parseFloat(text.replace(/[\u202f\s]/g, ""));
        const numeric = heading.classList.contains("number");
        return numeric ? (Number.isNaN(number) ? null : number) : text;
      };
      const rows = [...body.rows].map((row, place) => ({ row, place, value: value(row) }));
      rows.sort((a, b) => {
        if (a.value === null || b.value === null) return (a.value === null) - (b.value === null);
        const order = typeof a.value === "number" ? a.value - b.value : a.value.localeCompare(b.value);
        return (falling ? -order : order) || a.place - b.place;
      });
      body.append(...rows.map((entry) => entry.row));
    });
  });
}

// A typed array of class Kind from base64.
function unpack(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

// The colour at a share from 0 to 1 between two colours #rrggbb.
function mix(low, high, share) {
  const channel = (colour, i) => parseInt(colour.slice(1 + 2 * i, 3 + 2 * i), 16);
  const part = (i) => Math.round(channel(low, i) + (channel(high, i) - channel(low, i)) * share);
  return `rgb(${part(0)},${part(1)},${part(2)})`;
}

// A crop in 3D that the reader can rotate: voxels as squares, the nearest drawn last.
class Scene {
  constructor(figure) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    this.data = data;
    this.canvas = figure.querySelector("canvas");
    this.colour = figure.querySelector("select");
    this.slider = figure.querySelector("input");
    this.scores = figure.querySelector("output");
    this.zyx = unpack(data.zyx, Int16Array);
    this.classes = unpack(data.class, Uint8Array);
    this.steps = unpack(data.steps, Uint16Array);
    this.tower = unpack(data.tower, Uint8Array);
    this.whole = unpack(data.whole, Uint8Array);
    this.shares = Object.fromEntries(
      Object.entries(data.shares).map(([name, text]) => [name, unpack(text, Int8Array)]));
    this.n = this.tower.length;
    this.turn = 0.6;
    this.tilt = 0.35;
    this.zoom = 1;
    this.order = Uint32Array.from({ length: this.n }, (_, i) => i);
    this.centre = [0, 1, 2].map((axis) => {
      let low = Infinity, high = -Infinity;
      for (let i = 0; i < this.n; i++) {
        low = Math.min(low, this.zyx[3 * i + axis]);
        high = Math.max(high, this.zyx[3 * i + axis]);
      }
      return [(low + high) / 2, high - low + 1];
    });
    this.slider.max = data.taus.length - 1;
    this.slider.value = data.tau_step;
    this.slider.addEventListener("input", () => { this.showScores(); this.draw(); });
    this.colour.addEventListener("change", () => this.draw());
    this.canvas.addEventListener("pointerdown", (event) => this.canvas.setPointerCapture(event.pointerId));
    this.canvas.addEventListener("pointermove", (event) => {
      if (!event.buttons) return;
      this.turn += event.movementX / 120;
      this.tilt = Math.max(-1.5, Math.min(1.5, this.tilt + event.movementY / 120));
      this.draw();
    });
    this.canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
      const scale = { "+": 1.15, "-": 1 / 1.15 }[event.key];
      if (!step && !scale) return;
      event.preventDefault();
      if (scale) this.zoom *= scale;
      if (step) { this.turn += step[0]; this.tilt = Math.max(-1.5, Math.min(1.5, this.tilt + step[1])); }
      this.draw();
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.showScores();
  }

  // Precision, recall and F0.5 at tau over all voxels of the grid, empty ones included.
  showScores() {
    const step = Number(this.slider.value);
    const above = (counts) => counts.slice(step + 1).reduce((sum, count) => sum + count, 0);
    const found = above(this.data.true), wrong = above(this.data.false);
    const all = this.data.true.reduce((sum, count) => sum + count, 0);
    // As in scenenet/metrics/score_columns.py: nothing labelled and nothing detected has no score.
    const text = (part, whole) => whole ? (part / whole).toFixed(3) : "not defined";
    const precision = all && !(found + wrong) ? "0.000" : text(found, found + wrong);
    const f05 = text(1.25 * found, 1.25 * found + 0.25 * (all - found) + wrong);
    this.scores.textContent = `tau ${this.data.taus[step]}: precision ${precision}, ` +
      `recall ${text(found, all)}, F0.5 ${f05}`;
  }

  // A function from the number of a voxel to its colour, for the selected colouring.
  colours() {
    const what = this.colour.value, step = Number(this.slider.value), n = this.data.taus.length;
    const palette = this.data.palette;
    if (what === "class") {
      const named = this.data.classes.map((name) => palette.class[name]);
      return (i) => named[this.classes[i]];
    }
    if (what === "probability") {
      const [low, high] = palette.probability;
      return (i) => mix(low, high, Math.min(1, this.steps[i] / n));
    }
    if (what === "found" || what === "whole") {
      const predicted = what === "whole" ? (i) => this.whole[i] : (i) => this.steps[i] > step;
      const outcome = palette.outcome;
      const transparent = outcome["true negative"] + "33";
      return (i) => {
        if (predicted(i)) return this.tower[i] ? outcome["true positive"] : outcome["false positive"];
        return this.tower[i] ? outcome["false negative"] : transparent;
      };
    }
    const share = this.shares[what];
    const [negative, zero, positive] = palette.contribution;
    return (i) => mix(zero, share[i] < 0 ? negative : positive, Math.abs(share[i]) / 100);
  }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    const width = this.canvas.clientWidth * ratio, height = this.canvas.clientHeight * ratio;
    if (!width) return;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const [z0, y0, x0] = this.centre.map((entry) => entry[0]);
    const spread = Math.hypot(...this.centre.map((entry) => entry[1]));
    const scale = (this.zoom * Math.min(width, height)) / spread;
    const cosTurn = Math.cos(this.turn), sinTurn = Math.sin(this.turn);
    const cosTilt = Math.cos(this.tilt), sinTilt = Math.sin(this.tilt);
    const px = new Float32Array(this.n), py = new Float32Array(this.n), depth = new Float32Array(this.n);
    for (let i = 0; i < this.n; i++) {
      const z = this.zyx[3 * i] - z0, y = this.zyx[3 * i + 1] - y0, x = this.zyx[3 * i + 2] - x0;
      const across = x * cosTurn - y * sinTurn, away = x * sinTurn + y * cosTurn;
      px[i] = width / 2 + scale * across;
      py[i] = height / 2 - scale * (z * cosTilt + away * sinTilt);
      depth[i] = away * cosTilt - z * sinTilt;
    }
    this.order.sort((a, b) => depth[b] - depth[a]);
    const context = this.canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const colour = this.colours(), side = Math.max(1.5, scale * 0.95);
    for (const i of this.order) {
      context.fillStyle = colour(i);
      context.fillRect(px[i] - side / 2, py[i] - side / 2, side, side);
    }
  }
}

for (const figure of document.querySelectorAll("figure.scene")) new Scene(figure).draw();
