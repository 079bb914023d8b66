/* SPDX-License-Identifier: MIT */
/* Two cursors of a figure: times by click, Shift+click or number field, the values of all curves at
   both, and their differences. The lines lie over the figure, which itself does not change. */
"use strict";
(() => {
  const NAMES = ["A", "B"];

  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    Object.entries(attributes).forEach(([name, value]) => element.setAttribute(name, value));
    element.append(...children);
    return element;
  };
  const format = (value) => (Number.isFinite(value) ? Number(value.toPrecision(6)).toString() : "–");

  /* Value of a curve at a time: between samples on the line, of a staircase the sample before. */
  function valueAt(curve, time) {
    const x = curve.x, y = curve.y;
    if (!x?.length || time < x[0] || time > x[x.length - 1]) return NaN;
    let low = 0, high = x.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (x[middle] <= time) low = middle; else high = middle;
    }
    if (time >= x[high]) return y[high];
    if (curve.line?.shape === "hv" || x[high] === x[low]) return y[low];
    return y[low] + ((y[high] - y[low]) * (time - x[low])) / (x[high] - x[low]);
  }

  function axisOf(plot, curve) {
    const title = plot._fullLayout[curve.yaxis.replace("y", "yaxis")]?.title?.text ?? "";
    const [, quantity = "", unit = ""] = title.match(/^(.*?)(?:<br>)? ?\[(.*)\]$/) ?? [];
    return { quantity: quantity.replaceAll("<br>", " "), unit };
  }

  function build(box) {
    const fields = NAMES.map((name) => {
      const input = make("input", { type: "number", step: "any", class: "time" });
      const label = make("label", { class: "field" },
        make("span", { class: "label" }, `Cursor ${name} [s]`), input);
      return { input, label };
    });
    const clear = make("button", { type: "button" }, "Clear cursors");
    const image = make("button", { type: "button" }, "Save as PNG");
    const table = make("div", { class: "table", "aria-live": "polite" });
    const hint = make("p", { class: "hint" },
      "A click in the figure sets cursor A, Shift and click sets cursor B.");
    box.append(make("div", { class: "row" }, ...fields.map((one) => one.label), clear, image),
      hint, table);
    return { box, inputs: fields.map((one) => one.input), clear, image, table, lines: [] };
  }

  const timesOf = (state) =>
    state.inputs.map((input) => (input.value === "" ? NaN : Number(input.value)));

  function drawLines(state, plot) {
    state.lines.forEach((line) => line.remove());
    const { xaxis, _size: size } = plot._fullLayout;
    state.lines = timesOf(state).flatMap((time, k) => {
      const place = xaxis.l2p(time);
      if (!Number.isFinite(place) || place < 0 || place > xaxis._length) return [];
      const line = make("div", { class: `cursor cursor-${NAMES[k]}` }, NAMES[k]);
      line.style.left = `${size.l + place}px`;
      line.style.top = `${size.t}px`;
      line.style.height = `${size.h}px`;
      plot.append(line);
      return [line];
    });
  }

  function drawTable(state, plot) {
    const times = timesOf(state);
    state.table.replaceChildren();
    if (!times.some(Number.isFinite)) return;
    const step = times[1] - times[0];
    const head = ["signal", "unit", "at A", "at B", "Δy"];
    const rows = plot._fullData
      .filter((curve) => curve.visible === true && curve.x?.length)
      .map((curve) => {
        const { quantity, unit } = axisOf(plot, curve);
        const [a, b] = times.map((time) => valueAt(curve, time));
        const name = curve.name && curve.name !== quantity ? `${quantity}: ${curve.name}` : quantity;
        return [name, unit, format(a), format(b), format(b - a)];
      });
    const caption = Number.isFinite(step)
      ? `Δt = ${format(step)} s, 1/Δt = ${format(1 / Math.abs(step))} Hz` : "Values at one cursor";
    state.table.append(make("table", {}, make("caption", {}, caption),
      make("thead", {}, make("tr", {}, ...head.map((text) => make("th", { scope: "col" }, text)))),
      make("tbody", {}, ...rows.map(([name, unit, ...values]) =>
        make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, unit),
          ...values.map((text) => make("td", { class: "number" }, text)))))));
  }

  function attach(state, plot) {
    const draw = () => { drawLines(state, plot); drawTable(state, plot); };
    state.inputs.forEach((input) => { input.oninput = draw; });
    state.clear.onclick = () => {
      state.inputs.forEach((input) => { input.value = ""; });
      draw();
    };
    state.image.onclick = () => Plotly.downloadImage(plot, {
      format: "png", filename: state.box.dataset.plot, scale: 2,
      width: plot._fullLayout.width, height: plot._fullLayout.height,
    });
    plot.on("plotly_click", ({ event, points }) => {
      state.inputs[event.shiftKey ? 1 : 0].value = Number(points[0].x.toPrecision(9));
      draw();
    });
    plot.on("plotly_afterplot", draw);
    plot.dataset.cursors = "yes";
    draw();
  }

  const states = new WeakMap();
  let waiting = false;
  const look = () => {
    waiting = false;
    document.querySelectorAll(".cursors").forEach((box) => {
      if (!states.has(box)) states.set(box, build(box));
      const plot = document.querySelector(`#${box.dataset.plot} .js-plotly-plot`);
      if (plot?.on && plot._fullLayout?.xaxis && !plot.dataset.cursors) {
        attach(states.get(box), plot);
      }
    });
  };
  new MutationObserver(() => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(look);
  }).observe(document.documentElement, { childList: true, subtree: true });
})();
