// The page: choices, player and legend. `window.lgvi` is for tests and for the console.

/** Bodies that are listed at first, where there are more. */
const LISTED = 5;
/** Kinds of what a maneuver keeps to, with color and name. */
const LIMITS = [
  ["keep_out_cone", COLORS.forbidden, "keep-out cone; white: the axis that keeps clear of it"],
  ["keep_out_ellipsoid", COLORS.forbidden, "keep-out ellipsoid or sphere"],
  ["keep_in_sphere", COLORS.corridor, "keep-in sphere"],
  ["corridor", COLORS.corridor, "corridor"],
  ["line_of_sight", COLORS.corridor, "line of sight, with the point in it"],
  ["plume", COLORS.forbidden, "plume, with the point outside of it"],
];
/** The whole flight is played in this many seconds. */
const PLAY = [5, 10, 20, 60];

function start() {
  const flight = new Flight(JSON.parse(document.getElementById("flight").textContent));
  const find = (id) => document.getElementById(id);
  const clock = timeUnit(flight.end - flight.start);
  const duration = flight.end - flight.start;
  find("subtitle").textContent = `${flight.integrator}, ${flight.steps} steps, ${short(flight.end / clock.size)} ${clock.symbol}`
    + (flight.cost === null ? "" : `, ${flight.cost[0]} ${short(flight.cost[1], 6)}`);
  const states = flight.shown < flight.recorded ? `${flight.shown} of ${flight.recorded} recorded states, evenly chosen` : `all ${flight.recorded} recorded states`;
  find("footer").textContent = `Shows ${states}. SI units. Drag in a plot to zoom, double-click to see all, click to go to a time. `
    + "In the view: drag to turn, right-drag to move, wheel to zoom. Made by lgvi with three.js and uPlot (MIT license).";

  const listed = firstListed(flight);
  const view = makeView(find("view"), find("notice"), flight, listed);
  const state = { time: flight.start, playing: false, last: null };
  const plots = new Plots(flight, seek);
  new Panels(find("right"), flight, plots);

  function seek(t) {
    state.time = Math.min(Math.max(t, flight.start), flight.end);
    find("slider").value = duration > 0 ? (state.time - flight.start) / duration : 0;
    find("now").textContent = `${(state.time / clock.size).toFixed(decimals(duration / clock.size))} of ${short(flight.end / clock.size)} ${clock.symbol}`;
    if (view) Object.assign(view, { time: state.time, stale: true });
    plots.seek(state.time);
  }

  function play(playing) {
    Object.assign(state, { playing, last: null });
    if (playing && state.time >= flight.end) seek(flight.start);
    find("play").textContent = playing ? "❚❚" : "▶";
    find("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  }

  function tick(now) {
    if (state.playing) {
      if (state.last !== null) seek(state.time + ((now - state.last) / 1000) * Number(find("speed").value));
      state.last = now;
      if (state.time >= flight.end) play(false);
    }
    if (view?.stale) view.draw();
    requestAnimationFrame(tick);
  }

  find("slider").addEventListener("input", (event) => seek(flight.start + Number(event.target.value) * duration));
  find("play").addEventListener("click", () => play(!state.playing));
  fillSpeeds(find("speed"), duration);
  if (view) {
    fillFrames(find("frame"), find("focus"), flight, view);
    find("fit").addEventListener("click", () => view.fit());
    for (const [id, key] of [["true_size", "trueSize"], ["axes", "withAxes"], ["labels", "withLabels"]]) {
      find(id).addEventListener("change", (event) => Object.assign(view, { [key]: event.target.checked, stale: true }));
    }
    fillLegend(find("legend"), flight, listed, view);
    fillBodies(find("bodies"), flight, listed, () => {
      view.list();
      fillLegend(find("legend"), flight, listed, view);
    });
  } else {
    for (const id of ["choices", "bar", "bodies"]) find(id).hidden = true;
  }
  const resized = () => {
    view?.resize();
    plots.resize();
  };
  new ResizeObserver(resized).observe(document.querySelector("main"));
  window.addEventListener("resize", resized);
  view?.resize();
  if (view) {
    const frame = flight.bestFrame();
    find("frame").value = frame.kind === "inertial" ? frame.kind : `${frame.kind} ${frame.body}`;
    view.setFrame(frame);
  }
  seek(flight.start);
  view?.draw();
  requestAnimationFrame(tick);
  window.lgvi = { flight, view, plots, seek, play, time: () => state.time };
  document.documentElement.dataset.ready = "true";
}

function makeView(host, notice, flight, listed) {
  try {
    return new View(host, flight, listed);
  } catch (error) {
    notice.hidden = false;
    notice.textContent = `The 3D view needs WebGL, which this browser does not offer (${error.message.replace(/\.$/, "")}). The plots do without it.`;
    return null;
  }
}

/** All bodies of a few; else those that are controlled, the most massive, and the first. */
function firstListed(flight) {
  const bodies = flight.bodies.map((body) => body.index);
  if (bodies.length <= LISTED) return new Set(bodies);
  return new Set([...new Set([...flight.controls.map((controls) => controls.body), heaviestOf(flight.bodies), ...bodies])].slice(0, LISTED));
}

function decimals(duration) {
  return Math.min(Math.max(3 - Math.floor(Math.log10(duration || 1)), 0), 9);
}

function fillSpeeds(select, duration) {
  select.append(new Option("real time", 1));
  for (const seconds of PLAY) {
    const rate = duration / seconds;
    select.append(new Option(`${short(rate, 3)} × (all in ${seconds} s)`, rate, seconds === 10, seconds === 10));
  }
}

function fillFrames(frames, focuses, flight, view) {
  frames.append(new Option("inertial frame", "inertial"));
  const kinds = [["centered", "with the body, inertial axes", ""], ["fixed", "fixed to the body's axes", " (its axes)"]];
  if (flight.scenery.attractor) kinds.push(["orbital", "with the body, orbital axes: radial, transverse, normal", " (its orbit)"]);
  for (const [kind, title, suffix] of kinds) {
    const group = document.createElement("optgroup");
    group.label = title;
    for (const body of flight.bodies) group.append(new Option(body.name + suffix, `${kind} ${body.index}`));
    frames.append(group);
  }
  frames.addEventListener("change", () => {
    const [kind, body] = frames.value.split(" ");
    view.setFrame({ kind, body: Number(body) });
  });
  focuses.append(new Option("everything", ""));
  for (const body of flight.bodies) focuses.append(new Option(body.name, body.index));
  focuses.addEventListener("change", () => {
    view.focus = focuses.value === "" ? null : Number(focuses.value);
    view.fit();
  });
}

function fillBodies(details, flight, listed, changed) {
  details.hidden = flight.bodies.length < 2;
  details.open = flight.bodies.length > LISTED;
  details.querySelector("summary").textContent = `Bodies with trail and name (${flight.bodies.length} in all)`;
  for (const body of flight.bodies) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = listed.has(body.index);
    box.addEventListener("change", () => {
      if (box.checked) listed.add(body.index);
      else listed.delete(body.index);
      changed();
    });
    const swatch = document.createElement("i");
    swatch.style.background = bodyColor(body.index);
    label.append(box, swatch, body.name);
    details.querySelector("div").append(label);
  }
}

function fillLegend(list, flight, listed, view) {
  list.replaceChildren();
  const add = (color, text, kind = "") => {
    const item = document.createElement("li");
    const swatch = document.createElement("i");
    swatch.className = kind;
    if (kind === "area") swatch.style.background = color;
    swatch.style.borderColor = color;
    swatch.style.borderTopStyle = kind === "dashed" ? "dashed" : "solid";
    item.append(swatch, text);
    list.append(item);
  };
  for (const body of flight.bodies) if (listed.has(body.index)) add(bodyColor(body.index), body.name);
  if (flight.bodies.length > listed.size) add(COLORS.other, "other bodies", "area");
  const { maneuver, planned, scenery } = flight;
  const { force, moment } = view.largest;
  if (force > 0) add(COLORS.force, `control force, up to ${short(force, 3)} N`);
  if (moment > 0) add(COLORS.moment, `control moment, up to ${short(moment, 3)} N m`);
  if (maneuver?.initial_orbit) add(COLORS.initial, "initial orbit");
  if (maneuver?.target_orbit) add(COLORS.target, "target orbit", "dashed");
  if (planned.some(({ position, attitude, spin_direction }) => position || attitude || spin_direction)) add(COLORS.target, "target", "area");
  for (const [kind, color, text] of LIMITS) {
    const found = planned.flatMap(({ limits }) => limits.filter((limit) => limit.kind === kind));
    if (found.length > 0) add(color, found.every(({ soft }) => soft) ? `${text} (soft)` : text, "area");
  }
  if (scenery.attractor) add(COLORS.attractor, scenery.attractor.radius > 0 ? `attractor, radius ${lengthText(scenery.attractor.radius)}` : "attractor (a point)", "area");
  if (flight.bodies.some((body) => body.is_pivoted)) add(COLORS.pivot, "pivot, to the center of mass", "light");
  COLORS.axes.forEach((color, axis) => add(color, `${COMPONENTS[axis]} axes`));
  if (scenery.gravity) {
    const item = document.createElement("li");
    item.textContent = `gravity of ${short(norm(scenery.gravity), 3)} m/s² points down`;
    list.append(item);
  }
}

try {
  start();
} catch (error) {
  const notice = document.getElementById("notice");
  notice.hidden = false;
  notice.textContent = `This page cannot be shown: ${error.message}`;
  throw error;
}
