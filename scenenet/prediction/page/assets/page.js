// Towers and spans: what is selected, which of the two is shown, and what the reader does.

const worstFirst = new Map();
for (const what of ["tower", "span"])
  worstFirst.set(what, new Map(
    [...document.querySelectorAll(`tbody tr[data-${what}]`)].map((row, place) => [Number(row.dataset[what]), place])));

// The place of each span and tower along the line; cables, and towers of no line, stand last.
const alongLine = new Map();
for (const span of [...spans.values()].sort((a, b) => (a.line || Infinity) - (b.line || Infinity) || a.order - b.order)) {
  if (!span.line) continue;
  for (const tower of [span.from, span.to])
    if (tower && !alongLine.has(tower)) alongLine.set(tower, alongLine.size);
}

const towerList = new List("tower", {
  frame: "towers", filter: "filter", state: "state", order: "order", shown: "shown",
  before: "before", after: "after", select: selectTower, selected: () => chosen,
  orders: {
    worst: (id) => [worstFirst.get("tower").get(id)],
    probability: (id) => [-probability(id)],
    line: (id) => [alongLine.get(id) ?? Infinity],
  },
});

const spanList = spans.size ? new List("span", {
  frame: "spans", filter: "span-filter", state: "span-state-filter", order: "span-order",
  shown: "span-shown", before: "span-before", after: "span-after",
  select: selectSpan, selected: () => chosenSpan,
  orders: {
    worst: (id) => [worstFirst.get("span").get(id)],
    check: (id) => [-spans.get(id).doubts.length, worstFirst.get("span").get(id)],
    line: (id) => [spans.get(id).line || Infinity, spans.get(id).order],
  },
}) : null;

function probability(id) {
  const headings = [...towerList.frame.querySelectorAll("thead th")].map((one) => one.textContent.trim());
  return Number(towerList.rowOf.get(id).cells[headings.indexOf("probability")].textContent);
}

// Select a tower in the list, on the map and in the pictures.
function selectTower(id, { focus = false, centre = false, address = true } = {}) {
  if (!towers.has(id)) return;
  show("towers");
  const before = chosen;
  chosen = id;
  towerList.mark(before, id, focus);
  plan.show(centre);
  showTower(towers.get(id), towerList.rowOf.get(id).classList.contains("check"));
  if (address) history.replaceState(null, "", `#tower-${id}`);
}

// Select a span in the list, on the map and in the profile.
function selectSpan(id, { focus = false, centre = false, address = true } = {}) {
  if (!spans.has(id)) return;
  show("spans");
  const before = chosenSpan;
  chosenSpan = id;
  spanList.mark(before, id, focus);
  plan.show(centre);
  showSpan(spans.get(id), spanList.rowOf.get(id));
  if (address) history.replaceState(null, "", `#span-${id}`);
}

// Show towers or spans.
function show(wanted) {
  mode = wanted;
  if (!spans.size) return;
  for (const [name, parts] of [["spans", ["profile-part", "span-list", "span-detail"]], ["towers", ["list", "detail"]]]) {
    const tab = byId(`tab-${name}`), on = name === wanted;
    for (const part of parts) byId(part).hidden = !on;
    tab.setAttribute("aria-selected", String(on));
    tab.tabIndex = on ? 0 : -1;
  }
  document.querySelector("main").dataset.mode = wanted;
  byId("zoom-chosen").textContent = wanted === "spans" ? "Selected span" : "Selected tower";
  plan.svg.setAttribute("aria-label", `Map of the ${wanted}. Arrow keys go to the next one in that direction, plus and minus zoom.`);
}

// Show towers or spans, with the one that was selected there before or the first one.
function open(wanted, { address = true } = {}) {
  const spansWanted = wanted === "spans" && spanList;
  const list = spansWanted ? spanList : towerList, before = list.selected();
  const first = before ?? list.visible()[0];
  if (first === undefined) {
    show(wanted);
    plan.draw();
  } else (spansWanted ? selectSpan : selectTower)(first, { address });
}

for (const name of spans.size ? ["spans", "towers"] : []) {
  const tab = byId(`tab-${name}`);
  tab.addEventListener("click", () => open(name));
  tab.addEventListener("keydown", (event) => {
    if (!["ArrowLeft", "ArrowRight"].includes(event.key)) return;
    event.preventDefault();
    const other = name === "spans" ? "towers" : "spans";
    open(other);
    byId(`tab-${other}`).focus();
  });
}
byId("zoom-in").addEventListener("click", () => plan.zoom(1.5));
byId("zoom-out").addEventListener("click", () => plan.zoom(1 / 1.5));
byId("zoom-all").addEventListener("click", () => plan.fit());
byId("zoom-chosen").addEventListener("click", () => plan.zoomToChosen());
listenToMap();
if (spans.size) listenToProfile();
if (!spans.size) byId("order").querySelector("[value=line]").remove();
let wide = 0;
new ResizeObserver(() => {
  if (plan.svg.clientWidth === wide) return;
  wide = plan.svg.clientWidth;
  plan.fit();
}).observe(plan.svg);
new ResizeObserver(drawViews).observe(byId("view-plan"));
if (spans.size) new ResizeObserver(drawSpan).observe(byId("profile"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { drawViews(); drawSpan(); });
addEventListener("hashchange", () => fromAddress());

// Select what the address names.
function fromAddress() {
  const [, what, number] = /^#(tower|span)-(\d+)$/.exec(location.hash) ?? [];
  const id = Number(number);
  if (what === "tower" && towers.has(id) && (id !== chosen || mode !== "towers"))
    selectTower(id, { address: false });
  if (what === "span" && spans.has(id) && (id !== chosenSpan || mode !== "spans"))
    selectSpan(id, { address: false });
  if (location.hash === "#list") open("towers", { address: false });
  if (location.hash === "#span-list" && spanList) open("spans", { address: false });
}

show(mode);
plan.fit();
towerList.filter();
spanList?.filter();
fromAddress();
if (chosen === null && chosenSpan === null) open(mode, { address: false });
