"use strict";
(() => {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const options = {
    responsive: true,
    displaylogo: false,
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
  };
  /* Paper is narrower than the screen and always light. */
  const paper = { width: 690, shrink: 0.8, shortest: 320, tallest: 770 };
  /* Points drawn of one curve: more than a screen has columns. */
  const mostPoints = 4000;
  const plots = [];

  const element = (id) => document.getElementById(id);
  const embedded = (id) => JSON.parse(element(id).textContent);

  /* Texts and arrays stand in the page as base64 of gzip. */
  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(element(id).textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  }

  async function loadLibrary() {
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await unpacked("plotly"));
    document.head.append(script);
  }

  /* All samples of the time figures; html.py says how they are written. */
  async function loadSamples() {
    const bytes = await unpacked("samples");
    let place = 0;
    return embedded("samples-index").map(({ count, width, start, step }) => {
      if (!width) return Float64Array.from({ length: count }, (_, i) => start + step * i);
      const part = bytes.slice(place, (place += width * count));
      if (width === 8) return new Float64Array(part);
      let code = 0;
      return Float64Array.from(new Uint16Array(part), (change) => {
        code = (code + change) & 65535;
        return code === 65535 ? NaN : start + step * code;
      });
    });
  }

  /* First index whose time is not before `at`. */
  function lower(time, at) {
    let [low, high] = [0, time.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle] < at) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  function extremes(values, first, last) {
    let [low, high] = [-1, -1];
    for (let i = first; i < last; i++) {
      if (Number.isNaN(values[i])) continue;
      if (low < 0 || values[i] < values[low]) low = i;
      if (high < 0 || values[i] > values[high]) high = i;
    }
    return [low, high];
  }

  /* All samples of a span, or of equal bins the smallest and the largest. */
  function drawn({ time, values }, from, to) {
    const first = Math.max(0, lower(time, from) - 1);
    const last = Math.min(time.length, lower(time, to) + 1);
    if (last - first <= mostPoints) {
      return [time.slice(first, last), values.slice(first, last)];
    }
    const x = [];
    const y = [];
    const bins = mostPoints / 2;
    for (let bin = 0; bin < bins; bin++) {
      const start = first + Math.floor(((last - first) * bin) / bins);
      const end = first + Math.floor(((last - first) * (bin + 1)) / bins);
      const [low, high] = extremes(values, start, end);
      const kept = low < 0 ? [start] : [Math.min(low, high), Math.max(low, high)];
      kept.forEach((i) => {
        x.push(time[i]);
        y.push(values[i]);
      });
    }
    return [x, y];
  }

  /* Ranges of the y axes that show what is in view, by the rule of figures/stack.py. */
  function fitted(plot, [from, to]) {
    const seen = {};
    plot.curves.forEach((curve, k) => {
      const axis = (plot.data[k].yaxis || "y").replace("y", "yaxis");
      const first = lower(curve.time, from);
      const [low, high] = extremes(curve.values, first, lower(curve.time, to));
      if (low < 0) return;
      const both = seen[axis] || [Infinity, -Infinity];
      seen[axis] = [Math.min(both[0], curve.values[low]), Math.max(both[1], curve.values[high])];
    });
    const change = {};
    Object.entries(seen).forEach(([axis, [low, high]]) => {
      const least = 0.04 * Math.max(Math.abs(low), Math.abs(high));
      const half = 0.56 * Math.max(high - low, least, 1e-12);
      change[`${axis}.range`] = [(low + high) / 2 - half, (low + high) / 2 + half];
    });
    return change;
  }

  /* Show a span of time: curves in the detail it takes, with room beside it for panning. */
  function show(plot, span, layout) {
    const room = (span[1] - span[0]) / 2;
    const parts = plot.curves.map((curve) => drawn(curve, span[0] - room, span[1] + room));
    const data = { x: parts.map(([x]) => x), y: parts.map(([, y]) => y) };
    const traces = plot.curves.map((_, k) => k);
    return Plotly.update(plot, data, { "xaxis.range": span, ...layout }, traces);
  }

  function showTogether(plot, span, own) {
    linked(plot).forEach((other) => show(other, span, other === plot && own ? own : fitted(other, span)));
  }

  function linked(plot) {
    return plots.filter((other) => other === plot || (other.curves && other.link && other.link === plot.link));
  }

  function wholeOf(plot) {
    const filled = plot.curves.filter(({ time }) => time.length);
    const from = Math.min(...filled.map(({ time }) => time[0]));
    return [from, Math.max(...filled.map(({ time }) => time[time.length - 1]))];
  }

  /* A zoom by mouse changes the time axis, the y axes, or both: those left alone are fitted. */
  function zoomed(plot, change) {
    const span = change["xaxis.range"] || [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    const asked = change["xaxis.autorange"] ? wholeOf(plot) : span;
    if (asked[0] === undefined) return;
    const own = Object.keys(change).some((key) => /^yaxis\d*\.range/.test(key)) ? {} : null;
    showTogether(plot, asked.map(Number), own);
  }

  function addButtons(plot, zooms) {
    const group = document.createElement("div");
    group.className = "zooms";
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", "Zoom");
    zooms.forEach(({ label, change }) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = label;
      button.addEventListener("click", () => showTogether(plot, change["xaxis.range"], null));
      group.append(button);
    });
    plot.before(group);
  }

  /* Arrow keys pan, plus and minus zoom. */
  function addKeys(plot) {
    plot.tabIndex = 0;
    plot.setAttribute("role", "group");
    plot.setAttribute("aria-label", "Plot over time: arrow keys pan, plus and minus zoom");
    plot.addEventListener("keydown", (event) => {
      const [from, to] = plot.layout.xaxis.range;
      const width = to - from;
      const spans = {
        ArrowLeft: [from - width / 5, to - width / 5],
        ArrowRight: [from + width / 5, to + width / 5],
        "+": [from + width / 4, to - width / 4],
        "-": [from - width / 2, to + width / 2],
      };
      const span = spans[event.key];
      if (!span || event.target !== plot) return;
      event.preventDefault();
      showTogether(plot, span, null);
    });
  }

  /* The moment under the mouse in one plot is marked in all others over time. */
  function addCursor(plot) {
    const line = document.createElement("div");
    line.className = "cursor";
    line.hidden = true;
    plot.append(line);
    plot.cursor = line;
    plot.on("plotly_hover", (event) => plots.forEach((other) => mark(other, plot, event.xvals[0])));
    plot.on("plotly_unhover", () => plots.forEach((other) => other.cursor && (other.cursor.hidden = true)));
  }

  function mark(other, source, time) {
    if (!other.cursor || other === source) return;
    const { xaxis, height, margin } = other._fullLayout;
    const place = xaxis.l2p(time);
    other.cursor.hidden = !(place >= 0 && place <= xaxis._length);
    other.cursor.style.left = `${xaxis._offset + place}px`;
    other.cursor.style.top = `${margin.t}px`;
    other.cursor.style.height = `${height - margin.t - margin.b}px`;
    other.cursor.dataset.time = `${time.toFixed(3)} s`;
  }

  /* Colours of text and grid; traces keep theirs, which read on both grounds. */
  function theme(isDark) {
    const ink = isDark ? "#dfe3e9" : "#2a313b";
    return {
      "font.color": ink,
      "hoverlabel.bgcolor": isDark ? "#232a34" : "#ffffff",
      "hoverlabel.font.color": ink,
    };
  }

  function paint(isDark) {
    plots.forEach((plot) => Plotly.relayout(plot, theme(isDark)));
  }

  async function draw(plot, samples) {
    const source = plot.querySelector("script");
    const figure = JSON.parse(source.textContent);
    source.remove();
    if (figure.curves.length) {
      plot.link = figure.link;
      plot.curves = figure.curves.map(([time, values]) => ({ time: samples[time], values: samples[values] }));
      const [from, to] = figure.layout.xaxis.range;
      const room = (to - from) / 2;
      plot.curves.forEach((curve, k) => {
        [figure.data[k].x, figure.data[k].y] = drawn(curve, from - room, to + room);
      });
    }
    plots.push(plot);
    plot.ownHeight = figure.layout.height;
    await Plotly.newPlot(plot, figure.data, figure.layout, options);
    if (!plot.curves) return;
    plot.on("plotly_relayout", (change) => zoomed(plot, change));
    addCursor(plot);
    addKeys(plot);
    if (figure.zooms.length) addButtons(plot, figure.zooms);
  }

  function prepareForPaper() {
    window.addEventListener("beforeprint", () => {
      paint(false);
      plots.forEach((plot) => {
        const shrunk = Math.min(plot.ownHeight * paper.shrink, paper.tallest);
        const height = Math.max(shrunk, Math.min(plot.ownHeight, paper.shortest));
        Plotly.relayout(plot, { width: paper.width, height });
      });
    });
    window.addEventListener("afterprint", () => {
      paint(dark.matches);
      plots.forEach((plot) => Plotly.relayout(plot, { width: null, height: plot.ownHeight, autosize: true }));
    });
  }

  /* The section in view is marked in the navigation. */
  function markSections() {
    const links = new Map();
    document.querySelectorAll("nav a").forEach((link) => links.set(element(link.hash.slice(1)), link));
    const mark = () => {
      const passed = [...links.keys()].filter((part) => part.getBoundingClientRect().top < window.innerHeight / 3);
      links.forEach((link, part) => {
        if (part === passed[passed.length - 1]) link.setAttribute("aria-current", "true");
        else link.removeAttribute("aria-current");
      });
    };
    document.addEventListener("scroll", mark, { passive: true });
    mark();
  }

  async function start() {
    markSections();
    const [samples] = await Promise.all([loadSamples(), loadLibrary()]);
    for (const plot of document.querySelectorAll(".plot")) await draw(plot, samples);
    paint(dark.matches);
    dark.addEventListener("change", (event) => paint(event.matches));
    prepareForPaper();
    document.body.dataset.drawn = "all";
  }

  start().catch((fault) => {
    element("too-old").hidden = false;
    throw fault;
  });
})();
