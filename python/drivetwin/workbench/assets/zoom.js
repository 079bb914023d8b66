/* SPDX-License-Identifier: MIT */
/* The time window that was zoomed to last is carried to the figures over time of the other views,
   as long as the same log and shift are shown. The server then sends all samples in view. */
"use strict";
(() => {
  const SHARE = 0.5, WHOLE = 0.95, TOLERANCE = 1e-6;
  const CHOICES = "#phases-shift, #model-shift, #channels-log, #shifts-log, #model-log";
  let zoomed = null;

  const logName = () => document.querySelector("#status b")?.textContent ?? "";
  const plots = () => [...document.querySelectorAll(".cursors")]
    .map((box) => document.querySelector(`#${box.dataset.plot} .js-plotly-plot`))
    .filter((plot) => plot?.on && plot._fullLayout?.xaxis);

  function extentOf(plot) {
    const ends = plot._fullData.filter((curve) => curve.x?.length)
      .flatMap((curve) => [curve.x[0], curve.x[curve.x.length - 1]]);
    return [Math.min(...ends), Math.max(...ends)];
  }

  const overlap = (a, b) => Math.max(0, Math.min(a[1], b[1]) - Math.max(a[0], b[0]));

  function note(plot, change) {
    if (plot.dataset.carrying) return;
    const range = change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    if (!range.every(Number.isFinite)) {
      if (change["xaxis.autorange"]) zoomed = null;
      return;
    }
    const extent = extentOf(plot);
    const isWhole = overlap(range, extent) >= WHOLE * (extent[1] - extent[0]);
    zoomed = isWhole ? null : { log: logName(), range: [...range] };
  }

  function carry(plot) {
    if (!zoomed || zoomed.log !== logName() || plot.offsetParent === null) return;
    const { range } = zoomed, present = plot._fullLayout.xaxis.range, span = range[1] - range[0];
    const same = range.every((end, k) => Math.abs(end - present[k]) < TOLERANCE * span);
    if (same || overlap(range, extentOf(plot)) < SHARE * span) return;
    plot.dataset.carrying = "yes";
    Plotly.relayout(plot, { "xaxis.range": [...range] })
      .then(() => { delete plot.dataset.carrying; });
  }

  const look = () => plots().forEach((plot) => {
    if (!plot.dataset.zoom) {
      plot.dataset.zoom = "yes";
      plot.on("plotly_relayout", (change) => note(plot, change));
      plot.on("plotly_react", () => carry(plot));
    }
    carry(plot);
  });

  let waiting = false;
  const soon = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; look(); });
  };
  /* A view that is opened fires `resize`; one that is drawn brings new figures. */
  window.addEventListener("resize", soon);
  new MutationObserver(soon).observe(document.documentElement, { childList: true, subtree: true });
  document.addEventListener("change", (event) => {
    if (event.target.matches(CHOICES)) zoomed = null;
  }, true);
})();
