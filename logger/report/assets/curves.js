// IRI, weighted acceleration and speed over the distance, one above the other, and where windows carry flags.

const GAP_PX = 26, AXIS_PX = 30, FLAGS_PX = 8;
const COLUMN_PX = 1.5;   // windows that share so much of the width are one mean
const CLICK_PX = 5;      // a press that travels less chooses a window, not a range

class Curves {
  constructor(report, place) {
    Object.assign(this, {report, place, from: 0, to: Math.max(report.windows.total_m, 1)});
    [this.canvas, this.over] = place.querySelectorAll("canvas");
    this.draw = atNextFrame(() => this.drawCurves());
    this.drawOver = atNextFrame(() => this.drawMarks());
    this.measure();
    this.listen();
  }

  // How large the picture is. It is kept, because a browser that is asked may lay out its page again.
  measure() { [this.width, this.height] = [this.canvas.clientWidth, this.canvas.clientHeight]; }

  get left() { return 40; }
  get right() { return this.width - (this.width < 500 ? 14 : 62); }
  px(along_m) { return this.left + (along_m - this.from) / (this.to - this.from) * (this.right - this.left); }
  along(px) { return this.from + (px - this.left) / (this.right - this.left) * (this.to - this.from); }

  // --- which part ---

  look(from, to) {
    const most = Math.max(this.report.windows.total_m, 1), least = Math.min(most, 4 * this.report.windows.average_m);
    const span = clamp(to - from, least, most), start = clamp((from + to - span) / 2, 0, most - span);
    [this.from, this.to] = [start, start + span];
    this.draw();
    this.drawOver();
  }

  zoom(factor, px = (this.left + this.right) / 2) {
    const about = this.along(px);
    this.look(about - (about - this.from) / factor, about + (this.to - about) / factor);
  }

  fit() { this.look(0, Infinity); }

  show(i) {
    const at = this.report.windows.middle(i), span = this.to - this.from;
    if (at < this.from || at > this.to) this.look(at - span / 2, at + span / 2);
  }

  // --- drawing ---

  panels() {
    const {limits, letters} = this.report.data, height = this.height - AXIS_PX - FLAGS_PX - 6;
    const each = height / 3 - GAP_PX, top = number => number * height / 3 + GAP_PX - 4;
    return [
      {title: "Roughness, IRI [m/km]", value: "iri", error: "iriError", worst: "iriWorst", column: "iri_m_per_km",
       levels: limits.iri, names: letters.slice(1), factor: 1, top: top(0), height: each},
      {title: "Weighted acceleration, a_w [m/s²]", value: "comfort", worst: "comfortWorst", column: "a_w_mps2",
       levels: limits.comfort.slice(1), names: ["fairly", "", "very", "extreme"], factor: 1, top: top(1), height: each},
      {title: "Speed [km/h]", value: "speed", column: "speed_mps", levels: [], names: [], factor: 3.6, top: top(2),
       height: each}];
  }

  drawCurves() {
    const {ink, width} = sheet(this.canvas), {windows} = this.report;
    const group = windows.level((this.to - this.from) / (this.right - this.left) * COLUMN_PX);
    const seen = this.groupsInView(group);
    for (const panel of this.panels()) this.drawPanel(ink, panel, group, seen);
    this.drawFlags(ink, group, seen);
    this.drawAxis(ink, width);
    this.place.dataset.group = 2 ** group.k;
  }

  groupsInView(group) {
    const {windows} = this.report, seen = [];
    for (let g = 0; g < group.count; g++)
      if (windows.end_m[group.first[g + 1] - 1] >= this.from && windows.begin(group.first[g]) <= this.to) seen.push(g);
    return seen;
  }

  drawPanel(ink, panel, group, seen) {
    const {windows} = this.report, {first} = group, values = group[panel.value];
    let high = 0;
    for (const g of seen) {
      const worst = panel.worst ? windows[panel.column][group[panel.worst][g]] : NaN;
      high = Math.max(high, (values[g] || 0) + (group[panel.error]?.[g] || 0), worst || 0);
    }
    high = high * panel.factor || 1;
    const step = niceStep(high / 4.2), ceiling = Math.max(high * 1.02, step);
    const bottom = panel.top + panel.height;
    const y = value => bottom - clamp(value * panel.factor / ceiling, 0, 1) * panel.height;
    const x = g => this.px((windows.begin(first[g]) + windows.end_m[first[g + 1] - 1]) / 2);
    write(ink, panel.title, this.left, panel.top - 9, {colour: colours.ink, halo: colours.ground, weight: 600});
    ink.lineWidth = 1;
    for (let value = 0; value <= ceiling; value += step) {
      const at = Math.round(y(value / panel.factor)) + 0.5;
      this.across(ink, at, colours.faint, []);
      write(ink, String(Number(value.toPrecision(6))), this.left - 7, at + 4, {align: "right", halo: colours.ground});
    }
    let named = -Infinity;
    panel.levels.forEach((level, number) => {
      if (level > ceiling) return;
      this.across(ink, y(level), colours.soft, [1, 4]);
      if (this.right < this.width - 40 && y(level) < bottom && Math.abs(named - y(level)) > 12) {
        write(ink, panel.names[number], this.right + 7, y(level) + 4, {halo: colours.ground});
        named = y(level);
      }
    });
    ink.save();
    ink.beginPath();
    ink.rect(this.left, panel.top - 4, this.right - this.left, panel.height + 8);
    ink.clip();
    if (panel.worst && group.k > 0) this.drawReach(ink, panel, group, seen, x, y);
    const runs = this.runs(seen, group, values);
    if (panel.error) this.drawBand(ink, runs, values, group[panel.error], x, y);
    ink.strokeStyle = ink.fillStyle = colours.ink;
    ink.lineWidth = 1.3;
    for (const run of runs) {
      ink.beginPath();
      if (run.length === 1) { ink.arc(x(run[0]), y(values[run[0]]), 1.8, 0, 2 * Math.PI); ink.fill(); continue; }
      run.forEach((g, number) => ink[number ? "lineTo" : "moveTo"](x(g), y(values[g])));
      ink.stroke();
    }
    ink.restore();
    if (panel.value === "iri") this.drawPlaces(ink, y);
  }

  across(ink, at, colour, dashes) {
    ink.strokeStyle = colour;
    ink.lineWidth = 1;
    ink.setLineDash(dashes);
    ink.beginPath();
    ink.moveTo(this.left, at);
    ink.lineTo(this.right, at);
    ink.stroke();
    ink.setLineDash([]);
  }

  // Stretches of groups with a value, without the end of a drive in them.
  runs(seen, group, values) {
    const {windows} = this.report, runs = [];
    let open = false;
    for (const g of seen) {
      if (windows.begins[group.first[g]] === 2) open = false;
      if (!(values[g] >= 0)) { open = false; continue; }
      if (open) runs.at(-1).push(g); else runs.push([g]);
      open = true;
    }
    return runs;
  }

  drawBand(ink, runs, values, errors, x, y) {
    ink.fillStyle = colours.band;
    for (const run of runs) {
      ink.beginPath();
      for (const g of run) ink.lineTo(x(g), y(values[g] + (errors[g] || 0)));
      for (const g of [...run].reverse()) ink.lineTo(x(g), y(values[g] - (errors[g] || 0)));
      ink.fill();
    }
  }

  // From the mean of a group up to its worst window, which the mean would hide.
  drawReach(ink, panel, group, seen, x, y) {
    const column = this.report.windows[panel.column];
    ink.strokeStyle = colours.none;
    ink.lineWidth = 1;
    ink.beginPath();
    for (const g of seen) {
      const worst = column[group[panel.worst][g]];
      if (!(worst >= 0)) continue;
      ink.moveTo(x(g), y(group[panel.value][g]));
      ink.lineTo(x(g), y(worst));
    }
    ink.stroke();
  }

  drawPlaces(ink, y) {
    const {windows, data} = this.report;
    const spots = data.places.map((i, n) => (
      {x: this.px(windows.middle(i)), y: y(windows.iri_m_per_km[i]), number: n + 1}));
    mark(ink, spots.filter(({x}) => x >= this.left && x <= this.right));
  }

  // A strip below: what carries a flag, and what has no value.
  drawFlags(ink, group, seen) {
    const {windows} = this.report, top = this.height - AXIS_PX - FLAGS_PX;
    for (const wanted of [1, 2]) {
      ink.fillStyle = wanted === 1 ? colours.c3 : colours.none;
      for (const g of seen) {
        if (group.trust[g] !== wanted) continue;
        const from = Math.max(this.px(windows.begin(group.first[g])), this.left);
        const to = Math.min(this.px(windows.end_m[group.first[g + 1] - 1]), this.right);
        ink.fillRect(from, top, Math.max(to - from, 1), FLAGS_PX);
      }
    }
    ink.strokeStyle = colours.line;
    ink.lineWidth = 1;
    ink.strokeRect(this.left + 0.5, top + 0.5, this.right - this.left - 1, FLAGS_PX - 1);
    write(ink, "flags", this.left - 7, top + 8, {align: "right", halo: colours.ground});
  }

  drawAxis(ink, width) {
    const {windows} = this.report, bottom = this.height, span = this.to - this.from;
    const inMetres = span < 1000, unit = inMetres ? 1 : 1000;
    const step = niceStep(span / unit / Math.max((this.right - this.left) / 90, 2));
    ink.font = "12px system-ui";
    const name = inMetres ? "distance [m]" : "distance [km]";
    for (let tick = Math.ceil(this.from / unit / step) * step; tick <= this.to / unit; tick += step) {
      const x = this.px(tick * unit), last = tick + step > this.to / unit;
      write(ink, String(Number(tick.toPrecision(7))), x, bottom - AXIS_PX + 15, {align: "center", halo: colours.ground});
      if (last) break;
    }
    write(ink, name, this.right, bottom - 2, {align: "right", halo: colours.ground});
    ink.strokeStyle = colours.soft;
    ink.lineWidth = 1;
    ink.setLineDash([4, 3]);
    for (let i = 1, begun = this.left; i < windows.count; i++) {  // where a new drive begins, if there is room for a line
      if (windows.begins[i] !== 2) continue;
      const x = Math.round(this.px(windows.begin(i))) + 0.5;
      if (x < this.left || x > this.right || x - begun < 12 && windows.drive.at(-1) > 40) continue;
      begun = x;
      ink.beginPath();
      ink.moveTo(x, 14);
      ink.lineTo(x, bottom - AXIS_PX);
      ink.stroke();
    }
    ink.setLineDash([]);
  }

  // What changes with the pointer: the range, and the window that is read.
  drawMarks() {
    const {ink} = sheet(this.over), {windows, at, range} = this.report, bottom = this.height - AXIS_PX;
    if (range) {
      const from = Math.max(this.px(windows.begin(range[0])), this.left);
      const to = Math.min(this.px(windows.end_m[range[1]]), this.right);
      if (to > from) {
        ink.globalAlpha = 0.16;
        ink.fillStyle = colours.c0;
        ink.fillRect(from, 14, to - from, bottom - 14);
        ink.globalAlpha = 1;
        ink.fillStyle = colours.c0;
        ink.fillRect(from, 14, 1.5, bottom - 14);
        ink.fillRect(to - 1.5, 14, 1.5, bottom - 14);
      }
    }
    if (at < 0) return;
    const x = this.px(windows.middle(at));
    if (x < this.left - 1 || x > this.right + 1) return;
    ink.strokeStyle = colours.ink;
    ink.lineWidth = 1;
    ink.beginPath();
    ink.moveTo(x, 14);
    ink.lineTo(x, bottom);
    ink.stroke();
  }

  // --- pointers and keys ---

  listen() {
    const {canvas, report} = this, local = event => event.clientX - canvas.getBoundingClientRect().left;
    const at = px => report.windows.atDistance(clamp(this.along(px), this.from, this.to));
    let pressed = null;
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      const amount = event.deltaMode ? 20 : 1, span = this.to - this.from;
      const aside = (event.shiftKey ? event.deltaY : event.deltaX) * amount / (this.right - this.left) * span;
      if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) this.look(this.from + aside, this.to + aside);
      else this.zoom(2 ** (-event.deltaY * amount / 240), local(event));
    }, {passive: false});
    canvas.addEventListener("pointerdown", event => {
      if (event.button) return;
      canvas.setPointerCapture(event.pointerId);
      pressed = local(event);
    });
    canvas.addEventListener("pointermove", event => {
      const px = local(event);
      if (pressed !== null && Math.abs(px - pressed) > CLICK_PX)
        report.select([Math.min(at(px), at(pressed)), Math.max(at(px), at(pressed))]);
      if (pressed !== null || event.pointerType === "mouse") report.point(at(px), this);
    });
    canvas.addEventListener("pointerup", event => {
      if (pressed !== null && Math.abs(local(event) - pressed) <= CLICK_PX) report.point(at(local(event)), this);
      pressed = null;
    });
    canvas.addEventListener("pointercancel", () => { pressed = null; });
    canvas.addEventListener("keydown", event => {
      const step = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
      const to = {Home: 0, End: report.windows.count - 1}[event.key] ?? (step ? report.at + step : null);
      const zooms = {"+": 1.5, "=": 1.5, "-": 1 / 1.5}[event.key];
      if (to === null && !zooms && event.key !== "0" || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      if (zooms) this.zoom(zooms, report.at < 0 ? undefined : this.px(report.windows.middle(report.at)));
      else if (event.key === "0") this.fit();
      else report.walk(to, event.shiftKey);
    });
    new ResizeObserver(() => { this.measure(); this.draw(); this.drawOver(); }).observe(canvas);
  }
}
