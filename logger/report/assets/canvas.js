// What the map and the curves draw with. Colours are the style sheet's, for light, dark and paper.

const colours = {};

function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ink", "soft", "line", "faint", "ground", "panel", "casing", "none", "band",
                      ...Array.from({length: 8}, (_, number) => `c${number}`)])
    colours[name] = style.getPropertyValue(`--${name}`).trim();
}

const colourOf = rank => rank < 0 ? colours.none : colours[`c${rank}`];

// A clean canvas, in the screen's own pixels, as large as its place in the page.
function sheet(canvas) {
  const ratio = window.devicePixelRatio || 1, {clientWidth: width, clientHeight: height} = canvas;
  const wide = Math.round(width * ratio), high = Math.round(height * ratio);
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, {width: wide, height: high});
  const ink = canvas.getContext("2d");
  ink.setTransform(ratio, 0, 0, ratio, 0, 0);
  ink.clearRect(0, 0, width, height);
  ink.lineJoin = "round";
  return {ink, width, height};
}

// Text with a halo, so that it can be read on the way too.
function write(ink, text, x, y, {align = "left", colour = colours.soft, halo = colours.panel, weight = 400} = {}) {
  ink.font = `${weight} 12px system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif`;
  ink.textAlign = align;
  ink.lineWidth = 3.5;
  ink.strokeStyle = halo;
  ink.strokeText(text, x, y);
  ink.fillStyle = colour;
  ink.fillText(text, x, y);
}

const MARK_PX = 8.5, MARK_NUMBERS = 3;

// Numbered spots [{x, y, number}], the first the most important, as small discs. Those whose discs would touch share
// one at the first of them, which says the first few numbers and how many more.
function mark(ink, spots) {
  ink.font = '650 11px system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif';
  const sized = ({x, y, numbers}) => {
    const more = numbers.length - MARK_NUMBERS;
    const text = numbers.slice(0, MARK_NUMBERS).join(" ") + (more > 0 ? ` +${more}` : "");
    return {x, y, numbers, text, half: numbers.length > 1 ? ink.measureText(text).width / 2 - 3 : 0};
  };
  const touch = (a, b) => Math.abs(a.y - b.y) < 2 * MARK_PX && Math.abs(a.x - b.x) < a.half + b.half + 2 * MARK_PX;
  const groups = [];
  for (const {x, y, number} of spots) {
    let group = sized({x, y, numbers: [number]});
    for (let k; (k = groups.findIndex(one => touch(one, group))) >= 0;) {
      const [one] = groups.splice(k, 1), first = one.numbers[0] < group.numbers[0] ? one : group;
      group = sized({...first, numbers: [...one.numbers, ...group.numbers].sort((a, b) => a - b)});
    }
    groups.push(group);
  }
  groups.sort((a, b) => a.numbers[0] - b.numbers[0]);
  for (const {x, y, half, text} of groups.reverse()) {  // the first comes last, on top
    ink.beginPath();
    ink.arc(x - half, y, MARK_PX, Math.PI / 2, 1.5 * Math.PI);
    ink.arc(x + half, y, MARK_PX, 1.5 * Math.PI, Math.PI / 2);
    ink.closePath();
    ink.fillStyle = colours.ink;
    ink.fill();
    ink.strokeStyle = colours.ground;
    ink.lineWidth = 1.5;
    ink.stroke();
    ink.textAlign = "center";
    ink.fillStyle = colours.ground;
    ink.fillText(text, x, y + 4);
  }
  return groups.map(({text}) => text);
}

function circle(ink, x, y, radius, edge, inside, width) {
  ink.beginPath();
  ink.arc(x, y, radius, 0, 2 * Math.PI);
  if (inside) { ink.fillStyle = inside; ink.fill(); }
  ink.strokeStyle = edge;
  ink.lineWidth = width;
  ink.stroke();
}

// The smallest of 1, 2, 5, 10 ... times a power of ten that is not below.
function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].find(factor => factor * power >= least * (1 - 1e-9)) * power;
}

// Draw at the next frame, however often it is asked for before that.
function atNextFrame(draw) {
  let waiting = false;
  return () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  };
}
