(function () {
  "use strict";
  var PAPER_WIDTH = 672; // px on A4 within the margins of the style sheet
  // The buttons are named one by one: plotly's own choice holds one that sends the chart away.
  var options = {
    displaylogo: false,
    responsive: true,
    plotlyServerURL: "",
    topojsonURL: "",
    modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"], ["toImage"]],
    toImageButtonOptions: { format: "svg" }
  };
  var waiting = Array.prototype.slice.call(document.querySelectorAll(".plot"));
  var shown = waiting.slice(), onPaper = false; // where there are no tools

  function draw(plot) {
    var figure = JSON.parse(document.getElementById(plot.id + "-data").textContent);
    options.toImageButtonOptions.filename = document.title + " " + plot.id;
    var plain = plot.classList.contains("plain");
    Plotly.newPlot(plot, figure.data, figure.layout, Object.assign({}, options, plain ? { displayModeBar: false } : {}));
    plot.on("plotly_afterplot", function () { clear(plot); });
    clear(plot);
  }

  // A legend, or names of bands above the axes, that reach under the tools make room for them.
  function clear(plot) {
    var tools = plot.querySelector(".modebar");
    if (onPaper || !tools || !tools.getClientRects().length) {
      return;
    }
    var below = tools.getBoundingClientRect(), under = 0;
    plot.querySelectorAll(".legend .legendtext, .infolayer .annotation-text").forEach(function (text) {
      var box = text.getBoundingClientRect();
      if (box.right > below.left && box.left < below.right && box.top < below.bottom && box.bottom > below.top) {
        under = Math.max(under, below.bottom - box.top);
      }
    });
    if (under > 0) {
      var layout = plot._fullLayout, more = Math.ceil(under) + 2, high = layout.height + more;
      plot.style.height = high + "px";
      Plotly.relayout(plot, { "margin.t": layout.margin.t + more, height: high, autosize: true, width: null });
    }
  }

  // One figure per turn, so that the first can be read while the rest are drawn.
  function next() {
    if (waiting.length) {
      draw(waiting.shift());
      setTimeout(next, 0);
    } else {
      document.body.dataset.drawn = shown.length;
    }
  }

  window.addEventListener("beforeprint", function () {
    onPaper = true;
    while (waiting.length) {
      draw(waiting.shift());
    }
    shown.forEach(function (plot) {
      Plotly.relayout(plot, { autosize: false, width: PAPER_WIDTH });
    });
  });
  window.addEventListener("afterprint", function () {
    onPaper = false;
    shown.forEach(function (plot) {
      Plotly.relayout(plot, { autosize: true, width: null });
    });
  });
  next();
})();
