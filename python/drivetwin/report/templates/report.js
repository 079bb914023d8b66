"use strict";
(() => {
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const plots = [];

  /* Colours of text, grid and buttons; traces keep theirs, which read on both grounds. */
  function theme(layout, isDark) {
    const ink = isDark ? "#dfe3e9" : "#2a313b";
    const change = {
      "font.color": ink,
      "hoverlabel.bgcolor": isDark ? "#232a34" : "#ffffff",
      "hoverlabel.font.color": ink,
    };
    (layout.updatemenus || []).forEach((_, index) => {
      change[`updatemenus[${index}].bgcolor`] = isDark ? "#232a34" : "#ffffff";
      change[`updatemenus[${index}].bordercolor`] = isDark ? "#475060" : "#c3cad4";
      change[`updatemenus[${index}].font.color`] = ink;
    });
    return change;
  }

  function paint(isDark) {
    return Promise.all(plots.map((plot) => Plotly.relayout(plot, theme(plot.layout, isDark))));
  }

  const options = {
    responsive: true,
    displaylogo: false,
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
  };
  function draw() {
    document.querySelectorAll(".plot").forEach((plot) => {
      const source = plot.querySelector("script");
      const figure = JSON.parse(source.textContent);
      source.remove();
      plots.push(plot);
      Plotly.newPlot(plot, figure.data, figure.layout, options);
    });
    paint(dark.matches);
    dark.addEventListener("change", (event) => paint(event.matches));
    prepareForPaper();
  }

  /* The library stands in the page as base64 of gzip. */
  async function unpack(id) {
    const packed = Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  }

  /* Paper is narrower than the screen and always light. */
  const paper = { width: 690, tallest: 900 };
  function prepareForPaper() {
    const heights = plots.map((plot) => plot.layout.height);
    window.addEventListener("beforeprint", () => {
      paint(false);
      plots.forEach((plot, index) => {
        const height = Math.min(heights[index], paper.tallest);
        Plotly.relayout(plot, { width: paper.width, height });
      });
    });
    window.addEventListener("afterprint", () => {
      paint(dark.matches);
      plots.forEach((plot, index) => {
        Plotly.relayout(plot, { width: null, height: heights[index], autosize: true });
      });
    });
  }

  unpack("plotly").then(draw, () => {
    document.getElementById("too-old").hidden = false;
  });
})();
