// The page: what was chosen goes to the server, what comes back is shown.

import { colours, crosses, fitted, outline, taxels, trace, underside } from "/draw.js";
import { MARGIN, watch } from "/pad.js";

const at = (id) => document.getElementById(id);
/** Images whose brightest taxel is below this are shown as dark as they are, V: that is noise. */
const FAINT_V = 0.2;
/** The pressure that fills the scale at least, kPa. */
const FAINT_KPA = 2;

const state = {
  skin: null, forces: [0, 200], place: [0, 0], force: 20, pressing: true, keep: true, grow: false, mode: "press",
  count: 20, panels: [], readout: null, noise: 1, faults: new Map(), object: null, degrees: 0, labels: new Map(),
};
let palette = colours();
let socket = null;
let picture = null;
let shape = null;
let frame = null;
let errorTimer = null;
let pressTimer = null;
let span = [0, 1];
const received = [];

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function showError(text) {
  at("error").textContent = text;
  at("error").hidden = false;
  clearTimeout(errorTimer);
  errorTimer = setTimeout(() => { at("error").hidden = true; }, 12000);
}

const round = (v, digits) => Number(v.toFixed(digits));

/** Sends the press, at most every 15 ms. */
function press() {
  at("force").value = state.force;
  at("force-set").textContent = `${state.force.toFixed(1)} N`;
  if (pressTimer !== null) return;
  pressTimer = setTimeout(() => {
    pressTimer = null;
    const [x, y] = state.place;
    send({ type: "press", x_mm: round(x, 2), y_mm: round(y, 2), force_n: state.pressing ? round(state.force, 2) : 0 });
    requestAnimationFrame(draw);
  }, 15);
}

const sendPanel = (k) => send({ type: "panel", panel: k, decoder: state.panels[k].decoder, rows: state.panels[k].rows });
const sendReadout = () => send({ type: "readout", profile: state.readout, noise: state.noise });

function fill(select, choices, chosen) {
  select.replaceChildren();
  const groups = new Map();
  for (const choice of choices) {
    const option = new Option(choice.label, choice.name, false, choice.name === chosen);
    option.title = choice.about;
    const grouped = choice.group && choice.group !== "noisy";
    if (grouped && !groups.has(choice.group)) {
      const group = document.createElement("optgroup");
      group.label = choice.group;
      groups.set(choice.group, group);
      select.append(group);
    }
    (grouped ? groups.get(choice.group) : select).append(option);
  }
}

/** What the server offers; after it was gone for a while, what was chosen goes to it again. */
function greet(hello) {
  const first = state.skin === null;
  state.skin = { rows: hello.rows, cols: hello.cols, pitch_mm: hello.pitch_mm };
  state.forces = hello.force_n;
  state.mostBytes = hello.most_mesh_bytes;
  state.readouts = hello.readouts;
  if (first) {
    [state.count, state.readout, state.noise] = [hello.usual.measurements, hello.usual.readout, hello.usual.noise];
    state.panels = hello.usual.panels;
  }
  fill(at("object"), hello.objects, state.object);
  fill(at("fault"), hello.faults, "dead");
  fill(at("readout"), hello.readouts, state.readout);
  [0, 1].forEach((k) => {
    fill(at(`decoder-${k}`), hello.decoders, state.panels[k].decoder);
    fill(at(`rows-${k}`), hello.row_choices, state.panels[k].rows);
  });
  for (const choice of [...hello.row_choices, ...hello.decoders]) state.labels.set(choice.name, choice);
  [at("count").min, at("count").max] = hello.measurements;
  [at("force").min, at("force").max] = hello.force_n;
  [at("noise").min, at("noise").max] = hello.noise_factor;
  [at("count").value, at("noise").value, at("force").value] = [state.count, state.noise, state.force];
  if (!first) {
    send({ type: "measurements", count: state.count });
    [0, 1].forEach(sendPanel);
    sendReadout();
    for (const [taxel, name] of state.faults) send({ type: "fault", taxel, name });
    if ([...at("object").options].some((option) => option.value === state.object && !option.dataset.mesh)) {
      send({ type: "object", name: state.object });
      send({ type: "turn", degrees: state.degrees });
    }
  }
  labels();
  press();
}

/** Texts beside the controls. */
function labels() {
  at("count-now").textContent = `${state.count}`;
  at("noise-now").textContent = `× ${state.noise.toFixed(1)}`;
  at("turn").value = state.degrees;
  at("turn-now").textContent = `${state.degrees}°`.replace("-", "−");
  const noisy = state.readouts?.find((choice) => choice.name === state.readout)?.group === "noisy";
  at("noise").disabled = !noisy;
  if (!noisy) at("noise-now").textContent = "none";
  at("mend").disabled = state.faults.size === 0;
  at("fault").disabled = state.mode !== "break";
  [0, 1].forEach((k) => {
    const about = (name) => state.labels.get(name)?.about ?? "";
    const panel = state.panels[k];
    if (panel) at(`about-${k}`).textContent = `Decoder: ${about(panel.decoder)}. Signs: ${about(panel.rows)}.`;
  });
}

function takeShape(message) {
  shape = message;
  picture = underside(shape, palette.shadow);
  state.object = message.name;
  state.degrees = message.degrees;
  const select = at("object");
  if (![...select.options].some((option) => option.value === message.name)) {
    const option = new Option(message.name, message.name);
    option.dataset.mesh = "yes";
    [...select.options].filter((other) => other.dataset.mesh).forEach((other) => other.remove());
    select.prepend(option);
  }
  select.value = message.name;
  at("side").disabled = !select.selectedOptions[0]?.dataset.mesh;
  labels();
}

function takeFrame(message) {
  frame = message;
  const now = performance.now();
  received.push(now);
  while (received.length > 2 && received[0] < now - 2000) received.shift();
  const rate = received.length > 2 ? (1e3 * (received.length - 1)) / (now - received[0]) : 0;
  document.body.dataset.rate = rate.toFixed(2);
  document.body.dataset.frame = message.number;
  at("status").textContent = `${rate.toFixed(0)} updates a second, each takes ${message.work_ms.toFixed(1)} ms`;
  at("force-now").textContent = `${message.force_n.toFixed(1)} N`;
  const top = Math.max(...message.pressure_kpa);
  at("pressure-now").textContent = top > 0 ? `largest pressure ${top.toFixed(1)} kPa` : "nothing touches the skin";
  if (at("note").textContent !== (message.note ?? "")) at("note").textContent = message.note ?? "";
  message.panels.forEach((panel, k) => {
    const percent = (share) => (share === null ? "–" : `${(100 * share).toFixed(0)} %`);
    at(`scores-${k}`).innerHTML = "";
    const parts = panel.waits_for
      ? [panel.waits_for]
      : [`overlap ${percent(panel.iou)}`, `support ${percent(panel.support)}`, `decoded in ${panel.decode_us.toFixed(0)} µs`];
    at(`scores-${k}`).append(...parts.map((text) => Object.assign(document.createElement("span"), { textContent: text })));
  });
  requestAnimationFrame(draw);
}

function drawPad() {
  const { context, width } = fitted(at("pad"));
  const { skin } = state;
  const [edge, size] = [MARGIN * width, width * (1 - 2 * MARGIN)];
  const perMm = size / (skin.cols * skin.pitch_mm);
  const most = Math.max(FAINT_KPA, ...frame.pressure_kpa);
  taxels(context, palette, skin, frame.pressure_kpa, most, edge, edge, size);
  const [x, y] = [edge + size / 2 + perMm * state.place[0], edge + size / 2 - perMm * state.place[1]];
  if (picture && (state.pressing || state.mode === "press")) {
    context.save();
    context.translate(x, y);
    context.rotate((-state.degrees * Math.PI) / 180);
    context.scale(perMm / picture.scale, perMm / picture.scale);
    context.globalAlpha = state.pressing ? 0.55 : 0.25;
    context.drawImage(picture.canvas, -picture.middle, -picture.middle);
    context.restore();
  }
  if (state.mode === "break" && document.activeElement === at("pad")) {
    context.strokeStyle = palette.ink;
    context.lineWidth = 2;
    context.strokeRect(x - 6, y - 6, 12, 12);
  }
  outline(context, palette, skin, new Set(frame.touched), edge, edge, size);
  crosses(context, palette, skin, state.faults.keys(), edge, edge, size);
}

function drawImage(k) {
  const { context, width } = fitted(at(`image-${k}`));
  const { image } = frame.panels[k];
  taxels(context, palette, state.skin, image, Math.max(FAINT_V, ...image), 1, 1, width - 2);
  outline(context, palette, state.skin, new Set(frame.touched), 1, 1, width - 2);
  crosses(context, palette, state.skin, state.faults.keys(), 1, 1, width - 2);
}

/** Limits of the voltage axis: wide at once, narrow slowly. */
function follow(lines) {
  const all = lines.flatMap((line) => line.volts);
  if (all.length === 0) return;
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const room = Math.max(0.1, 0.08 * (high - low));
  const wanted = [low - room, high + room];
  const slow = 0.03;
  span = [
    wanted[0] < span[0] ? wanted[0] : span[0] + slow * (wanted[0] - span[0]),
    wanted[1] > span[1] ? wanted[1] : span[1] + slow * (wanted[1] - span[1]),
  ];
}

let drawn = null;
function draw() {
  if (!frame || !state.skin) return;
  drawPad();
  if (drawn === frame.number) return;
  drawn = frame.number;
  [0, 1].forEach(drawImage);
  follow(frame.lines);
  const names = frame.lines.map((line) => {
    const shown = [0, 1].filter((k) => state.panels[k].rows === line.rows).map((k) => "AB"[k]).join(" and ");
    return `${shown}: ${state.labels.get(line.rows)?.label ?? line.rows}`;
  });
  trace(at("trace"), palette, frame.lines, names, state.count, span);
}

async function drop(file) {
  if (!file) return;
  if (file.size > state.mostBytes) {
    showError(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB; at most ${(state.mostBytes / 1e6).toFixed(0)} MB are read`);
    return;
  }
  at("mesh-notes").replaceChildren(Object.assign(document.createElement("li"), { textContent: `Reading ${file.name} …` }));
  let bytes;
  try {
    bytes = await file.arrayBuffer();
  } catch (error) {
    at("mesh-notes").replaceChildren();
    showError(`${file.name} cannot be read: ${error.message}`);
    return;
  }
  send({ type: "mesh", name: file.name, unit: at("unit").value });
  if (socket?.readyState === WebSocket.OPEN) socket.send(bytes);
}

function takeMesh(message) {
  at("side").value = "bottom";
  at("mesh-notes").replaceChildren(
    ...message.notes.map((note) => Object.assign(document.createElement("li"), { textContent: note })));
}

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    const takers = {
      hello: greet, shape: takeShape, frame: takeFrame, mesh: takeMesh,
      error: (refused) => { showError(refused.text); at("mesh-notes").querySelectorAll("li").forEach((li) => {
        if (li.textContent.startsWith("Reading")) li.remove();
      }); },
    };
    takers[message.type]?.(message);
  };
  socket.onclose = () => {
    at("status").textContent = "Not connected. Is `spts live` running, in this window's address, and with fewer than 8 pages?";
    delete document.body.dataset.rate;
    setTimeout(connect, 2000);
  };
}

function listen() {
  watch(at("pad"), state, press, (taxel) => {
    const mends = state.faults.get(taxel) === at("fault").value;
    if (mends) state.faults.delete(taxel);
    else state.faults.set(taxel, at("fault").value);
    send({ type: "fault", taxel, name: mends ? null : at("fault").value });
    labels();
  });
  const on = (id, kind, does) => at(id).addEventListener(kind, () => { does(at(id)); labels(); });
  on("force", "input", (input) => { state.force = Number(input.value); press(); });
  on("turn", "input", (input) => { state.degrees = Number(input.value); send({ type: "turn", degrees: state.degrees }); });
  on("count", "input", (input) => { state.count = Number(input.value); send({ type: "measurements", count: state.count }); });
  on("noise", "input", (input) => { state.noise = Number(input.value); sendReadout(); });
  on("readout", "change", (select) => { state.readout = select.value; sendReadout(); });
  on("object", "change", (select) => {
    if (select.selectedOptions[0].dataset.mesh) send({ type: "side", side: at("side").value });
    else send({ type: "object", name: select.value });
  });
  on("side", "change", (select) => send({ type: "side", side: select.value }));
  on("keep", "change", (input) => { state.keep = input.checked; if (!state.keep) state.pressing = false; press(); });
  on("grow", "change", (input) => { state.grow = input.checked; });
  on("mend", "click", () => { state.faults.clear(); send({ type: "mend_all" }); });
  [0, 1].forEach((k) => {
    on(`decoder-${k}`, "change", (select) => { state.panels[k].decoder = select.value; sendPanel(k); });
    on(`rows-${k}`, "change", (select) => { state.panels[k].rows = select.value; sendPanel(k); });
  });
  document.querySelectorAll("input[name=mode]").forEach((input) => input.addEventListener("change", () => {
    state.mode = input.value;
    labels();
    requestAnimationFrame(draw);
  }));
  at("file").addEventListener("change", () => { drop(at("file").files[0]); at("file").value = ""; });
  const carriesFile = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  addEventListener("dragover", (event) => {
    if (!carriesFile(event)) return;
    event.preventDefault();
    at("drop").hidden = false;
  });
  addEventListener("dragleave", (event) => { if (event.relatedTarget === null) at("drop").hidden = true; });
  addEventListener("drop", (event) => {
    event.preventDefault();
    at("drop").hidden = true;
    drop(event.dataTransfer?.files[0]);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    palette = colours();
    if (shape) picture = underside(shape, palette.shadow);
    drawn = null;
    requestAnimationFrame(draw);
  });
  addEventListener("resize", () => { drawn = null; requestAnimationFrame(draw); });
}

listen();
connect();
