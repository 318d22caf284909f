// What charts on a canvas are made of: axes, lines, and texts.

function clipped(context, { x, y, w, h }, draw) {
  context.save();
  context.beginPath();
  context.rect(x, y, w, h);
  context.clip();
  draw();
  context.restore();
}

// Ticks at round numbers of a unit of so many m.
function ticks(from, to, pixels, unit) {
  const apart = round((to - from) / unit * Math.max(0.12, 80 / pixels)), found = [];
  for (let at = Math.ceil(from / unit / apart) * apart; at <= to / unit + 1e-9; at += apart) found.push(at);
  return found;
}

function axes({ context, named }, area, view, title) {
  context.strokeStyle = named("line");
  context.fillStyle = named("soft");
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1;
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const at of ticks(view.z(area.y + area.h), view.z(area.y), 1.3 * area.h, data.vertical_m)) {
    const y = Math.round(view.y(at * data.vertical_m)) + 0.5;
    context.globalAlpha = 0.6;
    stroke(context, [[area.x, y], [area.x + area.w, y]]);
    context.globalAlpha = 1;
    context.fillText(plain(at), area.x - 6, y);
  }
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const at of ticks(view.s(area.x), view.s(area.x + area.w), area.w, data.planar_m)) {
    const x = Math.round(view.x(at * data.planar_m)) + 0.5;
    context.globalAlpha = 0.6;
    stroke(context, [[x, area.y], [x, area.y + area.h]]);
    context.globalAlpha = 1;
    context.fillText(plain(at), x, area.y + area.h + 4);
  }
  context.textBaseline = "alphabetic";
  context.textAlign = "left";
  context.fillText(`elevation [${data.vertical}]`, 4, 12);
  context.textAlign = "right";
  if (title) context.fillText(title, area.x + area.w, area.y + area.h + 32);
  frame(context, area, named);
}

function frame(context, { x, y, w, h }, named) {
  context.strokeStyle = named("soft");
  context.strokeRect(x + 0.5, y + 0.5, w - 1, h - 1);
}

function stroke(context, places) {
  context.beginPath();
  places.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
}

// A text on a ground of its own, so that points do not hide it.
function tag({ context, named }, area, text, x, y, colour) {
  context.font = "600 12px system-ui, sans-serif";
  const wide = context.measureText(text).width + 8, left = Math.max(area.x + 2, Math.min(x, area.x + area.w - wide - 2));
  context.globalAlpha = 0.88;
  context.fillStyle = named("panel");
  context.fillRect(left, y - 9, wide, 18);
  context.globalAlpha = 1;
  context.fillStyle = named(colour);
  context.textAlign = "left";
  context.textBaseline = "middle";
  context.fillText(text, left + 4, y);
  context.textBaseline = "alphabetic";
}

// How near things are in each step along the span.
function nearness({ context, named }, series, area, view) {
  const all = series.flatMap(([, values]) => values.filter((value) => value !== null));
  const limit = Math.max(0, ...Object.values(data.line.limits));
  const top = Math.max(Math.min(Math.max(...all), Math.max(12, 2.2 * limit)), 1);
  const y = (distance) => area.y + area.h * (1 - Math.min(distance, top) / top);
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1;
  context.fillStyle = named("soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const at of ticks(0, top, 2 * area.h, data.planar_m)) {
    context.strokeStyle = named("line");
    const py = Math.round(y(at * data.planar_m)) + 0.5;
    stroke(context, [[area.x, py], [area.x + area.w, py]]);
    context.fillStyle = named("soft");
    context.fillText(plain(at), area.x - 6, py);
  }
  context.textBaseline = "alphabetic";
  clipped(context, area, () => {
    for (const [kind, values] of series) {
      const own = data.line.limits[kind] ?? 0;
      values.forEach((value, step) => {
        if (value === null) return;
        const from = view.x(step * data.line.step), to = view.x((step + 1) * data.line.step);
        if (value < own) {
          context.fillStyle = named("danger");
          context.globalAlpha = 0.25;
          context.fillRect(from, y(own), to - from, y(value) - y(own));
          context.globalAlpha = 1;
        }
        context.strokeStyle = named(colourOf[kind]);
        context.lineWidth = 2.5;
        stroke(context, [[from, y(value)], [to, y(value)]]);
      });
      if (!own) continue;
      context.lineWidth = 1.5;
      context.setLineDash([6, 5]);
      context.strokeStyle = named(colourOf[kind]);
      stroke(context, [[area.x, y(own)], [area.x + area.w, y(own)]]);
      context.setLineDash([]);
    }
  });
  frame(context, area, named);
  context.fillStyle = named("soft");
  context.textAlign = "right";
  context.textBaseline = "top";
  const long = `along the span, and smallest distance from a conductor (up to ${inPlan(top, 0)}) [${data.planar}]`;
  context.fillText(area.w > 480 ? long : `distance from a conductor [${data.planar}]`, area.x + area.w, area.y + area.h + 6);
  context.textBaseline = "alphabetic";
}
