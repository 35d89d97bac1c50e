// The skin under the mouse, a finger or the keys.

/** Room around the skin on the pad, as a share of its side: objects reach over the edge. */
export const MARGIN = 0.08;

const GROW_N_PER_S = 30;

/**
 * Follows the pointer on `canvas`. `state` has place (mm), force (N), pressing, keep, grow, mode, skin; `changed` is called
 * when the press changes, `chosen` with the taxel of a click in the mode "break".
 */
export function watch(canvas, state, changed, chosen) {
  const clamp = (v, most) => Math.min(Math.max(v, -most), most);
  const half = () => 0.5 * state.skin.pitch_mm * state.skin.cols;
  let held = null;
  let grows = null;

  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    const side = box.width * (1 - 2 * MARGIN);
    const share = [(event.clientX - box.left - MARGIN * box.width) / side, (event.clientY - box.top - MARGIN * box.height) / side];
    return [(share[0] - 0.5) * 2 * half(), (0.5 - share[1]) * 2 * half()];
  };
  const taxelAt = ([x, y]) => {
    const { rows, cols, pitch_mm: pitch } = state.skin;
    const [col, row] = [Math.floor(x / pitch + cols / 2), Math.floor(rows / 2 - y / pitch)];
    return col >= 0 && col < cols && row >= 0 && row < rows ? row * cols + col : null;
  };
  const move = ([x, y]) => { state.place = [clamp(x, half()), clamp(y, half())]; };
  const harder = (by) => {
    const [least, most] = state.forces;
    state.force = Math.min(Math.max(state.force + by, least), most);
  };
  const lift = () => {
    clearInterval(grows);
    held = null;
    if (!state.keep) state.pressing = false;
    changed();
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !state.skin) return;
    if (state.mode === "break") {
      const taxel = taxelAt(place(event));
      if (taxel !== null) chosen(taxel);
      return;
    }
    canvas.setPointerCapture(event.pointerId);
    held = event.pointerId;
    move(place(event));
    state.pressing = true;
    if (state.grow) {
      state.force = 0;
      clearInterval(grows);
      grows = setInterval(() => { harder(GROW_N_PER_S / 20); changed(); }, 50);
    }
    changed();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (held !== event.pointerId) return;
    move(place(event));
    changed();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => { if (held === event.pointerId) lift(); });
  }
  canvas.addEventListener("wheel", (event) => {
    if (!state.skin || state.mode === "break") return;
    event.preventDefault();
    harder(-Math.sign(event.deltaY) * (event.shiftKey ? 0.5 : 2));
    changed();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    // the browser's own keys, such as those that enlarge the page
    if (!state.skin || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? 1 : state.mode === "break" ? state.skin.pitch_mm : 5;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const arrow = arrows[event.key];
    if (arrow) {
      move([state.place[0] + step * arrow[0], state.place[1] + step * arrow[1]]);
    } else if (event.key === " " || event.key === "Enter") {
      const taxel = taxelAt(state.place);
      if (state.mode === "press") state.pressing = !state.pressing;
      else if (taxel !== null) chosen(taxel);
    } else if (event.key === "+" || event.key === "=") {
      harder(2);
    } else if (event.key === "-" || event.key === "−") {
      harder(-2);
    } else {
      return;
    }
    event.preventDefault();
    changed();
  });
}
