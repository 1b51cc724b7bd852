"use strict";
/* Draws the paths of a page, plays them, and turns two pictures side by side together. Loads nothing. */
(function () {
  function place(times, rows, t) {
    let i = 0;
    while (i < times.length - 2 && times[i + 1] < t) i += 1;
    const span = times[i + 1] - times[i];
    const share = span > 0 ? Math.min(Math.max((t - times[i]) / span, 0), 1) : 0;
    return rows[i].map(function (value, k) { return value + share * (rows[i + 1][k] - value); });
  }

  function mount(box) {
    const given = JSON.parse(box.querySelector("script[type='application/json']").textContent);
    const plot = box.querySelector(".plot"), slider = box.querySelector("input[type=range]");
    const button = box.querySelector("button"), clock = box.querySelector("output");
    const end = given.times[given.times.length - 1];
    if (typeof Plotly === "undefined") {
      plot.textContent = "The picture could not be loaded. Please reload this page.";
      return null;
    }
    let t = 0, last = null, busy = false;
    const settings = { displaylogo: false, displayModeBar: false, responsive: true };
    const drawn = Plotly.newPlot(plot, given.figure.data, given.figure.layout, settings);

    function show() {
      const before = place(given.times, given.before, t), after = place(given.times, given.after, t);
      const rows = [before, after];
      clock.textContent = t.toFixed(1) + " of " + end.toFixed(1) + " s";
      slider.value = end > 0 ? String(Math.round(1000 * t / end)) : "0";
      if (busy) return;
      busy = true;
      Promise.all([
        Plotly.restyle(plot, { x: rows.map(function (r) { return [r[0]]; }), y: rows.map(function (r) { return [r[1]]; }),
          z: rows.map(function (r) { return [r[2]]; }) }, given.dots.slice(0, 2)),
        Plotly.restyle(plot, { x: [[t], [t]], y: rows.map(function (r) { return [r[3]]; }) }, given.dots.slice(2)),
      ]).then(function () { busy = false; });
    }

    function step(now) {
      if (last === null) return;
      t = Math.min(t + Math.min((now - last) / 1000, 0.25), end);
      last = now;
      show();
      if (t >= end) { stop(); return; }
      requestAnimationFrame(step);
    }

    function stop() { last = null; button.textContent = "Play"; }

    button.addEventListener("click", function () {
      if (last !== null) { stop(); return; }
      if (t >= end) t = 0;
      last = performance.now();
      button.textContent = "Pause";
      requestAnimationFrame(step);
    });
    slider.addEventListener("input", function () { stop(); t = end * Number(slider.value) / 1000; show(); });
    drawn.then(function () { show(); box.dataset.ready = "yes"; });
    return plot;
  }

  function together(plots) {
    let turning = false;
    plots.forEach(function (plot) {
      plot.on("plotly_relayout", function (change) {
        const camera = change["scene.camera"];
        if (!camera || turning) return;
        turning = true;
        Promise.all(plots.filter(function (other) { return other !== plot; }).map(function (other) {
          return Plotly.relayout(other, { "scene.camera": camera });
        })).then(function () { turning = false; });
      });
    });
  }

  function mountAll(root) {
    const plots = Array.from(root.querySelectorAll(".view")).map(mount).filter(Boolean);
    if (plots.length > 1) together(plots);
    root.querySelectorAll(".slider input").forEach(function (input) {
      const told = input.parentElement.querySelector("output"), chosen = input.parentElement.querySelector("input[type=hidden]");
      function take() { told.textContent = input.value; chosen.value = input.value; }
      input.addEventListener("input", take);
      if (input.value !== input.defaultValue) take(); /* moved before this script was there */
    });
  }

  window.ovitaMount = mountAll;
  if (!document.body.dataset.offline) mountAll(document);
})();
