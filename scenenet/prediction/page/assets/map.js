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

  // The two ends of a span, and its middle, in pixels.
  ends(span) {
    const [x, y, far_x, far_y] = span.ends;
    return [...this.pixels({ x, y }), ...this.pixels({ x: far_x, y: far_y })];
  },

  middle(span) {
    const [x, y, far_x, far_y] = span.ends;
    return { x: (x + far_x) / 2, y: (y + far_y) / 2 };
  },

  // Bring what is selected into view; into its middle with ``centre``.
  show(centre) {
    const room = 40, [width, height] = this.size();
    const outside = ([x, y]) => x < room || y < room || x > width - room || y > height - room;
    let at, hidden;
    if (mode === "spans" && chosenSpan !== null) {
      const span = spans.get(chosenSpan), ends = this.ends(span);
      at = this.pixels(this.middle(span));
      hidden = outside(ends.slice(0, 2)) || outside(ends.slice(2));
    } else if (mode === "towers" && chosen !== null) {
      at = this.pixels(towers.get(chosen));
      hidden = outside(at);
    }
    if (at && (centre || hidden)) {
      this.x += width / 2 - at[0];
      this.y += height / 2 - at[1];
    }
    this.draw();
  },

  // Show what is selected as large as it is useful.
  zoomToChosen() {
    if (mode === "spans" && chosenSpan !== null) {
      const [x, y, far_x, far_y] = spans.get(chosenSpan).ends, [width, height] = this.size();
      const room = 60, side = (a, b) => Math.max(Math.abs(b - a), 1);
      this.scale = Math.min((width - 2 * room) / side(x, far_x), (height - 2 * room) / side(y, far_y));
    } else this.scale = Math.max(this.scale, 3 * data.planar_m);
    this.show(true);
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
    if (mode === "towers" && chosen !== null)
      over.push(...this.named(this.pixels(towers.get(chosen)), chosen, true));
    if (mode === "spans" && chosenSpan !== null) {
      const span = spans.get(chosenSpan), [x, y, far_x, far_y] = this.ends(span);
      over.push(element("path", { class: "chosen", d: `M${x} ${y}L${far_x} ${far_y}` }));
      const [px, py] = this.pixels(this.middle(span));
      over.push(...this.named([px, py - 8], span.line ? `${span.line}.${span.order}` : "cable", false));
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

  // A name beside a place, with a ring around it.
  named([x, y], text, ring) {
    const left = x > this.size()[0] - 130, name = label([x + (left ? -15 : 15), y + 5, String(text)]);
    if (left) name.setAttribute("text-anchor", "end");
    return ring ? [element("circle", { cx: x, cy: y, r: 11 }), name] : [name];
  },

  // What a click at a pixel means: the nearest of the visible towers and spans, up to some pixels
  // away. Of a line that is shown as spans, the towers are smaller.
  near(px, py) {
    let best = null, least = mode === "spans" ? 7 : 18;
    for (const id of towerList.visible()) {
      const [x, y] = this.pixels(towers.get(id)), apart = Math.hypot(x - px, y - py);
      if (apart < least) [best, least] = [() => selectTower(id), apart];
    }
    if (best || !spanList) return best;
    least = 14;
    for (const id of spanList.visible()) {
      const [x, y, far_x, far_y] = this.ends(spans.get(id)), squared = (far_x - x) ** 2 + (far_y - y) ** 2;
      const share = ((px - x) * (far_x - x) + (py - y) * (far_y - y)) / Math.max(squared, 1e-9);
      const u = Math.max(0, Math.min(1, share));
      const apart = Math.hypot(x + u * (far_x - x) - px, y + u * (far_y - y) - py);
      if (apart < least) [best, least] = [() => selectSpan(id), apart];
    }
    return best;
  },

  // The next tower or span from the selected one towards the right (1, 0), the top (0, -1), ...
  towards(dx, dy) {
    const [list, from] = mode === "spans" ? [spanList, chosenSpan] : [towerList, chosen];
    const at = (id) => this.place(mode === "spans" ? this.middle(spans.get(id)) : towers.get(id));
    if (from === null) return list.visible()[0] ?? null;
    const [x0, y0] = at(from);
    let best = null, least = Infinity;
    for (const id of list.visible()) {
      const [x, y] = at(id);
      const ahead = (x - x0) * dx + (y - y0) * dy, apart = Math.hypot(x - x0, y - y0);
      if (id === from || ahead < 0.5 * apart) continue;
      if (apart < least) [best, least] = [id, apart];
    }
    return best;
  },
};

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
    if (moved <= 3) plan.near(...at(event))?.();
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
    if (id !== null) (mode === "spans" ? selectSpan : selectTower)(id);
  });
}
