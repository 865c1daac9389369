// One reading and one range for the map, the curves and the table: whichever of them is pointed at, all show it.
// Every text goes into the page as text, never as HTML: it may come from a file that anybody wrote.

const ROWS = 25;  // of the table at a time: a table of 100,000 rows would take a browser's breath away

const HINT = "Point at a window, or tap it. Drag over the curves for the figures of a range.";

const byId = id => document.getElementById(id);
const number = (value, decimals, unit = "") => value === value ? value.toFixed(decimals) + unit : "–";
const distance = metre => metre >= 1000 ? `${(metre / 1000).toFixed(2)} km` : `${metre.toFixed(0)} m`;
const degrees = lon => ((lon + 540) % 360 + 360) % 360 - 180;

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function duration(second) {
  const minutes = Math.floor(Math.round(second) / 60), hours = Math.floor(minutes / 60);
  const two = value => String(value).padStart(2, "0");
  if (hours) return `${hours} h ${two(minutes % 60)} min`;
  return minutes ? `${minutes} min ${two(Math.round(second) % 60)} s` : `${Math.round(second)} s`;
}

class Report {
  constructor(windows, base, passed, data) {
    Object.assign(this, {windows, base, passed, data, mode: "iri", only: -1, at: -1, range: null, page: 0});
    readColours();
    this.views = [];
    if (windows.placed) this.views.push(this.map = new TrackMap(this, byId("map")));
    if (windows.total_m > 0) this.views.push(this.curves = new Curves(this, byId("curves")));
    this.listen();
    this.tabulate();
    this.map?.fit();
    this.curves?.fit();
  }

  // --- what is pointed at, and what is chosen ---

  // Show a window everywhere; the view in which it was pointed at stays as it is.
  point(i, source = null) {
    if (i === this.at) return;
    this.at = i;
    for (const view of this.views) {
      if (view !== source && i >= 0) view.show(i);
      view.drawOver();
    }
    byId("reading").replaceChildren(...(i < 0 ? [element("p", {className: "hint", textContent: HINT})] : this.reading(i)));
    this.follow();
  }

  // From key to key: with Shift the range grows from where one was.
  walk(to, grow) {
    const now = Math.max(this.at, 0), next = clamp(to, 0, this.windows.count - 1);
    if (grow) {
      this.anchor ??= now;
      this.select([Math.min(this.anchor, next), Math.max(this.anchor, next)]);
    } else this.anchor = null;
    this.point(next);
  }

  select(range) {
    this.range = range;
    if (!range) this.anchor = null;
    for (const view of this.views) view.drawOver();
    byId("range").hidden = !range;
    if (range) byId("figures").replaceChildren(...this.figures(...range));
    this.page = 0;
    this.tabulate();
    this.follow();
  }

  // The words follow the pictures down the page once there are any.
  follow() { byId("reading").parentElement.classList.toggle("live", this.at >= 0 || this.range !== null); }

  // Whether a window is of the drive that is looked at alone, or all are.
  shows(i) { return this.only < 0 || this.windows.drive[i] === this.only; }

  // Look at one drive alone; -1: at all.
  lookAt(drive) {
    this.only = drive;
    if (this.at >= 0 && !this.shows(this.at)) this.point(-1);
    if (this.map) this.map.still = null;
    if (drive < 0) { this.map?.fit(); this.curves?.fit(); return; }
    const [from, to] = this.windows.ofDrive(drive);
    this.map?.fit(from, to);
    this.curves?.look(this.windows.begin(from), this.windows.end_m[to]);
  }

  // --- words ---

  instant(i) {
    const start_s = this.data.drives[this.windows.drive[i]].start_s, since_s = this.windows.since_s[i];
    if (start_s === null || since_s !== since_s) return "date not known";
    return new Date(1000 * (start_s + since_s)).toISOString().slice(0, 19).replace("T", " ") + " UTC";
  }

  pair(name, value, under = "") {
    return element("div", {}, element("dt", {textContent: name}),
                   element("dd", {textContent: value + " "}, element("small", {textContent: under})));
  }

  reading(i) {
    const {windows: way, data} = this, drive = way.drive[i];
    const where = element("p", {className: "where"},
      element("b", {textContent: `Drive ${drive + 1}`}), ` · ${this.instant(i)} · ${distance(way.middle(i))} along · `);
    if (way.hasPlace(i)) {
      const [lat, lon] = [way.lat_deg[i].toFixed(6), degrees(way.lon_deg[i]).toFixed(6)];
      where.append(element("a", {href: `geo:${lat},${lon}`, textContent: `${lat}, ${lon}`}));
    } else where.append("place not known");
    const error = way.iri_std_m_per_km[i];
    const iri = number(way.iri_m_per_km[i], 2) + (error >= 0 ? ` ± ${error.toFixed(2)}` : "");
    const at = way.placeOf(i), {passed} = this;
    const together = at < 0 ? [] : [this.pair(`Mean of ${passed.drives[at]} drives here`,
      `${passed.iri_m_per_km[at].toFixed(2)} ± ${passed.iri_std_m_per_km[at].toFixed(2)}`, "m/km")];
    const flags = way.flagsOf(i).map(flag => `${flag}: ${data.meanings[flag] ?? "not explained here"}`);
    return [where,
      element("dl", {}, this.pair("IRI", iri, `m/km ${data.names.iri[way.iri_rank[i]] ?? "no class"}`), ...together,
              this.pair("a_w", number(way.a_w_mps2[i], 3), `m/s² ${data.names.comfort[way.comfort_rank[i]] ?? ""}`),
              this.pair("Speed", number(way.speed_mps[i] * 3.6, 0), "km/h")),
      element("p", {className: flags.length ? "flagged" : "hint",
                    textContent: flags.length ? `Flags: ${flags.join("; ")}` : "No flag."})];
  }

  figures(from, to) {
    const {windows: way, data} = this, sum = way.summary(from, to);
    const where = `${distance(way.begin(from))} to ${distance(way.end_m[to])} along, ${this.instant(from)}`;
    const parts = sum.shares.filter(([, metre]) => metre > 0).map(([rank, metre]) =>
      `${data.letters[rank] ?? "no value"} ${number(100 * metre / sum.metre, 0)}%`);
    const bar = element("div", {className: "stack"});
    for (const [rank, metre] of sum.shares) {
      const part = element("i", {className: rank < 0 ? "fx" : `f${rank}`});
      part.style.flexGrow = metre;
      bar.append(part);
    }
    return [
      element("p", {className: "where"}, element("b", {textContent: "Range"}), ` · ${where}`),
      element("dl", {}, this.pair("Distance", distance(sum.metre), duration(sum.second)),
              this.pair("Mean IRI", number(sum.iri, 2), "m/km"),
              this.pair("Worst IRI", number(way.iri_m_per_km[sum.worst], 1), "m/km"),
              this.pair("a_w", number(sum.a_w, 3), "m/s²"), this.pair("Mean speed", number(sum.speed_mps * 3.6, 0), "km/h")),
      bar, element("p", {className: "hint", textContent: `${parts.join(" · ")} · ${sum.windows} windows, `
                                                         + `${sum.flagged} of them with a flag or without a value`})];
  }

  // --- the table behind the pictures ---

  tabulate() {
    const {windows: way, data} = this, [from, to] = this.range ?? [0, way.count - 1];
    const pages = Math.max(Math.ceil((to - from + 1) / ROWS), 1);
    this.page = clamp(this.page, 0, pages - 1);
    const rows = [];
    for (let i = from + this.page * ROWS; i <= Math.min(to, from + (this.page + 1) * ROWS - 1); i++) {
      const cells = [
        way.drive[i] + 1, way.row[i], this.instant(i).replace(" UTC", ""), number(way.begin(i), 0),
        number(way.lat_deg[i], 5), number(degrees(way.lon_deg[i]), 5), number(way.speed_mps[i] * 3.6, 0),
        number(way.iri_m_per_km[i], 2), number(way.iri_std_m_per_km[i], 2), number(way.a_w_mps2[i], 3),
        number(way.mtvv_mps2[i], 2), number(way.vdv_mps175[i], 2), number(way.crest_factor[i], 1),
        data.letters[way.iri_rank[i]] ?? "", data.names.comfort[way.comfort_rank[i]] ?? "", way.flagsOf(i).join(" ")];
      const row = element("tr", {}, ...cells.map(cell => element("td", {textContent: cell})));
      row.addEventListener("click", () => this.point(i));
      rows.push(row);
    }
    byId("rows").replaceChildren(...rows);
    byId("rows-of").textContent = `Page ${this.page + 1} of ${pages}` + (this.range ? ", the range only" : "");
  }

  // --- buttons ---

  listen() {
    const on = (selector, act) => {
      for (const found of document.querySelectorAll(selector)) found.addEventListener("click", () => act(found));
    };
    on("button[data-mode]", button => {
      this.mode = byId("views").dataset.mode = button.dataset.mode;
      for (const other of document.querySelectorAll("button[data-mode]"))
        other.setAttribute("aria-pressed", String(other === button));
      this.map?.repaint();
    });
    byId("only")?.addEventListener("change", event => this.lookAt(Number(event.target.value)));
    on("#range-look", () => {
      this.map?.fit(...this.range);
      this.curves?.look(this.windows.begin(this.range[0]), this.windows.end_m[this.range[1]]);
    });
    on("#range-clear", () => this.select(null));
    on("#look-all", () => { this.map?.fit(); this.curves?.fit(); });
    on("[data-turn]", button => {
      this.page = {first: 0, last: Infinity}[button.dataset.turn] ?? this.page + Number(button.dataset.turn);
      this.tabulate();
    });
    on("[data-window]", button => {
      this.point(Number(button.dataset.window));
      byId("views").scrollIntoView({block: "start"});
    });
    document.addEventListener("keydown", event => {
      if (event.key === "Escape") { this.select(null); this.point(-1); }
    });
    // Canvases do not follow the style sheet by themselves, and paper is white whatever the screen is.
    const repaint = paper => {
      document.documentElement.toggleAttribute("data-paper", paper);
      readColours();
      if (this.map) this.map.still = null;
      this.map?.drawWay();
      this.map?.drawMarks();
      this.curves?.drawCurves();
      this.curves?.drawMarks();
    };
    window.addEventListener("beforeprint", () => repaint(true));
    window.addEventListener("afterprint", () => repaint(false));
    matchMedia("print").addEventListener("change", event => repaint(event.matches));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => repaint(false));
  }
}

(async () => {
  const data = JSON.parse(byId("data").textContent), base = await unpacked(data.base);
  const passed = data.passed && await unpacked(data.passed);
  project(base);
  const report = new Report(new Windows(await unpacked(data.windows), data), base, passed, data);
  for (const view of report.views) view === report.map ? view.drawWay() : view.drawCurves();
  document.documentElement.dataset.shown = "";  // all is in place
  performance.mark("shown");
})();
