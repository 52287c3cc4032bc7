// The flight: states at the recorded times, and between them.

/** Bodies are near each other within this part of the way that they go together. */
const NEAR = 0.01;

class Flight {
  constructor(data) {
    Object.assign(this, data);
    this.time = unpack(data.time);
    this.start = this.time[0];
    this.end = this.time[this.time.length - 1];
    this.bodies = data.bodies.map((motion, index) => {
      const body = { index, ...data.scenery.bodies[index] };
      for (const key of Object.keys(motion)) body[key] = unpack(motion[key]);
      return body;
    });
    this.energy = Object.fromEntries(Object.entries(data.energy).map(([key, values]) => [key, unpack(values)]));
    this.linear_momentum = unpack(data.linear_momentum);
    this.angular_momentum = unpack(data.angular_momentum);
    this.controls = data.controls.map((controls) => {
      const unpacked = { ...controls };
      for (const key of ["time", "force", "moment"]) unpacked[key] = unpack(controls[key]);
      return unpacked;
    });
    this.maneuver = data.scenery.maneuver;
    this.planned = this.maneuver ? [this.maneuver, ...this.maneuver.companions] : [];
    for (const limit of this.planned.flatMap((planned) => planned.limits)) {
      if (limit.plot) limit.plot.values = unpack(limit.plot.values);
      if (limit.frame) limit.frame = { position: unpack(limit.frame.position), attitude: unpack(limit.frame.attitude) };
    }
  }

  /** The last recorded state at or before `t`, and how much of the time to the next has passed. */
  at(t) {
    const k = lastAtOrBefore(this.time, t);
    const span = this.time[k + 1] - this.time[k];
    return { k, part: span > 0 ? (t - this.time[k]) / span : 0 };
  }

  /** Position of a body (m), inertial frame: straight from one state to the next. */
  position(body, { k, part }) {
    const here = nth(body.position, k);
    return part === 0 ? here : plus(here, minus(nth(body.position, k + 1), here), part);
  }

  /** A body or frame at a moment: `origin` (m), inertial frame, and `turn` to it; that of the inertial frame for `null`. */
  poseOf(frame, moment) {
    return frame ? { origin: this.position(frame, moment), turn: this.attitude(frame, moment) } : { origin: [0, 0, 0], turn: [1, 0, 0, 0] };
  }

  /** Where a body is seen to be (m), inertial frame: the center of one that turns about a pivot. */
  center(body, moment) {
    const position = this.position(body, moment);
    return body.is_pivoted && body.shape.center ? plus(position, rotate(this.attitude(body, moment), body.shape.center)) : position;
  }

  /** Body to inertial: the great circle from one state to the next. */
  attitude(body, { k, part }) {
    const here = body.attitude.slice(4 * k, 4 * k + 4);
    if (part === 0) return [...here];
    const next = body.attitude.slice(4 * k + 4, 4 * k + 8);
    const cosine = here.reduce((sum, component, i) => sum + component * next[i], 0);
    const angle = Math.acos(Math.min(1, Math.max(-1, cosine)));
    const sine = Math.sin(angle);
    const [a, b] = sine < 1e-6 ? [1 - part, part] : [Math.sin((1 - part) * angle) / sine, Math.sin(part * angle) / sine];
    const mixed = [...here].map((component, i) => a * component + b * next[i]);
    const length = Math.hypot(...mixed);
    return mixed.map((component) => component / length);
  }

  /** Angular velocity (rad/s), body frame. */
  angularVelocity(body, k) {
    if (body.angular_velocity) return nth(body.angular_velocity, k);
    const momentum = nth(body.angular_momentum, k);
    return [0, 1, 2].map((row) => dot(body.inverse_inertia.slice(3 * row, 3 * row + 3), momentum));
  }

  /** Control force (N, inertial frame) and moment (N m, body frame) on a body at `t`. */
  load(index, t) {
    const controls = this.controls.find((controls) => controls.body === index);
    if (!controls || t >= this.end && t > controls.time[controls.time.length - 1]) return null;
    const k = Math.min(lastAtOrBefore(controls.time, t), controls.time.length - 2);
    return { force: nth(controls.force, k), moment: nth(controls.moment, k) };
  }

  /** The largest control force (N) or moment (N m). */
  largest(kind) {
    let largest = 0;
    for (const controls of this.controls) {
      for (let k = 0; k < controls.time.length - 1; k++) largest = Math.max(largest, norm(nth(controls[kind], k)));
    }
    return largest;
  }

  /**
   * Where the view frame is: `kind` is inertial, centered (on a body, inertial axes), fixed (to a body's axes) or orbital (on a
   * body; radial, transverse and normal axes of its orbit).
   */
  pose({ kind, body }, moment) {
    if (kind === "inertial") return this.poseOf(null, moment);
    const pose = this.poseOf(this.bodies[body], moment);
    if (kind === "centered") pose.turn = [1, 0, 0, 0];
    if (kind === "orbital") pose.turn = this.orbitalAxes(this.bodies[body], moment);
    return pose;
  }

  /** From the radial, transverse and normal axes of a body's orbit to the inertial frame. */
  orbitalAxes(body, moment) {
    const momentum = { position: body.linear_momentum };
    const outwards = unit(minus(this.position(body, moment), this.scenery.attractor.position));
    const normal = unit(cross(outwards, this.position(momentum, moment)));
    return norm(normal) > 0.5 ? fromAxes(outwards, cross(normal, outwards), normal) : [1, 0, 0, 0];
  }

  /** The frame in which the motion is seen best: that of the most massive body, if the others stay near it on a long way. */
  bestFrame() {
    const body = heaviestOf(this.bodies);
    const center = this.bodies[body];
    const instants = even(this.time.length, 200);
    const way = diagonal(instants.map((k) => nth(center.position, k)));
    const apart = most([0, ...this.bodies.flatMap((other) => instants.map((k) => norm(minus(nth(other.position, k), nth(center.position, k)))))]);
    if (this.bodies.length < 2 || apart > NEAR * way) return { kind: "inertial" };
    return { kind: this.scenery.attractor ? "orbital" : "centered", body };
  }
}

/** Index of the body of the largest mass. */
function heaviestOf(bodies) {
  return bodies.reduce((best, body) => (body.mass > best.mass ? body : best)).index;
}

/** Index of the last of ascending numbers that is at most `value`, or 0. */
function lastAtOrBefore(numbers, value) {
  let [low, high] = [0, numbers.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (numbers[middle] <= value) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** At most `limit` indices below `length`, evenly spaced, the first and the last among them. */
function even(length, limit) {
  const count = Math.min(length, limit);
  return Array.from({ length: count }, (_, i) => (count < length ? Math.floor((i * (length - 1)) / (count - 1)) : i));
}
