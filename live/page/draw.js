// Drawing: taxel images, the object's underside, the trace of the wire.

const styles = () => getComputedStyle(document.documentElement);

/** Colours of the page as it is now, light or dark. */
export function colours() {
  const style = styles();
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["card", "ink", "soft", "line", "grid", "mark", "shade", "shadow", "line-a", "line-b"];
  const found = Object.fromEntries(names.map((name) => [name, of(name)]));
  found.ramp = [0, 1, 2, 3, 4].map((k) => of(`ramp-${k}`)).map((hex) =>
    [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  return found;
}

/** Colour of a share in [0, 1]. */
function ramp(stops, share) {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  const mixed = stops[k].map((v, i) => Math.round(v + (at - k) * (stops[k + 1][i] - v)));
  return `rgb(${mixed.join(" ")})`;
}

/** The canvas with as many pixels as the screen has, its context in CSS pixels. */
export function fitted(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** Taxels of `values` over `most`, in the square at (x, y) with side `size`. */
export function taxels(context, palette, skin, values, most, x, y, size) {
  const side = size / skin.cols;
  for (let row = 0; row < skin.rows; row++) {
    for (let col = 0; col < skin.cols; col++) {
      const value = values[row * skin.cols + col] ?? 0;
      context.fillStyle = ramp(palette.ramp, most > 0 ? value / most : 0);
      context.fillRect(x + col * side + 0.5, y + row * side + 0.5, side - 1, side - 1);
    }
  }
}

/** A line around the taxels in `inside`. */
export function outline(context, palette, skin, inside, x, y, size) {
  const side = size / skin.cols;
  const has = (row, col) => row >= 0 && row < skin.rows && col >= 0 && col < skin.cols && inside.has(row * skin.cols + col);
  context.beginPath();
  for (let row = 0; row < skin.rows; row++) {
    for (let col = 0; col < skin.cols; col++) {
      if (!has(row, col)) continue;
      const [l, t] = [x + col * side, y + row * side];
      if (!has(row - 1, col)) { context.moveTo(l, t); context.lineTo(l + side, t); }
      if (!has(row + 1, col)) { context.moveTo(l, t + side); context.lineTo(l + side, t + side); }
      if (!has(row, col - 1)) { context.moveTo(l, t); context.lineTo(l, t + side); }
      if (!has(row, col + 1)) { context.moveTo(l + side, t); context.lineTo(l + side, t + side); }
    }
  }
  context.strokeStyle = palette.mark;
  context.lineWidth = 2;
  context.lineCap = "square";
  context.stroke();
}

/** A cross on every taxel in `broken`. */
export function crosses(context, palette, skin, broken, x, y, size) {
  const side = size / skin.cols;
  context.strokeStyle = palette.mark;
  context.lineWidth = Math.max(1.5, side / 14);
  context.beginPath();
  for (const taxel of broken) {
    const [l, t] = [x + (taxel % skin.cols) * side, y + Math.floor(taxel / skin.cols) * side];
    const [near, far] = [0.25 * side, 0.75 * side];
    context.moveTo(l + near, t + near); context.lineTo(l + far, t + far);
    context.moveTo(l + far, t + near); context.lineTo(l + near, t + far);
  }
  context.stroke();
}

/** The underside of an object as a picture: {canvas, scale: pixels a mm, middle: pixels}. Near parts are darker. */
export function underside(shape, colour) {
  let reach = 1;
  for (const corners of shape.corners_mm) for (const v of corners) reach = Math.max(reach, Math.abs(v));
  const scale = Math.min(4, 512 / reach);
  const middle = Math.ceil(reach * scale) + 2;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 2 * middle;
  const context = canvas.getContext("2d");
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 0.6;
  shape.corners_mm.forEach((c, k) => {
    context.beginPath();
    context.moveTo(middle + scale * c[0], middle - scale * c[1]);
    context.lineTo(middle + scale * c[2], middle - scale * c[3]);
    context.lineTo(middle + scale * c[4], middle - scale * c[5]);
    context.closePath();
    // what lies lower covers what lies higher, and does not add to it
    context.globalCompositeOperation = "destination-out";
    context.globalAlpha = 1;
    context.fill();
    context.globalCompositeOperation = "source-over";
    context.globalAlpha = 0.12 + 0.5 * Math.exp(-shape.heights_mm[k] / 4);
    context.fill();
    context.stroke();
  });
  return { canvas, scale, middle };
}

/** Steps of an axis: round numbers, about `count` of them within [low, high]. */
function ticks(low, high, count) {
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw);
  const found = [];
  for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(v);
  return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** The wire over time: `lines` with volts and sample_rate_hz; the first `count` measurements are shaded. */
export function trace(canvas, palette, lines, labels, count, span) {
  const { context, width, height } = fitted(canvas);
  if (lines.length === 0) return;
  const [left, right, top, bottom] = [52, 12, lines.length > 1 ? 44 : 26, 40];
  const duration = (1e3 * (lines[0].volts.length - 1)) / lines[0].sample_rate_hz;
  const [low, high] = span;
  const px = (ms) => left + (ms / duration) * (width - left - right);
  const py = (v) => top + ((high - v) / (high - low)) * (height - top - bottom);
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = palette.shade;
  const shaded = Math.min(duration, (1e3 * (count - 0.5)) / lines[0].sample_rate_hz);
  context.fillRect(left, top, px(shaded) - left, height - top - bottom);
  context.lineWidth = 1;
  context.fillStyle = palette.soft;
  context.textAlign = "right";
  context.textBaseline = "middle";
  const vertical = ticks(low, high, 6);
  for (const v of vertical.found) {
    context.strokeStyle = palette.grid;
    context.beginPath(); context.moveTo(left, py(v)); context.lineTo(width - right, py(v)); context.stroke();
    context.fillText(v.toFixed(vertical.digits).replace("-", "−"), left - 6, py(v));
  }
  context.textAlign = "center";
  context.textBaseline = "top";
  const across = ticks(0, duration, width < 500 ? 4 : 8);
  for (const ms of across.found) context.fillText(ms.toFixed(across.digits), px(ms), height - bottom + 5);
  context.fillText("time, ms", 0.5 * (left + width - right), height - 16);
  context.textAlign = "left";
  context.fillText("voltage, V", 4, 4);
  lines.forEach((line, k) => {
    context.strokeStyle = context.fillStyle = k === 0 ? palette["line-a"] : palette["line-b"];
    context.lineWidth = 1.3;
    context.setLineDash(k === 0 ? [] : [5, 3]);
    context.beginPath();
    line.volts.forEach((v, i) => context.lineTo(px((1e3 * i) / line.sample_rate_hz), py(v)));
    context.stroke();
    context.setLineDash([]);
    line.volts.forEach((v, i) => {
      context.beginPath();
      context.arc(px((1e3 * i) / line.sample_rate_hz), py(v), i < count ? 2.6 : 1.4, 0, 2 * Math.PI);
      context.fill();
    });
    context.textAlign = "right";
    context.fillText(labels[k], width - right, 4 + 16 * k);
  });
}
