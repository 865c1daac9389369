// The way on the ground. It is drawn in pieces of some pixels: as many windows as fit one piece are one mean.

const WORLD_M = 2 * Math.PI * 6378137;  // once around the Earth at the equator, as Web Mercator takes it (EPSG:3857)
const PIECE_PX = 4;       // shorter pieces of colour are blur
const STROKES = 300;      // pieces in one stroke: long paths that cross themselves are slow to fill
const FAR_M = 8;          // in a pixel: from here on streets of a town lie close to one another, and lines are thin
const MARGIN = 0.2;       // of the view, that is painted around it
const REST_MS = 150;      // without a move
const REACH_PX = 32;      // how near to the way a pointer has to be
const CLOSEST_M = 0.02;   // in a pixel
const TILE_PX = 256;

class TrackMap {
  constructor(report, place) {
    Object.assign(this, {report, place, fingers: new Map(), tiles: new Map()});
    [this.canvas, this.over] = place.querySelectorAll("canvas");
    this.draw = atNextFrame(() => this.drawWay());
    this.drawOver = atNextFrame(() => this.drawMarks());
    this.measure();
    this.listen();
  }

  // How large the map is. It is kept, because a browser that is asked may lay out its page again.
  measure() { [this.width, this.height] = [this.canvas.clientWidth, this.canvas.clientHeight]; }

  // --- where things are ---

  // The whole way in view; or a stretch of windows.
  fit(from = 0, to = this.report.windows.count - 1) {
    const {x, y} = this.report.windows;
    let west = Infinity, east = -Infinity, top = Infinity, bottom = -Infinity;
    for (let i = from; i <= to; i++) {
      if (!this.report.windows.hasPlace(i)) continue;
      west = Math.min(west, x[i]); east = Math.max(east, x[i]);
      top = Math.min(top, y[i]); bottom = Math.max(bottom, y[i]);
    }
    if (west > east) return;
    const {width, height} = this;
    this.x = (west + east) / 2;
    this.y = (top + bottom) / 2;
    const least = 60 / (WORLD_M * Math.cos(this.latitude()));  // a single window needs some ground around it
    this.scale = Math.min(Math.max(width - 84, 100) / Math.max(east - west, least),
                          Math.max(height - 84, 100) / Math.max(bottom - top, least));
    this.widest = Math.min(this.widest ?? Infinity, this.scale / 4);
    this.fitted = from === 0 && to === this.report.windows.count - 1;
    this.draw();
    this.drawOver();
  }

  latitude() { return Math.atan(Math.sinh((0.5 - this.y) * 2 * Math.PI)); }
  metresPerPixel() { return WORLD_M * Math.cos(this.latitude()) / this.scale; }
  left(x) { return (x - this.x) * this.scale + this.width / 2; }
  top(y) { return (y - this.y) * this.scale + this.height / 2; }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y = clamp(this.y - dy / this.scale, 0, 1);
    this.moved();
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const closest = WORLD_M * Math.cos(this.latitude()) / CLOSEST_M;
    const scale = clamp(this.scale * factor, this.widest, closest), kept = 1 / this.scale - 1 / scale;
    this.x += (px - this.width / 2) * kept;
    this.y += (py - this.height / 2) * kept;
    this.scale = scale;
    this.moved();
  }

  moved() {
    this.fitted = false;
    this.draw();
    this.drawOver();
  }

  // Move so far that a window is in view.
  show(i) {
    const {windows} = this.report;
    if (!windows.hasPlace(i)) return;
    const x = this.left(windows.x[i]), y = this.top(windows.y[i]);
    if (x > 20 && y > 20 && x < this.width - 20 && y < this.height - 20) return;
    [this.x, this.y] = [windows.x[i], windows.y[i]];
    this.moved();
  }

  // --- drawing ---

  // What is slow to draw is kept as a picture somewhat larger than the view. While the map moves the picture moves; it
  // is painted again where it no longer covers the view, and sharp once the map rests at another scale.
  drawWay() {
    const {ink, width, height} = sheet(this.canvas);
    if (!this.covers(width, height)) this.paint(width, height);
    const {still} = this, grown = this.scale / still.scale;
    ink.drawImage(still.canvas, this.left(still.x) - still.width / 2 * grown, this.top(still.y) - still.height / 2 * grown,
                  still.width * grown, still.height * grown);
    clearTimeout(this.resting);
    if (grown !== 1) this.resting = setTimeout(() => this.repaint(), REST_MS);
    this.drawEnds(ink);
    this.drawWorst(ink);
    this.drawPlaces(ink);
    this.drawScale(ink, width, height);
  }

  repaint() {
    this.still = null;
    this.draw();
  }

  covers(width, height) {
    const {still} = this;
    if (!still || still.ofWidth !== width || still.ofHeight !== height) return false;
    const grown = this.scale / still.scale, spareX = (still.width * grown - width) / 2;
    const spareY = (still.height * grown - height) / 2;
    return grown < 2.5 && Math.abs(this.x - still.x) * this.scale <= spareX
      && Math.abs(this.y - still.y) * this.scale <= spareY;
  }

  paint(width, height) {
    const asideX = Math.round(width * MARGIN), asideY = Math.round(height * MARGIN), ratio = window.devicePixelRatio || 1;
    const canvas = this.still?.canvas ?? document.createElement("canvas");
    const wide = width + 2 * asideX, high = height + 2 * asideY;
    Object.assign(canvas, {width: Math.round(wide * ratio), height: Math.round(high * ratio)});
    this.still = {canvas, x: this.x, y: this.y, scale: this.scale, width: wide, height: high, ofWidth: width,
                  ofHeight: height};
    const ink = canvas.getContext("2d"), box = [-asideX, -asideY, width + asideX, height + asideY];
    ink.setTransform(ratio, 0, 0, ratio, asideX * ratio, asideY * ratio);
    this.drawTiles(ink, box);
    this.drawBase(ink, box);
    const {windows, mode} = this.report, group = this.group = windows.level(PIECE_PX * this.metresPerPixel());
    const cells = this.cells(group, box), byRank = new Map(), drawn = [];
    for (const cell of cells.values()) {
      const rank = cell.groups.length === 1 ? windows.rank(group, cell.groups[0], mode)
        : windows.rankOfSeveral(group, cell.groups, mode);
      if (!byRank.has(rank)) byRank.set(rank, []);
      byRank.get(rank).push(cell.groups[0]);
      drawn.push(cell.groups[0]);
    }
    this.seen = cells;
    const line = this.metresPerPixel() > FAR_M ? 3.4 : 5.5;
    this.stroke(ink, group, drawn, colours.casing, line + 2.4);
    // Where ways cross or lie side by side the worst is on top.
    for (const rank of [...byRank.keys()].sort((one, other) => one - other))
      this.stroke(ink, group, byRank.get(rank), colourOf(rank), line);
  }

  // Pieces in the box, those whose middles share some pixels together: drives over one street are one mean, drawn once.
  // Close by, where pixels are smaller than a receiver errs, those that were laid on one place.
  cells(group, [west, north, east, south]) {
    const {windows} = this.report, {first} = group, perMetre = 1 / this.metresPerPixel(), cells = new Map();
    const side = this.cellPx(group);
    for (let g = 0; g < group.count; g++) {
      const from = first[g], to = first[g + 1], middle = (from + to - 1) >> 1;
      if (!this.report.shows(from)) continue;
      const x = this.left(windows.x[middle]), y = this.top(windows.y[middle]);
      const reach = (windows.end_m[to - 1] - windows.begin(from)) * perMetre + 12;
      if (!(x > west - reach && y > north - reach && x < east + reach && y < south + reach)) continue;
      const place = group.k === 0 && this.report.only < 0 ? windows.placeOf(from) : -1;
      const key = place >= 0 ? -1 - place
        : Math.floor((x - west + 1e4) / side) * 1e6 + Math.floor((y - north + 1e4) / side);
      const cell = cells.get(key);
      if (cell) cell.groups.push(g); else cells.set(key, {groups: [g]});
    }
    return cells;
  }

  piecePx(group) { return 2 ** group.k * this.report.windows.average_m / this.metresPerPixel(); }
  cellPx(group) { return clamp(0.6 * this.piecePx(group), PIECE_PX, 10); }

  // A piece reaches from half-way to the window before it to half-way to the one after, through its middle. Short ones,
  // of which a neighbour may have been left out for another drive's, reach on to the middles of their neighbours.
  stroke(ink, group, pieces, colour, width) {
    const {windows} = this.report, {first} = group, long = this.piecePx(group) > 16;
    ink.strokeStyle = colour;
    ink.lineWidth = width;
    ink.lineCap = "butt";
    ink.lineJoin = "bevel";
    const middleOf = g => (first[g] + first[g + 1] - 1) >> 1;
    for (let at = 0; at < pieces.length; at += STROKES) {
      ink.beginPath();
      for (const g of pieces.slice(at, at + STROKES)) {
        const from = first[g], last = first[g + 1] - 1, middle = middleOf(g);
        const starts = windows.begins[from], ends = last + 1 === windows.count || windows.begins[last + 1];
        const x = this.left(windows.x[middle]), y = this.top(windows.y[middle]);
        if (starts && ends && from === last) {  // a window alone has no direction
          ink.moveTo(x - width / 2, y);
          ink.lineTo(x + width / 2, y);
          continue;
        }
        if (long) this.half(ink, "moveTo", from, starts ? from : from - 1);
        else this.half(ink, "moveTo", starts ? from : middleOf(g - 1));
        ink.lineTo(x, y);
        if (long) this.half(ink, "lineTo", last, ends ? last : last + 1);
        else this.half(ink, "lineTo", ends ? last : middleOf(g + 1));
      }
      ink.stroke();
    }
  }

  // To the place half-way between two windows.
  half(ink, go, one, other = one) {
    const {x, y} = this.report.windows;
    ink[go](this.left((x[one] + x[other]) / 2), this.top((y[one] + y[other]) / 2));
  }

  drawBase(ink, [west, north, east, south]) {
    const {base} = this.report;
    ink.strokeStyle = colours.line;
    ink.lineWidth = 2;
    ink.lineCap = "round";
    ink.beginPath();
    for (let i = 1; i < base.count; i++) {
      if (base.begins[i]) continue;
      const x0 = this.left(base.x[i - 1]), y0 = this.top(base.y[i - 1]);
      const x = this.left(base.x[i]), y = this.top(base.y[i]);
      if (Math.max(x0, x) < west || Math.min(x0, x) > east) continue;
      if (Math.max(y0, y) < north || Math.min(y0, y) > south) continue;
      if (i % STROKES === 0) { ink.stroke(); ink.beginPath(); }
      ink.moveTo(x0, y0);
      ink.lineTo(x, y);
    }
    ink.stroke();
  }

  // Street pictures of 256 pixels, only where the page was made with --tiles.
  drawTiles(ink, [west, north, east, south]) {
    const {tiles} = this.report.data;
    if (!tiles) return;
    const zoom = clamp(Math.round(Math.log2(this.scale / TILE_PX)), 0, 19), count = 2 ** zoom, side = this.scale / count;
    const {width, height} = this;
    const column = Math.floor((this.x + (west - width / 2) / this.scale) * count);
    const row = Math.max(Math.floor((this.y + (north - height / 2) / this.scale) * count), 0);
    for (let x = column; this.left(x / count) < east; x++)
      for (let y = row; y < count && this.top(y / count) < south; y++) {
        const address = tiles.replace("{z}", zoom).replace("{x}", (x % count + count) % count).replace("{y}", y);
        let picture = this.tiles.get(address);
        if (!picture) {
          this.tiles.set(address, picture = new Image());
          picture.onload = () => this.repaint();
          picture.src = address;
        }
        if (picture.complete && picture.naturalWidth)
          ink.drawImage(picture, this.left(x / count), this.top(y / count), side + 0.5, side + 0.5);
      }
  }

  drawEnds(ink) {
    const {windows} = this.report;
    if (this.report.data.drives.length > 1) return;
    let first = 0, last = windows.count - 1;
    while (!windows.hasPlace(first)) first++;
    while (!windows.hasPlace(last)) last--;
    for (const [i, text] of [[last, "End"], [first, "Start"]]) {
      const x = this.left(windows.x[i]), y = this.top(windows.y[i]);
      circle(ink, x, y, 6, colours.ink, colours.ground, 2.5);
      write(ink, text, x + 12, y + 4, {colour: colours.ink, weight: 650});
    }
  }

  // However far out one looks, and whatever the means say: the worst window of what is in view, with its value.
  drawWorst(ink) {
    const {windows, mode} = this.report, {width, height} = this;
    if (mode === "trust") return;
    const value = mode === "iri" ? windows.iri_m_per_km : windows.a_w_mps2, worsts = this.group[`${mode}Worst`];
    let worst = NaN;
    for (const {groups} of this.seen.values())
      for (const g of groups) {
        const i = worsts[g];
        if (!(value[i] >= 0) || value[i] <= value[worst] || !windows.counts[i]) continue;
        const x = this.left(windows.x[i]), y = this.top(windows.y[i]);
        if (x > 4 && y > 4 && x < width - 4 && y < height - 4) worst = i;
      }
    if (Number.isNaN(worst)) return;
    const x = this.left(windows.x[worst]), y = this.top(windows.y[worst]);
    const isTaken = this.report.data.places.some(i => Math.abs(this.left(windows.x[i]) - x) < 60
      && Math.abs(this.top(windows.y[i]) - y + 21) < 16);    // by the number of another place
    circle(ink, x, y, 11, colours.ink, null, 2);
    write(ink, `worst ${value[worst].toFixed(mode === "iri" ? 1 : 2)}`, clamp(x, 40, this.width - 40),
          y > 40 && !isTaken ? y - 17 : y + 26, {colour: colours.ink, align: "center", weight: 600});
  }

  drawPlaces(ink) {
    const {windows, data} = this.report;
    const spots = data.places.map((i, n) => ({x: this.left(windows.x[i]), y: this.top(windows.y[i]), number: n + 1}));
    this.place.dataset.marks = mark(ink, spots.filter((_, n) => windows.hasPlace(data.places[n]))).join(", ");
  }

  drawScale(ink, width, height) {
    const perPixel = this.metresPerPixel(), length_m = niceStep(70 * perPixel), length = length_m / perPixel;
    ink.lineCap = "butt";
    for (const [colour, line] of [[colours.panel, 5], [colours.ink, 1.5]]) {
      ink.strokeStyle = colour;
      ink.lineWidth = line;
      ink.beginPath();
      ink.moveTo(16, height - 20); ink.lineTo(16, height - 14);
      ink.lineTo(16 + length, height - 14); ink.lineTo(16 + length, height - 20);
      ink.moveTo(width - 24, 42); ink.lineTo(width - 24, 18);
      ink.moveTo(width - 29, 26); ink.lineTo(width - 24, 17); ink.lineTo(width - 19, 26);
      ink.stroke();
    }
    const text = length_m >= 1000 ? `${length_m / 1000} km` : length_m >= 1 ? `${length_m} m` : `${length_m * 100} cm`;
    write(ink, text, 16 + length / 2, height - 22, {align: "center", colour: colours.ink});
    write(ink, "N", width - 24, 57, {align: "center", colour: colours.ink});
    this.place.dataset.scale = `${length_m} m in ${length.toFixed(2)} px`;
  }

  // What changes with the pointer, on a sheet of its own.
  drawMarks() {
    const {ink} = sheet(this.over), {windows, at, range} = this.report;
    if (range) {
      for (const [colour, line] of [[colours.ground, 3.5], [colours.ink, 1.8]]) {
        ink.strokeStyle = colour;
        ink.lineWidth = line;
        ink.beginPath();
        const step = 2 ** windows.level(PIECE_PX * this.metresPerPixel()).k;
        let open = false;
        for (let i = range[0]; i <= range[1]; i++) {
          if (windows.begins[i]) open = false;
          if (!windows.hasPlace(i) || open && i % step && i !== range[1]) continue;
          if (open) ink.lineTo(this.left(windows.x[i]), this.top(windows.y[i]));
          else ink.moveTo(this.left(windows.x[i]), this.top(windows.y[i]));
          open = true;
        }
        ink.stroke();
      }
    }
    if (at >= 0 && windows.hasPlace(at)) {
      const x = this.left(windows.x[at]), y = this.top(windows.y[at]);
      circle(ink, x, y, 9, colours.ground, null, 6);
      circle(ink, x, y, 9, colours.ink, null, 3);
    }
  }

  // --- pointers and keys ---

  listen() {
    const {canvas, fingers} = this;
    const local = event => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoom(2 ** (-event.deltaY * (event.deltaMode ? 20 : 1) / 240), ...local(event));
    }, {passive: false});
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, local(event));
      this.travelled = fingers.size > 1 ? Infinity : 0;
    });
    canvas.addEventListener("pointermove", event => {
      const now = local(event), before = fingers.get(event.pointerId);
      if (!before) { if (event.pointerType === "mouse") this.point(...now); return; }
      const apart = () => {
        const [one, other] = [...fingers.values()];
        return Math.hypot(one[0] - other[0], one[1] - other[1]);
      };
      const wide = fingers.size === 2 ? apart() : 0;
      fingers.set(event.pointerId, now);
      this.travelled += Math.hypot(now[0] - before[0], now[1] - before[1]);
      this.pan((now[0] - before[0]) / fingers.size, (now[1] - before[1]) / fingers.size);
      if (wide > 0) {
        const [one, other] = [...fingers.values()];
        this.zoom(apart() / wide, (one[0] + other[0]) / 2, (one[1] + other[1]) / 2);
      }
    });
    const lift = event => {
      if (fingers.delete(event.pointerId) && event.type === "pointerup" && this.travelled < 6)
        this.point(...local(event), true);
    };
    canvas.addEventListener("pointerup", lift);
    canvas.addEventListener("pointercancel", lift);
    canvas.addEventListener("keydown", event => {
      const {width, height} = this;
      const act = {ArrowLeft: () => this.pan(width / 6, 0), ArrowRight: () => this.pan(-width / 6, 0),
                   ArrowUp: () => this.pan(0, height / 6), ArrowDown: () => this.pan(0, -height / 6),
                   "+": () => this.zoom(1.5), "=": () => this.zoom(1.5), "-": () => this.zoom(1 / 1.5),
                   0: () => this.fit()}[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act();
    });
    for (const button of this.place.querySelectorAll("[data-zoom]"))
      button.addEventListener("click", () => ({in: () => this.zoom(1.5), out: () => this.zoom(1 / 1.5),
                                               all: () => this.fit()})[button.dataset.zoom]());
    new ResizeObserver(() => {
      this.measure();
      if (this.fitted) this.fit();
      else { this.draw(); this.drawOver(); }
    }).observe(canvas);
  }

  point(px, py, pressed = false) {
    const {width, height} = this;
    const [i, off] = this.report.windows.nearest(this.x + (px - width / 2) / this.scale,
                                                 this.y + (py - height / 2) / this.scale,
                                                 one => this.report.shows(one));
    if (i >= 0 && off * this.scale < REACH_PX * (pressed ? 1.5 : 1)) this.report.point(i, this);
  }
}
