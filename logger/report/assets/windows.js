// The windows of the drives: unpacked, grouped for drawing, summed up. Nothing here draws.

const UNKNOWN = -(2 ** 31);  // as logger/report/track_data.py writes it

const TRUST_RANKS = [0, 3, -1];  // colours of: no flag, a flag beside a value, no value that counts

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// Columns by name. Four planes of bytes make whole numbers; sums undo the differences that were taken, and wrap as those.
async function unpacked({count, columns, packed}) {
  const stream = new Blob([Uint8Array.from(atob(packed), letter => letter.charCodeAt(0))]).stream();
  const bytes = new Uint8Array(await new Response(stream.pipeThrough(new DecompressionStream("deflate"))).arrayBuffer());
  const table = {count};
  columns.forEach(([name, steps, order], number) => {
    const whole = new Int32Array(count), values = table[name] = new Float64Array(count), at = 4 * count * number;
    for (let i = 0; i < count; i++) {
      const folded = bytes[at + i] | bytes[at + count + i] << 8 | bytes[at + 2 * count + i] << 16
        | bytes[at + 3 * count + i] << 24;
      whole[i] = folded >>> 1 ^ -(folded & 1);
    }
    for (let times = order; times > 0; times--) for (let i = 1; i < count; i++) whole[i] += whole[i - 1];
    for (let i = 0; i < count; i++) values[i] = whole[i] === UNKNOWN ? NaN : whole[i] / steps;
  });
  return table;
}

// Places in Web Mercator (EPSG:3857), the world being 1 wide and high, y downwards.
function project(table) {
  table.x = table.lon_deg.map(lon => lon / 360 + 0.5);
  table.y = table.lat_deg.map(lat => 0.5 - Math.asinh(Math.tan(clamp(lat, -85, 85) * Math.PI / 180)) / (2 * Math.PI));
}

// Groups of 2 ** k windows that follow each other without a gap: means weighted by length, and the worst of each.
function grouped(way, k) {
  const first = [];
  for (let i = 0, size = 0; i < way.count; i++, size++) {
    if (way.begins[i]) size = 0;
    if (size % 2 ** k === 0) first.push(i);
  }
  const group = {k, count: first.length};
  first.push(way.count);
  group.first = Int32Array.from(first);
  for (const name of ["iri", "iriError", "iriWorst", "comfort", "comfortWorst", "speed", "trust", "metre",
                      "second"])
    group[name] = new Float64Array(group.count).fill(NaN);
  for (let g = 0; g < group.count; g++) {
    let metre = 0, iri = 0, errorMetre = 0, error = 0, second = 0, square = 0, time = 0, distance = 0, trust = 0;
    let roughest = NaN, hardest = NaN;  // numbers of windows
    for (let i = first[g]; i < first[g + 1]; i++) {
      const length = way.length_m[i], lasts = way.duration_s[i];
      trust = Math.max(trust, way.trust[i]);
      if (way.speed_mps[i] >= 0) { time += lasts; distance += lasts * way.speed_mps[i]; }
      if (!way.counts[i] && k > 0) continue;  // alone a doubtful window is shown, with its flag; in a mean it has no place
      if (way.iri_m_per_km[i] >= 0) {
        metre += length;
        iri += length * way.iri_m_per_km[i];
        if (way.iri_std_m_per_km[i] >= 0) { errorMetre += length; error += length * way.iri_std_m_per_km[i]; }
        if (!(way.iri_m_per_km[i] <= way.iri_m_per_km[roughest])) roughest = i;
      }
      if (way.a_w_mps2[i] >= 0) {
        second += lasts;
        square += lasts * way.a_w_mps2[i] ** 2;
        if (!(way.a_w_mps2[i] <= way.a_w_mps2[hardest])) hardest = i;
      }
    }
    if (metre > 0) group.iri[g] = iri / metre;
    if (errorMetre > 0) group.iriError[g] = error / errorMetre;
    if (second > 0) group.comfort[g] = Math.sqrt(square / second);
    if (time > 0) group.speed[g] = distance / time;
    group.metre[g] = metre;
    group.second[g] = second;
    group.iriWorst[g] = roughest;
    group.comfortWorst[g] = hardest;
    group.trust[g] = trust;
  }
  return group;
}

class Windows {
  constructor(way, data) {
    Object.assign(this, way, {data, levels: []});
    project(this);
    const n = this.count;
    this.end_m = new Float64Array(n);
    this.trust = new Uint8Array(n);   // 0: no flag; 1: a flag beside a value; 2: no value, or none that counts
    this.drive = new Int32Array(n);
    this.placed = 0;
    this.since_s = new Float64Array(n);
    let end = 0, elapsed = 0, placedLength = 0, drive = -1;
    for (let i = 0; i < n; i++) {
      this.end_m[i] = end += this.length_m[i];
      this.since_s[i] = this.beyond_s[i] + elapsed;
      elapsed += this.duration_s[i];
      this.drive[i] = this.begins[i] === 2 ? ++drive : drive;
      this.trust[i] = !this.counts[i] || !(this.iri_m_per_km[i] >= 0) ? 2 : this.flagsOf(i).length > 0 ? 1 : 0;
      if (this.hasPlace(i)) { this.placed++; placedLength += this.length_m[i]; }
    }
    this.total_m = end;
    this.average_m = placedLength / this.placed || end / n || 10;
  }

  hasPlace(i) { return !Number.isNaN(this.x[i] + this.y[i]); }
  flagsOf(i) { return this.data.flags[this.flags[i]]; }
  middle(i) { return this.end_m[i] - this.length_m[i] / 2; }
  begin(i) { return this.end_m[i] - this.length_m[i]; }

  // Groups that are about so long at least, no finer than the windows are.
  level(least_m) {
    const k = clamp(Math.ceil(Math.log2(least_m / this.average_m)), 0, 24);
    return this.levels[k] ??= grouped(this, k);
  }

  // Number of a group's colour; -1 for grey: no value. A window alone has the class that its log gives it.
  rank(group, g, mode) {
    if (mode === "trust") return TRUST_RANKS[group.trust[g]];
    if (group.k > 0) return this.rankOf(group[mode][g], mode);
    const own = (mode === "iri" ? this.iri_rank : this.comfort_rank)[g];
    return own >= 0 ? own : -1;
  }

  // Of groups that are drawn as one: of their mean, weighted by length (IRI) and time (comfort); of the worst flag.
  rankOfSeveral(group, several, mode) {
    if (mode === "trust") return TRUST_RANKS[Math.max(...several.map(g => group.trust[g]))];
    const weights = mode === "iri" ? group.metre : group.second, power = mode === "iri" ? 1 : 2;
    let sum = 0, weight = 0;
    for (const g of several) {
      if (!(group[mode][g] >= 0)) continue;
      sum += weights[g] * group[mode][g] ** power;
      weight += weights[g];
    }
    return this.rankOf((sum / weight) ** (1 / power), mode);
  }

  rankOf(value, mode) {
    if (!(value >= 0)) return -1;
    let rank = 0;
    for (const limit of this.data.limits[mode]) if (value >= limit) rank++;
    return rank;
  }

  // The window at a distance along the way.
  atDistance(along_m) {
    let low = 0, high = this.count - 1;
    while (low < high) {
      const half = (low + high) >> 1;
      if (this.end_m[half] > along_m) high = half; else low = half + 1;
    }
    return low;
  }

  // The place of the road that several drives passed there, and which windows one of them has; -1: no other came by.
  placeOf(i) { return this.place?.[i] >= 0 ? this.place[i] : -1; }
  ofDrive(drive) { return [this.drive.indexOf(drive), this.drive.lastIndexOf(drive)]; }

  // The window nearest to a place of the projected world, and how far that is; -1 where none has a place.
  nearest(x, y, counts) {
    let best = Infinity, found = -1;
    for (let i = 0; i < this.count; i++) {
      const off = (this.x[i] - x) ** 2 + (this.y[i] - y) ** 2;
      if (off < best && counts(i)) { best = off; found = i; }
    }
    return [found, Math.sqrt(best)];
  }

  // A stretch of windows, both ends in it, in the figures of the whole drive's summary (logger/report/summary.py).
  summary(from, to) {
    let metre = 0, second = 0, moving = 0, iriMetre = 0, iri = 0, squareSecond = 0, square = 0, flagged = 0;
    let worst = -1;
    const shares = new Map();
    for (let i = from; i <= to; i++) {
      const length = this.length_m[i], lasts = this.duration_s[i];
      metre += length;
      second += lasts;
      if (length > 0) moving += lasts;
      flagged += this.trust[i] > 0;
      const rank = this.counts[i] && this.iri_rank[i] >= 0 ? this.iri_rank[i] : -1;
      shares.set(rank, (shares.get(rank) || 0) + length);
      if (!this.counts[i]) continue;
      if (this.iri_m_per_km[i] >= 0) {
        iriMetre += length;
        iri += length * this.iri_m_per_km[i];
        if (!(this.iri_m_per_km[i] <= this.iri_m_per_km[worst])) worst = i;
      }
      const expected = (this.a_w_mps2[i] || 0) + this.expected_above_mps2[i];
      if (expected >= 0) { squareSecond += lasts; square += lasts * expected ** 2; }
    }
    return {windows: to - from + 1, metre, second, speed_mps: metre / moving, iri: iri / iriMetre,
            a_w: Math.sqrt(square / squareSecond), worst, flagged,
            shares: [...shares].sort(([one], [other]) => (one < 0) - (other < 0) || one - other)};
  }
}
