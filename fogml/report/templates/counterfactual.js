(function () {
  "use strict";
  var data = JSON.parse(document.getElementById("what-if-data").textContent);
  var plot = document.querySelector(".plot");
  var sliders = Array.prototype.slice.call(document.querySelectorAll(".sliders input"));
  var chosen = document.getElementById("run");

  function values(packed) {
    var bytes = Uint8Array.from(atob(packed), function (letter) { return letter.charCodeAt(0); });
    return Array.prototype.slice.call(new Float32Array(bytes.buffer));
  }

  var runs = data.runs.map(function (run) {
    var courses = {};
    Object.keys(run.courses).forEach(function (id) { courses[id] = values(run.courses[id]); });
    return {
      floor: run.floor, time: values(run.time), temperature: values(run.temperature),
      recorded: values(run.recorded), replayed: values(run.replayed), courses: courses
    };
  });

  function number(value) {
    var parts = Number(value.toPrecision(3)).toString().split("e");
    var power = (parts[1] || "").replace("+", "").replace("-", "⁻").replace(/\d/g, function (digit) {
      return "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit];
    });
    return parts[0].replace("-", "−") + (power && " × 10" + power);
  }

  function show(whole) {
    var run = runs[Number(chosen.value)];
    var replayed = run.replayed.slice();
    sliders.forEach(function (slider) {
      var factor = Number(slider.value);
      var course = run.courses[slider.dataset.effect];
      var told = number(factor * Number(slider.dataset.size)) + " " + slider.dataset.unit;
      document.getElementById(slider.id + "-told").textContent = number(factor) + " × = " + told;
      for (var i = 0; course && factor !== 0 && i < replayed.length; i += 1) {
        replayed[i] += factor * course[i];
      }
    });
    var gap = replayed.map(function (value, i) { return run.recorded[i] - value; });
    var square = gap.reduce(function (sum, value) { return sum + value * value; }, 0) / gap.length;
    document.getElementById("left").textContent =
      "Gap " + number(Math.sqrt(square)) + " deg/h rms, noise floor " + number(run.floor) + " deg/h";
    if (whole) {
      Plotly.restyle(plot, { x: [run.time], y: [run.temperature] }, [0]);
      Plotly.restyle(plot, { x: [run.time], y: [run.recorded] }, [1]);
    }
    Plotly.restyle(plot, { x: [run.time, run.time], y: [replayed, gap] }, [2, 3]);
  }

  function set(factorOf) {
    sliders.forEach(function (slider) { slider.value = factorOf(slider); });
    show(false);
  }

  window.addEventListener("load", function () {
    sliders.forEach(function (slider) { slider.addEventListener("input", function () { show(false); }); });
    chosen.addEventListener("change", function () { show(true); });
    document.getElementById("as-found").addEventListener("click", function () {
      set(function (slider) { return slider.dataset.start; });
    });
    document.getElementById("all-off").addEventListener("click", function () {
      set(function () { return 0; });
    });
    show(true);
    document.body.dataset.ready = "yes";
  });
})();
