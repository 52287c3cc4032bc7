// Which plots there are: those that have something to show.

const COMPONENTS = ["x", "y", "z"];
/** Below this part of what a flight could have, a quantity is rounding. */
const NOTHING = 1e-10;
/** Angles that go round more often are counted on, for they would fill the plot. */
const ROUNDS = 25;

class Panels {
  constructor(host, flight, plots) {
    Object.assign(this, { host, flight, plots, angles: "euler", body: 0, pair: [0, 1], axes: "centered" });
    const { maneuver } = flight;
    // What is moved by rule only has the least to tell.
    this.body = maneuver?.body ?? Math.max(0, flight.bodies.findIndex((body) => !body.is_driven));
    if (maneuver?.body > 0) this.pair = [0, maneuver.body];
    const best = flight.bestFrame();
    if (best.kind === "orbital") this.axes = best.kind;
    const places = flight.bodies.flatMap((body) => even(flight.time.length, 100).map((k) => nth(body.position, k)));
    const extent = most(flight.bodies.map((body) => body.extent));
    this.duration = flight.end - flight.start || 1;
    this.length = Math.max(diagonal(places), extent);
    this.sections = {};
    const names = flight.bodies.map((body) => body.name);
    const bodyChoice = this.choice("", names, this.body, (index) => { this.body = index; this.showBody(); });
    this.section("body", "Body", names.length > 1 ? [bodyChoice] : [], names.length > 1 ? "" : names[0]);
    if (names.length > 1) {
      const [from, of] = this.pair;
      const axes = [["centered", "inertial axes"], ["fixed", "axes of the latter"]];
      if (flight.scenery.attractor) axes.push(["orbital", "orbital axes of the latter"]);
      this.section("pair", "Motion", [
        this.choice("of", names, of, (index) => { this.pair[1] = index; this.showPair(); }),
        this.choice("relative to", names, from, (index) => { this.pair[0] = index; this.showPair(); }),
        this.choice("in", axes.map(([, title]) => title), axes.findIndex(([kind]) => kind === this.axes), (index) => { this.axes = axes[index][0]; this.showPair(); }),
      ]);
    }
    this.section("all", names.length > 1 ? "All bodies together" : "Energy and momentum", []);
    this.showBody();
    if (names.length > 1) this.showPair();
    this.showAll();
  }

  section(key, title, choices, name = "") {
    const heading = document.createElement("h2");
    heading.append(name ? `${title} ${name}` : title, ...choices);
    const host = document.createElement("div");
    this.host.append(heading, host);
    this.sections[key] = host;
  }

  choice(title, options, chosen, change) {
    const label = document.createElement("label");
    const select = document.createElement("select");
    options.forEach((option, index) => select.append(new Option(option, index, index === chosen, index === chosen)));
    select.addEventListener("change", () => change(Number(select.value)));
    label.append(`${title} `, select);
    return label;
  }

  /** A plot of vectors, by component, unless there is nothing. */
  vectors(host, title, unit, vectors, scale, extra = []) {
    const curves = COMPONENTS.map((label, i) => ({ label, values: vectors.map((vector) => vector[i]) }));
    const largest = most(vectors.map(norm));
    if (!(largest > NOTHING * scale)) return;
    this.plots.add(host, { title, unit, time: this.flight.time, curves: [...curves, ...extra] });
  }

  each(values) {
    return Array.from({ length: this.flight.time.length }, (_, k) => values(k));
  }

  showBody() {
    const { flight, plots, duration, length } = this;
    const host = this.sections.body;
    plots.clear(host);
    const body = flight.bodies[this.body];
    if (this.planned()) this.showLimits(host);
    this.showControls(host);
    this.showAttitude(host, body);
    const rates = this.each((k) => flight.angularVelocity(body, k));
    this.vectors(host, "Angular velocity, body axes", "rad/s", rates, 1 / duration);
    const spins = this.each((k) => nth(body.angular_momentum, k));
    const about = body.is_pivoted ? "the pivot" : "the center of mass";
    const moments = 1 / Math.max(...body.inverse_inertia.map(Math.abs));
    this.vectors(host, `Angular momentum about ${about}, body axes`, "kg m²/s", spins, moments / duration);
    const places = this.each((k) => nth(body.position, k));
    if (diagonal(places) > NOTHING * length) this.vectors(host, "Position, inertial axes", "m", places, length);
    const momenta = this.each((k) => nth(body.linear_momentum, k));
    this.vectors(host, "Linear momentum, inertial axes", "kg m/s", momenta, (body.mass * length) / duration);
    plots.seek(plots.time);
  }

  showAttitude(host, body) {
    const { flight, plots } = this;
    const first = body.attitude.slice(0, 4);
    if (body.attitude.every((component, i) => Math.abs(component - first[i % 4]) < 1e-9)) return;
    const kinds = [["euler", "Euler angles"], ["quaternion", "quaternion"]];
    const chosen = kinds.findIndex(([kind]) => kind === this.angles);
    let curves;
    let [title, unit] = ["Attitude: yaw about z, pitch about y, roll about x", "°"];
    if (this.angles === "euler") {
      const angles = this.each((k) => euler(body.attitude.slice(4 * k, 4 * k + 4)));
      const each = ["yaw", "pitch", "roll"].map((_, i) => angles.map((all) => all[i]));
      const isFast = each.some((angles) => rounds(angles).length > ROUNDS);
      if (isFast) title += ", turns counted";
      curves = ["yaw", "pitch", "roll"].map((label, i) => ({ label, values: isFast ? countedOn(each[i]) : each[i], breaks: isFast ? [] : rounds(each[i]), color: LINE_COLORS[2 - i] }));
    } else {
      [title, unit] = ["Attitude: quaternion, body to inertial axes", "1"];
      curves = ["w", ...COMPONENTS].map((label, i) => ({ label, values: this.each((k) => body.attitude[4 * k + i]), color: i === 0 ? INK : LINE_COLORS[i - 1] }));
    }
    const { element } = plots.add(host, { title, unit, time: flight.time, curves });
    const choice = this.choice("as", kinds.map(([, name]) => name), chosen, (index) => {
      this.angles = kinds[index][0];
      this.showBody();
    });
    element.querySelector("h3").append(choice);
  }

  showControls(host) {
    const { flight, plots } = this;
    const controls = flight.controls.find((controls) => controls.body === this.body);
    if (!controls) return;
    const count = controls.time.length - 1;
    let shown = false;
    for (const [kind, title, unit] of [["force", "Control force, inertial axes", "N"], ["moment", "Control moment, body axes", "N m"]]) {
      const vectors = Array.from({ length: count + 1 }, (_, k) => nth(controls[kind], Math.min(k, count - 1)));
      if (!(most(vectors.map(norm)) > 1e-12 * flight.largest(kind))) continue;
      const curves = COMPONENTS.map((label, i) => ({ label, values: vectors.map((vector) => vector[i]) }));
      const limits = this.planned()?.limits.filter((limit) => limit.of === kind) ?? [];
      const constant = (label, value) => curves.push({ label, values: vectors.map(() => value), color: "#d00", dashed: true });
      for (const limit of limits) {
        if (limit.kind === "norm" && limit.limit !== null) {
          curves.push({ label: "magnitude", values: vectors.map(norm), color: INK });
          constant(boundName(limit.soft), limit.limit);
        }
        const finite = limit.kind === "components" ? [...new Set(limit.limits.filter((value) => value !== null))] : [];
        for (const value of finite) {
          constant(boundName(limit.soft), value);
          constant(`−${boundName(limit.soft)}`, -value);
        }
      }
      plots.add(host, { title, unit, time: controls.time, curves, stepped: true });
      shown = true;
    }
    const notes = [];
    if (shown && controls.inexact) notes.push("Controls are those of the flown plans, without the corrections of feedback and the errors of actuators.");
    if (shown && controls.thinned) notes.push("Only some of the intervals of the controls are shown, evenly chosen.");
    if (notes.length > 0) host.append(note(notes.join(" ")));
  }

  /** What the body goes to and keeps to, if it is planned. */
  planned() {
    return this.flight.planned.find(({ body }) => body === this.body);
  }

  /** How near the body comes to what it keeps to. */
  showLimits(host) {
    const { flight, plots } = this;
    for (const { plot, soft } of this.planned().limits) {
      if (!plot) continue;
      const bound = { label: boundName(soft), values: this.each(() => plot.bound), color: "#d00", dashed: true };
      const curves = [{ label: "value", values: plot.values, color: INK }, bound];
      const title = `${plot.title}, ${plot.least ? "at least" : "at most"} the ${boundName(soft)}`;
      plots.add(host, { title, unit: plot.unit || "1", time: flight.time, curves });
    }
  }

  showPair() {
    const { flight, plots } = this;
    const host = this.sections.pair;
    plots.clear(host);
    const [from, of] = this.pair.map((index) => flight.bodies[index]);
    if (from === of) {
      host.append(note("Choose two different bodies."));
      return;
    }
    const turned = (k, vector) => rotate(conjugate(flight.pose({ kind: this.axes, body: from.index }, { k, part: 0 }).turn), vector);
    const apart = this.each((k) => turned(k, minus(nth(of.position, k), nth(from.position, k))));
    const axes = { centered: "inertial axes", fixed: `axes of ${from.name}`, orbital: `radial (x), transverse (y), normal (z) axes of ${from.name}` }[this.axes];
    const distance = { label: "distance", values: apart.map(norm), color: INK };
    this.vectors(host, `Position of ${of.name} relative to ${from.name}, ${axes}`, "m", apart, this.length, [distance]);
    const velocity = (body, k) => (body.velocity ? nth(body.velocity, k) : times(nth(body.linear_momentum, k), 1 / body.mass));
    const speeds = this.each((k) => turned(k, minus(velocity(of, k), velocity(from, k))));
    const speed = { label: "speed", values: speeds.map(norm), color: INK };
    this.vectors(host, `Velocity difference, ${axes}`, "m/s", speeds, this.length / this.duration, [speed]);
    const attitudes = this.each((k) => compose(conjugate(from.attitude.slice(4 * k, 4 * k + 4)), of.attitude.slice(4 * k, 4 * k + 4)));
    const turns = attitudes.map(([w, x, y, z]) => (360 / Math.PI) * Math.atan2(Math.hypot(x, y, z), Math.abs(w)));
    const curves = [{ label: "angle", values: turns, color: INK }];
    plots.add(host, { title: `Angle of the turn from the axes of ${from.name} to those of ${of.name}`, unit: "°", time: flight.time, curves });
    plots.seek(plots.time);
  }

  showAll() {
    const { flight, plots } = this;
    const host = this.sections.all;
    const { energy, time } = flight;
    const named = [["translation", LINE_COLORS[2]], ["rotation", LINE_COLORS[0]], ["potential", LINE_COLORS[1]], ["total", INK]];
    const parts = named.filter(([key]) => energy[key].some((value) => value !== 0));
    if (parts.length > 0) {
      const largest = most(parts.map(([key]) => most(energy[key].map(Math.abs))));
      const fromStart = (key) => energy[key].map((value) => value - energy[key][0]);
      const changes = most(parts.map(([key]) => most(fromStart(key).map(Math.abs))));
      // Curves that are far larger than all of their changes would look constant.
      const isChange = changes > NOTHING * largest && changes < 0.2 * largest;
      const curves = parts.map(([label, color]) => ({ label, values: isChange ? fromStart(label) : energy[label], color }));
      plots.add(host, { title: isChange ? "Energy, change from the start" : "Energy", unit: "J", time, curves });
    }
    const change = this.each((k) => energy.total[k] - energy.total[0]);
    const scale = most([0, ...parts.map(([key]) => most(energy[key].map(Math.abs)))]);
    if (change.some((value) => value !== 0)) {
      const title = `Change of the total energy from its start (largest energy ${short(scale)} J)`;
      plots.add(host, { title, unit: "J", time, curves: [{ label: "E − E₀", values: change, color: INK }] });
    }
    const { attractor, gravity } = flight.scenery;
    // What one body has alone is in its own plot already, unless nothing should change it.
    const isPushed = attractor || gravity || flight.controls.length > 0;
    for (const [key, title, unit] of [["linear_momentum", "linear momentum", "kg m/s"], ["angular_momentum", "angular momentum about the origin", "kg m²/s"]]) {
      const start = nth(flight[key], 0);
      const changes = this.each((k) => minus(nth(flight[key], k), start));
      const isShown = key === "angular_momentum" || !isPushed || flight.bodies.length > 1;
      if (isShown && changes.some((vector) => norm(vector) > 0)) {
        const largest = most(this.each((k) => norm(nth(flight[key], k))));
        const curves = COMPONENTS.map((label, i) => ({ label, values: changes.map((vector) => vector[i]) }));
        plots.add(host, { title: `Change of the total ${title} from its start (largest ${short(largest)} ${unit})`, unit, time, curves });
      }
    }
  }
}

/** A violation of a soft limit has a price. */
function boundName(soft) {
  return soft ? "soft limit" : "limit";
}

/** Indices of the angles (°) before which they go round. */
function rounds(angles) {
  return even(angles.length, Infinity).filter((k) => k > 0 && Math.abs(angles[k] - angles[k - 1]) > 180);
}

/** Angles (°) that go on beyond 180° instead of going round. */
function countedOn(angles) {
  let turns = 0;
  return angles.map((angle, k) => {
    if (k > 0 && Math.abs(angle - angles[k - 1]) > 180) turns += angle < angles[k - 1] ? 360 : -360;
    return angle + turns;
  });
}

function note(text) {
  const paragraph = document.createElement("p");
  paragraph.className = "note";
  paragraph.textContent = text;
  return paragraph;
}
