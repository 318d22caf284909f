// A list of towers or spans: a row for each, of which the filter hides some.

class List {
  // what: name of the attribute of rows and marks with the number of what they are for.
  constructor(what, { frame, filter, state, order, shown, before, after, orders, select, selected }) {
    Object.assign(this, { what, select, selected, orders });
    this.frame = byId(frame);
    this.body = this.frame.querySelector("tbody");
    this.rows = [...this.body.rows];
    const number = (one) => Number(one.dataset[what]);
    this.number = number;
    this.rowOf = new Map(this.rows.map((row) => [number(row), row]));
    this.marks = new Map(
      [...document.querySelectorAll(`#world [data-${what}]`)].map((mark) => [number(mark), mark]));
    this.texts = new Map(this.rows.map((row) => [row, row.textContent.toLowerCase()]));
    [this.wanted, this.state, this.order, this.shown, this.before, this.after] =
      [filter, state, order, shown, before, after].map(byId);
    this.listen();
  }

  visible() { return [...this.body.rows].filter((row) => !row.hidden).map(this.number); }

  listen() {
    for (const heading of this.frame.querySelectorAll("thead th"))
      heading.querySelector("button").addEventListener("click", () => this.sortBy(heading));
    this.body.addEventListener("click", (event) => {
      const row = event.target.closest("tr");
      if (row) this.select(this.number(row), { focus: true });
    });
    this.frame.addEventListener("keydown", (event) => {
      if (!event.target.closest("tbody")) return;
      const by = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity }[event.key];
      if (by === undefined) return;
      event.preventDefault();
      this.step(by, { focus: true });
    });
    this.wanted.addEventListener("input", () => this.filter());
    this.state.addEventListener("change", () => this.filter());
    this.order.addEventListener("change", () => this.sort());
    this.before.addEventListener("click", () => this.step(-1));
    this.after.addEventListener("click", () => this.step(1));
  }

  // Put the rows in the order that is asked for. Each order gives the keys of a row, the first of
  // which decide.
  sort() {
    const keys = this.orders[this.order.value];
    for (const heading of this.frame.querySelectorAll("thead th")) heading.removeAttribute("aria-sort");
    const entries = this.rows.map((row, place) => ({ row, keys: [...keys(this.number(row)), place] }));
    entries.sort((a, b) => {
      const at = a.keys.findIndex((key, i) => key !== b.keys[i]);
      return at < 0 ? 0 : a.keys[at] - b.keys[at];
    });
    this.body.append(...entries.map((entry) => entry.row));
    this.showSteps();
  }

  sortBy(heading) {
    const column = heading.cellIndex;
    const falling = heading.getAttribute("aria-sort") === "ascending";
    for (const other of heading.parentNode.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
    this.order.value = "";
    const numeric = heading.classList.contains("number");
    const value = (row) => {
      const text = row.cells[column].textContent.trim();
      return numeric && text ? Number(text) : text;
    };
    const entries = this.rows.map((row, place) => ({ row, place, value: value(row) }));
    entries.sort((a, b) => {
      // What has no value stands last, whichever way the others are sorted.
      if (a.value === "" || b.value === "") return (a.value === "") - (b.value === "") || a.place - b.place;
      const order = numeric ? a.value - b.value : a.value.localeCompare(b.value);
      return (falling ? -order : order) || a.place - b.place;
    });
    this.body.append(...entries.map((entry) => entry.row));
    this.showSteps();
  }

  filter() {
    const wanted = this.wanted.value.trim().toLowerCase(), state = this.state.value;
    let n = 0;
    for (const row of this.rows) {
      const shown = this.texts.get(row).includes(wanted) && (!state || row.classList.contains(state));
      row.hidden = !shown;
      this.marks.get(this.number(row)).classList.toggle("off", !shown);
      n += shown;
    }
    this.shown.textContent = `${n} of ${this.rows.length} shown`;
    this.showSteps();
  }

  // Mark a row instead of another one as that which is selected.
  mark(from, to, focus) {
    if (from !== null) {
      this.rowOf.get(from).removeAttribute("aria-current");
      this.rowOf.get(from).querySelector("button").tabIndex = -1;
    }
    const row = this.rowOf.get(to), button = row.querySelector("button");
    row.setAttribute("aria-current", "true");
    button.tabIndex = 0;
    if (focus) button.focus({ preventScroll: true });
    this.showRow(row);
    this.showSteps();
  }

  // Scroll the list, and not the page, until a row is in view.
  showRow(row) {
    const frame = this.frame, head = frame.querySelector("thead").offsetHeight;
    const top = row.offsetTop - head, bottom = row.offsetTop + row.offsetHeight;
    if (top < frame.scrollTop) frame.scrollTop = top;
    else if (bottom > frame.scrollTop + frame.clientHeight) frame.scrollTop = bottom - frame.clientHeight;
  }

  // Go on in the list by a number of rows.
  step(by, options) {
    const ids = this.visible(), at = ids.indexOf(this.selected());
    if (!ids.length) return;
    const to = at < 0 ? 0 : Math.max(0, Math.min(ids.length - 1, at + by));
    this.select(ids[to], options);
  }

  showSteps() {
    const ids = this.visible();
    this.before.disabled = !ids.length || ids[0] === this.selected();
    this.after.disabled = !ids.length || ids.at(-1) === this.selected();
  }
}
