// The flip viewer. Truths are whole pictures; what a method showed is kept as the difference from
// the truth plus 128, modulo 256, which is exact and takes far less room. In a rung map the red
// channel of a pixel is the number of its model.
"use strict";
(() => {
  const { captures, heat, gain, rungs } = JSON.parse(document.getElementById("flips").textContent);
  const views = ["truth", "predicted", "error", "rung map"];
  // How much of a model's colour covers the picture below it, of 256.
  const opacity = 176;
  const at = { capture: 0, method: 0, frame: 0, view: 1 };
  const part = (name) => document.querySelector(`.flip [name=${name}]`);
  const canvas = document.querySelector(".flip canvas");
  const decoded = new Map();
  let turn = 0;

  async function pixels(url) {
    if (!decoded.has(url)) {
      const image = new Image();
      image.src = url;
      await image.decode();
      const scratch = document.createElement("canvas");
      [scratch.width, scratch.height] = [image.width, image.height];
      const context = scratch.getContext("2d", { willReadFrequently: true });
      context.drawImage(image, 0, 0);
      decoded.set(url, context.getImageData(0, 0, image.width, image.height));
    }
    return decoded.get(url);
  }

  function mix(truth, delta, view) {
    const out = new ImageData(truth.width, truth.height);
    for (let i = 0; i < out.data.length; i += 4) {
      let worst = 0;
      for (let c = 0; c < 3; c++) {
        const t = truth.data[i + c];
        const shown = (t + delta.data[i + c] + 128) & 255;
        worst = Math.max(worst, Math.abs(shown - t));
        out.data[i + c] = view === "truth" ? t : shown;
      }
      if (view === "error") out.data.set(heat[Math.min(255, worst * gain)], i);
      out.data[i + 3] = 255;
    }
    return out;
  }

  function mapped(truth, map) {
    const out = new ImageData(truth.width, truth.height);
    for (let i = 0; i < out.data.length; i += 4) {
      const grey = (truth.data[i] + 2 * truth.data[i + 1] + truth.data[i + 2]) >> 2;
      const color = rungs[map.data[i]].color;
      for (let c = 0; c < 3; c++) {
        out.data[i + c] = color ? (opacity * color[c] + (256 - opacity) * grey) >> 8 : grey;
      }
      out.data[i + 3] = 255;
    }
    return out;
  }

  // Names the models of a map and how much of the picture goes by each.
  function legend(map) {
    const bar = document.querySelector(".flip .legend");
    bar.hidden = !map;
    if (!map) return;
    const counts = rungs.map(() => 0);
    for (let i = 0; i < map.data.length; i += 4) counts[map.data[i]]++;
    const entries = rungs.flatMap(({ name, color }, model) => {
      if (counts[model] === 0) return [];
      const entry = document.createElement("span");
      const patch = document.createElement("i");
      if (color) patch.style.background = `rgb(${color})`;
      const percent = ((400 * counts[model]) / map.data.length).toFixed(1);
      entry.append(patch, `${name} ${percent} %`);
      return [entry];
    });
    bar.replaceChildren(...entries);
  }

  async function show() {
    const mine = ++turn;
    const capture = captures[at.capture];
    const frame = capture.frames[at.frame];
    const view = views[at.view];
    const other = view === "rung map" ? frame.rungs : frame.shown;
    const [truth, delta] = [await pixels(frame.truth), await pixels(other[at.method])];
    // Another one was asked for while these were decoded.
    if (mine !== turn) return;
    [canvas.width, canvas.height] = [truth.width, truth.height];
    const picture = view === "rung map" ? mapped(truth, delta) : mix(truth, delta, view);
    canvas.getContext("2d").putImageData(picture, 0, 0);
    legend(view === "rung map" ? delta : null);
    part("capture").value = at.capture;
    part("method").value = at.method;
    part("view").value = at.view;
    part("frame").max = capture.frames.length - 1;
    part("frame").value = at.frame;
    const shown = view === "truth" ? "truth" : `${capture.methods[at.method]}, ${view}`;
    part("shown").value = `${capture.name}, frame ${frame.frame}: ${shown}`;
    canvas.dataset.shown = part("shown").value;
  }

  function options(name, labels) {
    part(name).replaceChildren(...labels.map((label, index) => new Option(label, index)));
  }

  function step(name, by, count) {
    at[name] = (at[name] + by + count) % count;
    if (name === "capture") at.frame = 0;
    show();
  }

  const keys = {
    ArrowLeft: () => step("frame", -1, captures[at.capture].frames.length),
    ArrowRight: () => step("frame", 1, captures[at.capture].frames.length),
    ArrowUp: () => step("method", -1, captures[0].methods.length),
    ArrowDown: () => step("method", 1, captures[0].methods.length),
    c: () => step("capture", 1, captures.length),
    " ": () => { at.view = at.view === 0 ? 1 : 0; show(); },
    e: () => { at.view = at.view === 2 ? 1 : 2; show(); },
    r: () => { at.view = at.view === 3 ? 1 : 3; show(); },
  };
  document.addEventListener("keydown", (event) => {
    const isField = event.target.matches?.("select, input");
    if (keys[event.key] && !isField && !event.ctrlKey && !event.metaKey && !event.altKey) {
      event.preventDefault();
      keys[event.key]();
    }
  });
  for (const name of ["capture", "method", "view", "frame"]) {
    part(name).addEventListener("input", (event) => {
      at[name] = Number(event.target.value);
      if (name === "capture") at.frame = 0;
      show();
    });
  }
  options("capture", captures.map((capture) => capture.name));
  options("method", captures[0].methods);
  options("view", views);
  show();
})();
