// Viewer of whole runs: draws quantised series on two canvases, the lowest and highest value of every pixel column.
(function () {
  "use strict";
  var box = document.getElementById("viewer");
  var runs = JSON.parse(document.getElementById("viewer-data").textContent);
  var STYLES = {
    measured: { colour: "#b0b0b0", width: 2.6, dash: [] },
    before: { colour: "#d55e00", width: 1.1, dash: [4, 3] },
    after: { colour: "#0072b2", width: 1.1, dash: [] }
  };
  var LEFT = 58, RIGHT = 8, TOP = 8, BOTTOM = 30, NEAREST = 16;
  var choice = { run: 0, channel: 0 }, view = [0, 1], cache = {}, drag = null;

  function decoded(series, key) {
    if (!cache[key]) {
      var text = atob(series.data), values = new Float32Array(text.length / 2);
      for (var i = 0; i < values.length; i++) {
        values[i] = series.low + series.step * (text.charCodeAt(2 * i) + 256 * text.charCodeAt(2 * i + 1));
      }
      cache[key] = values;
    }
    return cache[key];
  }

  function lines(part) {
    var run = runs[choice.run], channel = run.channels[choice.channel], all = {};
    Object.keys(channel.series).forEach(function (model) {
      all[model] = decoded(channel.series[model], choice.run + "/" + channel.name + "/" + model);
    });
    if (part === "signal") { return all; }
    var residuals = {};
    ["before", "after"].forEach(function (model) {
      if (all[model]) {
        residuals[model] = all.measured.map(function (x, i) { return x - all[model][i]; });
      }
    });
    return residuals;
  }

  function ticks(low, high, count) {
    var raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
    var step = [1, 2, 5, 10].map(function (m) { return m * power; }).find(function (s) { return s >= raw; });
    var found = [];
    for (var k = Math.ceil(low / step); k * step <= high; k++) {
      found.push({ at: k * step, text: (k * step).toFixed(Math.max(0, -Math.floor(Math.log10(step)))).replace("-", "\u2212") });
    }
    return found;
  }

  function draw(canvas) {
    var part = canvas.dataset.part, run = runs[choice.run], channel = run.channels[choice.channel];
    var wide = canvas.clientWidth, high = canvas.clientHeight, scale = window.devicePixelRatio || 1;
    canvas.width = wide * scale;
    canvas.height = high * scale;
    var pen = canvas.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.font = "11px Helvetica, Arial, sans-serif";
    var series = lines(part), from = Math.floor(view[0]), to = Math.ceil(view[1]), low = Infinity, top = -Infinity;
    Object.keys(series).forEach(function (model) {
      for (var i = from; i <= to && i < series[model].length; i++) {
        low = Math.min(low, series[model][i]);
        top = Math.max(top, series[model][i]);
      }
    });
    if (!(top > low)) { top = low + 1; }
    var margin = 0.05 * (top - low);
    low -= margin;
    top += margin;
    function x(i) { return LEFT + (wide - LEFT - RIGHT) * (i - view[0]) / (view[1] - view[0]); }
    function y(value) { return TOP + (high - TOP - BOTTOM) * (top - value) / (top - low); }
    pen.fillStyle = "#444";
    pen.strokeStyle = "#e6e6e6";
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    ticks(low, top, high / 45).forEach(function (tick) {
      pen.beginPath(); pen.moveTo(LEFT, y(tick.at)); pen.lineTo(wide - RIGHT, y(tick.at)); pen.stroke();
      pen.fillText(tick.text, LEFT - 5, y(tick.at));
    });
    pen.textAlign = "center";
    pen.textBaseline = "top";
    var start = run.start + view[0] * run.step, end = run.start + view[1] * run.step;
    ticks(start, end, wide / 110).forEach(function (tick) {
      var at = x((tick.at - run.start) / run.step);
      pen.beginPath(); pen.moveTo(at, TOP); pen.lineTo(at, high - BOTTOM); pen.stroke();
      pen.fillText(tick.text, at, high - BOTTOM + 4);
    });
    pen.fillText("time [s]", (LEFT + wide - RIGHT) / 2, high - 13);
    pen.save();
    pen.translate(10, (TOP + high - BOTTOM) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textBaseline = "middle";
    pen.fillText((part === "residual" ? "residual " : "") + channel.name + (channel.unit ? " [" + channel.unit + "]" : ""), 0, 0);
    pen.restore();
    pen.save();
    pen.beginPath(); pen.rect(LEFT, TOP, wide - LEFT - RIGHT, high - TOP - BOTTOM); pen.clip();
    ["measured", "before", "after"].forEach(function (model) {
      if (series[model]) { trace(pen, series[model], STYLES[model], x, y, from, to, wide); }
    });
    if (drag && drag.box) {
      pen.fillStyle = "rgba(0, 0, 0, 0.12)";
      pen.fillRect(Math.min(drag.from, drag.to), 0, Math.abs(drag.to - drag.from), high);
    }
    pen.restore();
  }

  function trace(pen, values, style, x, y, from, to, wide) {
    var last = Math.min(to, values.length - 1), each = Math.max(1, Math.floor((last - from) / (2 * wide)));
    pen.strokeStyle = style.colour;
    pen.lineWidth = style.width;
    pen.setLineDash(each > 1 ? [] : style.dash);
    pen.beginPath();
    for (var i = from; i <= last; i += each) {
      var low = values[i], high = values[i];
      for (var k = i; k < i + each && k <= last; k++) {
        low = Math.min(low, values[k]);
        high = Math.max(high, values[k]);
      }
      if (i === from) { pen.moveTo(x(i), y(values[i])); } else { pen.lineTo(x(i), y(low)); }
      if (high > low) { pen.lineTo(x(i), y(high)); }
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  function samples() {
    var channel = runs[choice.run].channels[choice.channel];
    return channel.series.measured.data.length * 3 / 8;
  }

  function show(from, to) {
    var last = Math.floor(samples()) - 2, width = Math.min(Math.max(to - from, NEAREST), last);
    from = Math.min(Math.max(from, 0), last - width);
    view = [from, from + width];
    var run = runs[choice.run];
    box.querySelector("[data-range]").textContent =
      (run.start + view[0] * run.step).toFixed(2) + " to " + (run.start + view[1] * run.step).toFixed(2) + " s";
    box.querySelectorAll("canvas").forEach(draw);
  }

  function zoom(factor, at) {
    show(at - (at - view[0]) * factor, at + (view[1] - at) * factor);
  }

  function fill(select, names) {
    select.replaceChildren.apply(select, names.map(function (name, i) { return new Option(name, i); }));
  }

  function selectRun(index) {
    var run = runs[index], channels = run.channels.map(function (c) { return c.name; });
    choice = { run: index, channel: Math.min(choice.channel, channels.length - 1) };
    fill(box.querySelector("[data-choice=channel]"), channels);
    box.querySelector("[data-choice=channel]").value = choice.channel;
    var remarks = [];
    if (run.stride > 1) { remarks.push("Every " + run.stride + "th sample is shown."); }
    if (run.omitted) { remarks.push(run.omitted + " channels are left out of this page; simulated_*.csv.gz contains them."); }
    box.querySelector("[data-remark]").textContent = remarks.join(" ");
    show(0, Infinity);
  }

  function sample(canvas, pixel) {
    return view[0] + (view[1] - view[0]) * (pixel - LEFT) / (canvas.clientWidth - LEFT - RIGHT);
  }

  box.hidden = false;
  fill(box.querySelector("[data-choice=run]"), runs.map(function (run) { return run.file + ", from " + run.start.toFixed(1) + " s"; }));
  box.querySelector("[data-choice=run]").addEventListener("change", function () { selectRun(Number(this.value)); });
  box.querySelector("[data-choice=channel]").addEventListener("change", function () {
    choice.channel = Number(this.value);
    show(view[0], view[1]);
  });
  box.querySelectorAll("[data-zoom]").forEach(function (button) {
    button.addEventListener("click", function () {
      if (button.dataset.zoom === "all") { show(0, Infinity); } else { zoom(Number(button.dataset.zoom), (view[0] + view[1]) / 2); }
    });
  });
  box.querySelectorAll("canvas").forEach(function (canvas) {
    canvas.addEventListener("wheel", function (event) {
      event.preventDefault();
      zoom(event.deltaY > 0 ? 1.25 : 0.8, sample(canvas, event.offsetX));
    }, { passive: false });
    canvas.addEventListener("dblclick", function () { show(0, Infinity); });
    canvas.addEventListener("pointerdown", function (event) {
      drag = { from: event.offsetX, to: event.offsetX, box: !event.shiftKey, view: view };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", function (event) {
      if (!drag) { return; }
      drag.to = event.offsetX;
      if (drag.box) { draw(canvas); return; }
      var moved = (drag.from - drag.to) * (drag.view[1] - drag.view[0]) / (canvas.clientWidth - LEFT - RIGHT);
      show(drag.view[0] + moved, drag.view[1] + moved);
    });
    canvas.addEventListener("pointerup", function () {
      var ends = drag && [drag.from, drag.to].map(function (pixel) { return sample(canvas, pixel); });
      var isBox = drag && drag.box && Math.abs(drag.to - drag.from) > 4;
      drag = null;
      if (isBox) { show(Math.min.apply(null, ends), Math.max.apply(null, ends)); } else { show(view[0], view[1]); }
    });
  });
  window.addEventListener("resize", function () { show(view[0], view[1]); });
  selectRun(0);
})();
