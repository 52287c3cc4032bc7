// The ways of the bodies, and the thrust along them.

/** Thrusts that are drawn along a way. */
const THRUSTS = 48;
/** The length of trail behind a body that is bright, of the diagonal of all of it. */
const RECENT = 2;

class Trails {
  constructor(flight) {
    Object.assign(this, { flight, group: new Group(), recent: [], places: new Map() });
  }

  /** All of them, as seen from a frame; those of the bodies in `listed` are drawn. */
  build(frame, listed) {
    for (const child of [...this.group.children]) {
      child.geometry.dispose();
      this.group.remove(child);
    }
    this.recent = [];
    const { flight } = this;
    const all = even(flight.time.length, Infinity);
    const poses = all.map((k) => flight.pose(frame, { k, part: 0 }));
    const inView = ({ origin, turn }, place) => rotate(conjugate(turn), minus(place, origin));
    this.places = new Map();
    for (const body of flight.bodies) {
      const isListed = listed.has(body.index);
      const places = (isListed ? all : even(all.length, 2)).map((k) => inView(poses[k], flight.center(body, { k, part: 0 })));
      this.places.set(body.index, places);
      if (isListed && diagonal(places) > 0) this.add(body, places);
    }
    const size = diagonal([...this.places.values()].flat());
    const largest = flight.largest("force");
    for (const controls of flight.controls) {
      if (largest === 0 || !listed.has(controls.body)) continue;
      const body = flight.bodies[controls.body];
      const points = even(flight.time.length, THRUSTS).flatMap((k) => {
        const load = flight.load(controls.body, flight.time[k]);
        if (!load || norm(load.force) < 0.01 * largest) return [];
        const pose = poses[k];
        const from = inView(pose, nth(body.position, k));
        return [from, plus(from, rotate(conjugate(pose.turn), load.force), (0.12 * size) / largest)];
      });
      if (points.length > 0) this.group.add(segments(points, COLORS.force, { transparent: true, opacity: 0.45 }));
    }
  }

  /** The whole way, faint, and on it the way that lies shortly behind. */
  add(body, places) {
    const lengths = new Float64Array(places.length);
    for (let k = 1; k < places.length; k++) lengths[k] = lengths[k - 1] + norm(minus(places[k], places[k - 1]));
    const length = RECENT * diagonal(places);
    // The more often it goes round, the fainter.
    const opacity = Math.max(0.05, Math.min(0.3, (1.2 * length) / lengths[places.length - 1]));
    const whole = line(places, bodyColor(body.index), { transparent: true, opacity });
    const recent = line(places, bodyColor(body.index));
    this.group.add(whole, recent);
    this.recent.push({ trail: recent, lengths, length });
  }

  /** Lights up what lies shortly behind at the `reached`-th state. */
  show(reached) {
    for (const { trail, lengths, length } of this.recent) {
      const from = lastAtOrBefore(lengths, lengths[reached] - length);
      trail.geometry.setDrawRange(from, reached - from + 1);
    }
  }
}
