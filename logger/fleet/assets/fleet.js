// The map of a fleet's roads. Its tiles are scripts beside the page, each of which calls fleetTile: a page that is opened
// from a folder may not fetch files, but may load scripts.

const CELLS = 64;         // squares across a tile, as logger/fleet/tiles.py makes them
const MOST_TILES = 400;   // kept
const QUARTER_MS = 365.25 * 86400e3 / 4;
const byId = id => document.getElementById(id);

const tiles = new Map();
let map;

function fleetTile(name, content) {
  tiles.set(name, content);
  map.repaint();
  if (map.going) map.look(map.width / 2, map.height / 2);
}

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

class FleetMap extends TrackMap {
  constructor(data, place) {
    super({windows: {count: 1}}, place);
    Object.assign(this, {data, mode: "m", chosen: null});
    this.fit();
  }

  fit() {
    if (!this.data) return;
    const [west, top, east, bottom] = this.data.box, {width, height} = this;
    this.x = (west + east) / 2;
    this.y = (top + bottom) / 2;
    const least = 300 / (WORLD_M * Math.cos(this.latitude()));
    this.scale = Math.min((width - 60) / Math.max(east - west, least), (height - 60) / Math.max(bottom - top, least));
    this.widest = this.scale / 4;
    this.fitted = true;
    this.repaint();
    this.drawOver();
  }

  goTo(lat, lon) {
    this.x = lon / 360 + 0.5;
    this.y = 0.5 - Math.asinh(Math.tan(lat * Math.PI / 180)) / (2 * Math.PI);
    this.scale = TILE_PX * 2 ** (this.data.deepest + 1);
    this.moved();
    this.going = true;
    this.look(this.width / 2, this.height / 2);
  }

  drawWay() {
    if (!this.data) return;
    const {ink, width, height} = sheet(this.canvas), {levels, deepest} = this.data;
    const zoom = this.level = clamp(Math.round(Math.log2(this.scale / TILE_PX)), levels, deepest), count = 2 ** zoom;
    const first = [this.x - width / 2 / this.scale, this.y - height / 2 / this.scale].map(one => Math.floor(one * count));
    const last = [this.x + width / 2 / this.scale, this.y + height / 2 / this.scale].map(one => Math.floor(one * count));
    this.wanted = new Set();
    for (let x = first[0]; x <= last[0]; x++)
      for (let y = first[1]; y <= last[1]; y++) this.drawTile(ink, zoom, x, y);
    for (const name of tiles.keys()) if (tiles.size > MOST_TILES && !this.wanted.has(name)) tiles.delete(name);
    this.drawScale(ink, width, height);
  }

  drawTile(ink, zoom, x, y) {
    const tile = this.tile(zoom, x, y);
    if (!tile) return;
    const side = this.scale / 2 ** zoom, left = this.left(x / 2 ** zoom), top = this.top(y / 2 ** zoom);
    if (tile.at) {
      const cell = side / CELLS, size = Math.max(cell, 2.5) + 0.5;
      tile.at.forEach((at, i) => {
        ink.fillStyle = this.colour(tile, i);
        ink.fillRect(left + at % CELLS * cell, top + Math.floor(at / CELLS) * cell, size, size);
      });
      return;
    }
    const half = this.data.segment_m / 2 / this.metresPerPixel();
    for (const [colour, wide] of [[() => colours.casing, 6.5], [i => this.colour(tile, i), 4.5]])
      tile.x.forEach((px, i) => {
        const turn = tile.h[i] * Math.PI / 180, dx = Math.sin(turn) * half, dy = -Math.cos(turn) * half;
        const cx = left + px / 4096 * side, cy = top + tile.y[i] / 4096 * side;
        ink.strokeStyle = colour(i);
        ink.lineWidth = wide;
        ink.beginPath();
        ink.moveTo(cx - dx, cy - dy);
        ink.lineTo(cx + dx, cy + dy);
        ink.stroke();
      });
  }

  // A tile that is there; false: nothing was measured there; else it is being loaded. Each tile says which of the four
  // below it there are, so that no file is asked for in vain.
  tile(zoom, x, y) {
    const name = `${zoom}/${x}_${y}`;
    this.wanted.add(name);
    if (tiles.has(name)) return tiles.get(name);
    let there = this.data.roots.includes(name);
    if (zoom > this.data.levels) {
      const above = this.tile(zoom - 1, x >> 1, y >> 1);
      if (above === null) return null;
      there = above && above.n >> (x & 1) + 2 * (y & 1) & 1;
    }
    tiles.set(name, there ? null : false);
    if (there) {
      const script = element("script", {src: `tiles/${name}.js`});
      script.onload = () => script.remove();
      document.head.append(script);
    }
    return tiles.get(name);
  }

  colour(tile, i) {
    if (this.mode === "t") return colours[tile.c[i] ? "c5" : "none"];
    const iri = (this.mode === "w" && tile.w ? tile.w : tile.m)[i] / 100;
    let rank = 0;
    while (rank < this.data.limits.length && iri >= this.data.limits[rank]) rank++;
    return colourOf(rank);
  }

  drawMarks() {
    const {ink} = sheet(this.over);
    if (!this.chosen) return;
    const x = this.left(this.chosen.x), y = this.top(this.chosen.y);
    circle(ink, x, y, 10, colours.ground, null, 6);
    circle(ink, x, y, 10, colours.ink, null, 3);
  }

  point(px, py, pressed = false) { if (pressed) this.look(px, py); }

  // What lies at a place of the picture: a segment with its history, or the mean of a square.
  look(px, py) {
    this.wish = [this.x + (px - this.width / 2) / this.scale, this.y + (py - this.height / 2) / this.scale];
    const zoom = this.level = clamp(Math.round(Math.log2(this.scale / TILE_PX)), this.data.levels, this.data.deepest);
    const [wx, wy] = this.wish, count = 2 ** zoom, reach = REACH_PX / this.scale;
    let best = reach;
    this.chosen = null;
    for (let x = Math.floor((wx - reach) * count); x <= Math.floor((wx + reach) * count); x++)
      for (let y = Math.floor((wy - reach) * count); y <= Math.floor((wy + reach) * count); y++) {
        const tile = tiles.get(`${zoom}/${x}_${y}`);
        for (let i = 0; tile && i < tile.m.length; i++) {
          const at = tile.at ? [(tile.at[i] % CELLS + 0.5) / CELLS, (Math.floor(tile.at[i] / CELLS) + 0.5) / CELLS]
            : [tile.x[i] / 4096, tile.y[i] / 4096];
          const place = [(x + at[0]) / count, (y + at[1]) / count], off = Math.hypot(place[0] - wx, place[1] - wy);
          if (off < best) { best = off; this.chosen = {x: place[0], y: place[1], tile, i}; }
        }
      }
    this.going &&= !this.chosen;
    this.tell();
    this.drawOver();
  }

  tell() {
    const place = byId("reading");
    if (!this.chosen) return place.replaceChildren(element("p", {className: "hint", textContent: byId("hint").textContent}));
    const {tile, i, x, y} = this.chosen, iri = value => (value / 100).toFixed(2);
    const lat = Math.atan(Math.sinh((0.5 - y) * 2 * Math.PI)) * 180 / Math.PI;
    const where = element("p", {className: "where", textContent: `${lat.toFixed(5)}, ${((x - 0.5) * 360).toFixed(5)}`});
    const list = element("dl");
    const say = (name, value, unit) => list.append(element("div", {}, element("dt", {textContent: name}),
      element("dd", {}, value, element("small", {textContent: ` ${unit}`}))));
    say("IRI", iri(tile.m[i]), "m/km");
    if (tile.at) {
      say("roughest segment", iri(tile.w[i]), "m/km");
      return place.replaceChildren(where, list, element("p", {className: "hint",
        textContent: "The mean of what lies in this square. Zoom in for single segments and their history."}));
    }
    if (tile.s[i] !== null) say("standard error", iri(tile.s[i]), "m/km");
    if (tile.t[i] !== null) say("change", `${tile.t[i] > 0 ? "+" : ""}${iri(tile.t[i])} ± ${iri(tile.u[i])}`, "m/km a year");
    say("cars", tile.k[i], "");
    say("passes", tile.n[i], "");
    say("last seen", new Date(tile.d[i] * 86400e3).toISOString().slice(0, 10), "");
    const picture = element("canvas", {className: "history", role: "img", ariaLabel: "IRI of the segment by quarter"});
    place.replaceChildren(where, list, picture);
    drawHistory(picture, tile.q[i]);
  }
}

// Means of quarters: [quarter since 1970, IRI x 100, passes], ...
function drawHistory(canvas, history) {
  const {ink, width, height} = sheet(canvas), left = 44, bottom = height - 22;
  const most = niceStep(Math.max(...history.map(([, iri]) => iri)) / 100 * 1.05);
  const first = history[0][0], span = Math.max(history.at(-1)[0] - first, 1);
  const at = ([quarter, iri]) => [left + (quarter - first + 0.5) / (span + 1) * (width - left - 10),
                                  bottom - iri / 100 / most * (bottom - 10)];
  for (const share of [0, 0.5, 1]) {
    const y = bottom - share * (bottom - 10);
    ink.strokeStyle = colours.line;
    ink.lineWidth = 1;
    ink.beginPath(); ink.moveTo(left, y); ink.lineTo(width, y); ink.stroke();
    write(ink, String(share * most), left - 6, y + 4, {align: "right"});
  }
  ink.strokeStyle = colours.ink;
  ink.lineWidth = 1.5;
  ink.beginPath();
  history.forEach((one, i) => ink[i ? "lineTo" : "moveTo"](...at(one)));
  ink.stroke();
  for (const one of history) circle(ink, ...at(one), 3 + Math.min(Math.sqrt(one[2]), 5) / 2, colours.ground, colours.ink, 1.5);
  const month = quarter => new Date(quarter * QUARTER_MS).toISOString().slice(0, 7);
  write(ink, month(first), left, height - 4);
  if (history.length > 1) write(ink, month(history.at(-1)[0]), width, height - 4, {align: "right"});
}

readColours();
map = new FleetMap(JSON.parse(byId("data").textContent), byId("map"));
for (const button of document.querySelectorAll("[data-mode]"))
  button.addEventListener("click", () => {
    map.mode = button.dataset.mode;
    for (const one of document.querySelectorAll("[data-mode]")) one.setAttribute("aria-pressed", one === button);
    map.repaint();
  });
for (const button of document.querySelectorAll("[data-lat]"))
  button.addEventListener("click", () => {
    map.goTo(Number(button.dataset.lat), Number(button.dataset.lon));
    byId("map").scrollIntoView({block: "nearest"});
  });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColours(); map.repaint(); });
document.documentElement.dataset.shown = "";
