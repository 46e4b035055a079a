// What needs a script: values under the pointer, zoom, and moving pictures. All else is there without it.
"use strict";
(() => {
  const short = (value) => Number(value.toPrecision(3)).toString();
  const json = (element) => JSON.parse(element.textContent);
  const nearest = (values, value) =>
    values.reduce((best, v, k) => (Math.abs(v - value) < Math.abs(values[best] - value) ? k : best), 0);

  function add(parent, name, attributes = {}) {
    // an SVG's children are made in its own namespace
    const element = document.createElementNS(parent.namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return parent.appendChild(element);
  }

  // ---- between the figure's points and the axes' values
  function scale(ends, log, from, to) {
    const f = log ? Math.log : (v) => v;
    const g = log ? Math.exp : (v) => v;
    const [low, high] = ends.map(f);
    return {
      at: (value) => from + ((f(value) - low) / (high - low)) * (to - from),
      value: (at) => g(low + ((at - from) / (to - from)) * (high - low)),
    };
  }

  function panel(content) {
    const [left, top, right, bottom] = content.box;
    return {
      ...content,
      across: scale(content.x.ends, content.x.log, left, right),
      up: scale(content.y.ends, content.y.log, bottom, top),
      holds: (p) => p.x >= left && p.x <= right && p.y >= top && p.y <= bottom,
    };
  }

  // ---- what is under the pointer: lines of text, and where to mark it
  const unit = (label) => (label.match(/\[(.*)\]/) || ["", ""])[1];
  const readers = {
    series(p, point) {
      const k = nearest(p.at, p.across.value(point.x));
      const rows = p.lines.filter((line) => line.y[k] !== null);
      const head = p.names ? p.names[k] : `${short(p.at[k])} ${unit(p.x.label)}`;
      return {
        text: [head, ...rows.map((line) => `${line.label}: ${short(line.y[k])} ${unit(p.y.label)}`)],
        dots: rows.map((line) => [p.across.at(p.at[k]), p.up.at(line.y[k])]),
      };
    },
    marks(p, point) {
      const places = p.marks.map(([x, y]) => [p.across.at(x), p.up.at(y)]);
      const off = places.map(([x, y]) => Math.hypot(x - point.x, y - point.y));
      const k = nearest(off, 0);
      return { text: [p.marks[k][2]], dots: [places[k]] };
    },
    field(p, point) {
      const i = nearest(p.at, p.across.value(point.x));
      const j = nearest(p.up_at, p.up.value(point.y));
      const rows = p.fields.map((one) => `${one.label}: ${short(one.z[i][j])} ${p.unit}`);
      const head = `${short(p.at[i])} ${unit(p.x.label)}, ${short(p.up_at[j])} ${unit(p.y.label)}`;
      return { text: [head, ...rows], dots: [[p.across.at(p.at[i]), p.up.at(p.up_at[j])]] };
    },
  };

  const tip = add(document.body, "div", { id: "tip", role: "status", hidden: "" });

  function say(lines, event) {
    tip.replaceChildren(...lines.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
    tip.hidden = false;
    const { width, height } = tip.getBoundingClientRect();
    const room = document.documentElement.clientWidth - width - 8;
    tip.style.left = `${Math.max(8, Math.min(event.clientX + 14, room))}px`;
    tip.style.top = `${Math.max(8, event.clientY - height - 14)}px`;
  }

  // ---- a figure: hover, and zoom by dragging a rectangle
  const charts = [];

  function chart(script) {
    const svg = script.parentElement.querySelector("svg");
    const panels = json(script).map(panel);
    const whole = svg.getAttribute("viewBox");
    const dots = add(svg, "g", { class: "dots" });
    const frame = add(svg, "rect", { class: "zoom", visibility: "hidden" });
    let start = null;
    const place = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());

    const read = (event) => {
      const point = place(event);
      const under = panels.find((p) => p.holds(point));
      dots.replaceChildren();
      tip.hidden = !under;
      if (!under) return;
      const found = readers[under.kind](under, point);
      for (const [x, y] of found.dots) add(dots, "circle", { cx: x, cy: y, r: 3 });
      say(found.text, event);
    };

    svg.addEventListener("pointermove", (event) => {
      if (!start) return read(event);
      frame.setAttribute("visibility", "visible");
      for (const [key, value] of Object.entries(between(start, place(event)))) frame.setAttribute(key, value);
    });
    svg.addEventListener("pointerleave", (event) => {
      if (event.pointerType !== "mouse") return; // what a finger has touched stays
      tip.hidden = true;
      dots.replaceChildren();
    });
    svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "mouse") return read(event);
      if (event.button !== 0) return;
      start = place(event);
      tip.hidden = true;
      svg.setPointerCapture(event.pointerId); // its release counts also outside
      event.preventDefault();
    });
    svg.addEventListener("pointercancel", () => {
      start = null;
      frame.setAttribute("visibility", "hidden");
    });
    svg.addEventListener("pointerup", (event) => {
      if (!start) return;
      const box = between(start, place(event));
      start = null;
      frame.setAttribute("visibility", "hidden");
      if (box.width > 12 && box.height > 12) svg.setAttribute("viewBox", `${box.x} ${box.y} ${box.width} ${box.height}`);
    });
    svg.addEventListener("dblclick", () => svg.setAttribute("viewBox", whole));
    charts.push({ svg, panels });
  }

  const between = (a, b) => ({
    x: Math.min(a.x, b.x),
    y: Math.min(a.y, b.y),
    width: Math.abs(a.x - b.x),
    height: Math.abs(a.y - b.y),
  });

  document.querySelectorAll(".chart > script").forEach(chart);

  // ---- moving pictures
  function unpacked(scene) {
    const size = scene.high.map((high, k) => (high - scene.low[k]) / 254);
    return scene.positions.map((text) => {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      return (at) => (bytes[at] === 255 ? NaN : scene.low[at % 3] + size[at % 3] * bytes[at]);
    });
  }

  // orthographic, seen from the side and a little from above
  const TILT = 0.32;
  function view(canvas, low, high) {
    const pen = canvas.getContext("2d");
    const { width, height } = canvas;
    const tall = (high[2] - low[2]) * Math.cos(TILT) + (high[1] - low[1]) * Math.sin(TILT);
    const zoom = 0.94 * Math.min(width / (high[0] - low[0]), height / tall);
    const middle = low.map((v, k) => (v + high[k]) / 2);
    return {
      pen,
      zoom,
      clear: () => pen.clearRect(0, 0, width, height),
      at: ([x, y, z]) => [
        width / 2 + zoom * (x - middle[0]),
        height / 2 - zoom * ((z - middle[2]) * Math.cos(TILT) + (y - middle[1]) * Math.sin(TILT)),
      ],
    };
  }

  function path(v, points, style) {
    v.pen.beginPath();
    points.forEach((point) => v.pen.lineTo(...v.at(point)));
    Object.assign(v.pen, { lineWidth: 1.2, strokeStyle: "#616e7c", lineCap: "round" }, style);
    if (style && style.fillStyle) v.pen.fill();
    else v.pen.stroke();
  }

  const TURN = Array.from({ length: 49 }, (_, k) => (2 * Math.PI * k) / 48);
  function cup(v, radius, height, place, style) {
    const ring = (z) => TURN.map((a) => place([radius * Math.cos(a), radius * Math.sin(a), z]));
    path(v, ring(0), style);
    path(v, ring(height), style);
    for (const x of [-radius, radius]) path(v, [place([x, 0, 0]), place([x, 0, height])], style);
  }

  function drops(v, coordinate, count, first, radius) {
    const seen = [];
    for (let n = 0; n < count; n += 1) {
      const at = first + 3 * n;
      const point = [coordinate(at), coordinate(at + 1), coordinate(at + 2)];
      if (!Number.isNaN(point[0])) seen.push(point);
    }
    seen.sort((a, b) => b[1] - a[1]); // the far ones first
    const [far, near] = [seen[0], seen[seen.length - 1]].map((p) => (p ? p[1] : 0));
    for (const point of seen) {
      const depth = far === near ? 1 : (far - point[1]) / (far - near);
      v.pen.fillStyle = `hsl(211 ${45 + 20 * depth}% ${78 - 36 * depth}%)`;
      v.pen.beginPath();
      v.pen.arc(...v.at(point), v.zoom * radius, 0, 7);
      v.pen.fill();
    }
  }

  const painters = {
    stir(scene, v, draw, frame) {
      const { radius, height } = scene.cup;
      cup(v, radius, height, (p) => p);
      drops(v, scene.coordinates[draw], scene.particles, 3 * frame * scene.particles, scene.radius);
      const stick = { lineWidth: 2 * v.zoom * scene.stick, strokeStyle: "rgb(209 89 26 / 75%)" };
      path(v, [scene.pivot[draw][frame], scene.tip[draw][frame]], stick);
    },
    pour(scene, v, draw, frame) {
      const [c, s] = [Math.cos(scene.angle[frame]), Math.sin(scene.angle[frame])];
      const { source, receiver } = scene;
      const turned = ([x, y, z]) => {
        const [a, b] = [x - source.radius, z - source.height];
        return [c * a + s * b, y, c * b - s * a];
      };
      const floor = -scene.lip_height;
      const below = ([x, y, z]) => [x + scene.distance, y, z + floor];
      const level = Math.min(scene.caught[draw][frame] * scene.depth, receiver.height);
      const disc = (z) => TURN.map((a) => below([receiver.radius * Math.cos(a), receiver.radius * Math.sin(a), z]));
      for (let z = 0; z < level; z += level / 30) path(v, disc(z), { fillStyle: "hsl(211 55% 50%)" });
      if (level > 0) path(v, disc(level), { fillStyle: "hsl(211 60% 68%)" });
      cup(v, source.radius, source.height, turned);
      cup(v, receiver.radius, receiver.height, below);
      drops(v, scene.coordinates[draw], scene.particles, 3 * frame * scene.particles, scene.radius);
    },
  };

  function movie(figure, scene) {
    const canvas = figure.querySelector("canvas");
    const [button, slider, clock] = ["button", "input", "output"].map((name) => figure.querySelector(name));
    const v = view(canvas, scene.seen[0], scene.seen[1]);
    scene.coordinates = unpacked(scene);
    let [draw, began] = [0, null];
    slider.max = scene.time.length - 1;
    figure.querySelector(".controls").hidden = false;

    const paint = () => {
      const frame = Number(slider.value);
      v.clear();
      painters[figure.dataset.movie](scene, v, draw, frame);
      clock.textContent = `${scene.time[frame].toFixed(1)} s`;
      figure.dispatchEvent(new CustomEvent("frame", { detail: scene.time[frame] }));
    };
    const step = (now) => {
      if (began === null) return;
      const last = scene.time[scene.time.length - 1];
      const time = (now - began) / 1000;
      slider.value = time > last ? scene.time.length - 1 : nearest(scene.time, time);
      paint();
      if (time > last) stop();
      else requestAnimationFrame(step);
    };
    const stop = () => {
      began = null;
      button.textContent = "Play";
    };
    button.addEventListener("click", () => {
      if (began !== null) return stop();
      if (Number(slider.value) >= scene.time.length - 1) slider.value = 0;
      began = performance.now() - 1000 * scene.time[Number(slider.value)];
      button.textContent = "Pause";
      requestAnimationFrame(step);
    });
    slider.addEventListener("input", () => {
      stop();
      paint();
    });
    paint();
    return (chosen) => {
      draw = chosen;
      paint();
    };
  }

  // ---- one draw of the posterior, in all figures
  function follow(script) {
    const { draws, scenes, extended } = json(script);
    const movies = [...document.querySelectorAll("[data-movie]")].map((figure) => movie(figure, scenes[figure.dataset.movie]));
    // what has the missing effect has no place among the figures of a calibration without it
    const traces = (extended ? [] : charts).flatMap(({ svg, panels }) =>
      panels
        .filter((p) => p.plane || p.parameters)
        .map((p) => ({ p, mark: add(svg, p.plane ? "polyline" : "circle", { class: "drawn", r: 5 }), cursor: p.plane && p.recording === 0 && add(svg, "line", { class: "cursor" }) })),
    );
    const show = (chosen) => {
      const one = draws[chosen];
      movies.forEach((change) => change(chosen));
      for (const { p, mark } of traces) {
        if (p.parameters) {
          mark.setAttribute("cx", p.across.at(one.theta[p.parameters[0]]));
          mark.setAttribute("cy", p.up.at(one.theta[p.parameters[1]]));
        } else if (p.recording === 0) {
          const points = one.time.map((t, k) => `${p.across.at(t)},${p.up.at(one.inclination[p.plane][k])}`);
          mark.setAttribute("points", points.join(" "));
        }
      }
      document.querySelectorAll("[data-draw-text]").forEach((place) => (place.textContent = one[place.dataset.drawText]));
    };
    document.querySelectorAll("input[name=draw]").forEach((choice) => {
      choice.addEventListener("change", () => show(Number(choice.value)));
    });
    document.querySelectorAll("[data-movie=stir]").forEach((figure) =>
      figure.addEventListener("frame", (event) => {
        for (const { p, cursor } of traces.filter((trace) => trace.cursor)) {
          const x = p.across.at(event.detail);
          for (const [key, value] of [["x1", x], ["x2", x], ["y1", p.box[1]], ["y2", p.box[3]]]) cursor.setAttribute(key, value);
        }
      }),
    );
    show(0);
  }
  document.querySelectorAll(".scripted").forEach((element) => (element.hidden = false));
  document.querySelectorAll("#draws").forEach(follow);
})();
