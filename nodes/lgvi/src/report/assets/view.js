// The motion in space, seen from a frame that may move with a body.

const { AmbientLight, DirectionalLight, PerspectiveCamera, Scene, WebGLRenderer, OrbitControls } = libraries;

/** Bodies are at least this large (px); of many, or without a trail, less. */
const LEAST_PIXELS = { few: 11, many: 3.5 };
const MANY = 8;
const FIELD_OF_VIEW = 40;
const THRUSTS = 48;
/** The length of trail behind a body that is bright, of the diagonal of all of it. */
const RECENT = 2;
/** Length of the strongest load's arrow, of the picture's radius. */
const STRONGEST = 0.4;

class View {
  /** `listed` is the set of bodies with trail and name. */
  constructor(host, flight, listed) {
    Object.assign(this, { host, flight, listed, frame: { kind: "inertial" }, focus: null, time: flight.start });
    Object.assign(this, { trueSize: false, withAxes: true, withLabels: true, orbits: [], surrounds: [], recent: [], reach: 0, width: 1, height: 1 });
    this.renderer = new WebGLRenderer({ antialias: true });
    this.renderer.setClearColor("#10151f");
    host.prepend(this.renderer.domElement);
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.002, 200);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 60;
    this.watchControls();
    this.sceneRoot = new Scene();
    const light = new DirectionalLight("#fff", 2.6);
    light.position.set(0.9, 1.2, 1);
    this.camera.add(light);
    this.sceneRoot.add(new AmbientLight("#fff", 1), this.camera);
    // Lengths below the root are in meters; the root makes what is looked at of size 1.
    this.root = new Group();
    this.sceneRoot.add(this.root);
    this.largest = { force: flight.largest("force"), moment: flight.largest("moment") };
    this.build();
  }

  watchControls() {
    this.controls.addEventListener("change", () => (this.stale = true));
    this.controls.addEventListener("start", () => (this.isFitted = false));
  }

  /** What is there whatever it is seen from. */
  build() {
    const { flight } = this;
    const { scenery, maneuver } = flight;
    this.inertial = new Group();
    this.trails = new Group();
    this.triad = axes();
    this.root.add(this.inertial, this.trails);
    this.camera.add(this.triad);
    this.triad.traverse((part) => part.material && Object.assign(part.material, { depthTest: false }));
    this.bodies = flight.bodies.map((body) => {
      const group = new Group();
      const own = axes();
      own.scale.setScalar(1.5 * body.extent);
      const look = solid(body.shape, bodyColor(body.index));
      group.add(look, own);
      if (body.is_pivoted) group.add(...pivot(body));
      this.root.add(group);
      return { body, group, look, own, frames: [] };
    });
    if (scenery.attractor) {
      this.attractor = globe(scenery.attractor);
      this.attractor.position.copy(toVector(scenery.attractor.position));
      this.inertial.add(this.attractor);
    }
    this.frames = scenery.frames.map((frame) => this.addFrame(frame)).filter(Boolean);
    this.arrows = flight.controls.map((controls) => {
      const arrows = { body: controls.body, force: arrow(COLORS.force), moment: arrow(COLORS.moment) };
      this.root.add(arrows.force, arrows.moment);
      return arrows;
    });
    if (maneuver) this.buildManeuver(maneuver);
  }

  addFrame(frame) {
    const group = axes();
    const holder = new Group();
    const parent = this.frameHolders?.get(frame.parent) ?? this.bodies.find(({ body }) => body.frame === frame.parent)?.group
      ?? (frame.parent === this.flight.scenery.frame ? this.inertial : null);
    if (!parent) return null;
    holder.position.copy(toVector(frame.position));
    holder.quaternion.copy(toQuaternion(frame.attitude));
    holder.add(group);
    parent.add(holder);
    this.frameHolders = (this.frameHolders ?? new Map()).set(frame.name, holder);
    const body = this.bodies.find((body) => body.group === parent || body.frames.includes(frame.parent));
    body?.frames.push(frame.name);
    return { ...frame, holder, group, body: body?.body };
  }

  buildManeuver(goal) {
    const { flight } = this;
    const body = flight.bodies[goal.body];
    const places = even(flight.time.length, 200).map((k) => nth(body.position, k));
    const span = diagonal(places);
    // As long as the markers of the planner are.
    const size = Math.max(span, 4 * body.extent);
    const list = (packed) => {
      const values = unpack(packed);
      return even(values.length / 3, Infinity).map((k) => nth(values, k));
    };
    for (const [packed, color] of [[goal.initial_orbit, COLORS.initial], [goal.target_orbit, COLORS.target]]) {
      if (!packed) continue;
      const places = list(packed);
      this.orbits.push(...places);
      this.inertial.add(color === COLORS.target ? dashedLine(places, color, 0.02 * size) : line(places, color));
    }
    const origin = goal.position ?? places[places.length - 1];
    if (goal.position || goal.attitude) {
      this.target = new Group();
      this.target.add(ghost(body.shape));
      if (goal.attitude) {
        const own = axes();
        own.scale.setScalar(1.5 * body.extent);
        this.target.add(own);
        this.target.quaternion.copy(toQuaternion(goal.attitude));
      }
      this.target.position.copy(toVector(origin));
      this.target.userData = { origin, extent: body.extent };
      this.inertial.add(this.target);
    }
    if (goal.spin_direction) {
      const spin = arrow(COLORS.target);
      point(spin, origin, goal.spin_direction, Math.max(0.1 * size, 1.5 * body.extent));
      this.inertial.add(spin);
    }
    // Cones of directions move with the body.
    this.cones = [];
    for (const limit of goal.limits) {
      if (limit.kind === "keep_out_sphere") {
        this.inertial.add(keepOutSphere(limit.center, limit.radius));
        this.surrounds.push(...aroundSphere(limit.center, limit.radius));
      }
      if (limit.kind === "corridor") {
        const reach = Math.max(...places.map((place) => norm(minus(place, limit.apex))));
        const corridor = cone(limit.apex, limit.axis, limit.half_angle, reach, COLORS.corridor);
        this.inertial.add(corridor);
        this.surrounds.push(...corridor.userData.rim.map((place) => plus(place, limit.apex)));
      }
      if (limit.kind === "keep_out_cone") {
        const reach = 0.5 * size;
        this.reach = Math.max(this.reach, reach);
        const holder = new Group();
        holder.add(cone([0, 0, 0], unit(limit.direction), limit.half_angle, reach, COLORS.forbidden));
        const path = even(flight.time.length, 600).map((k) => times(rotate(flight.attitude(body, { k, part: 0 }), unit(limit.axis)), reach));
        holder.add(line(path, bodyColor(body.index)));
        const now = line([[0, 0, 0], times(unit(limit.axis), reach)], "#ffffff");
        holder.add(now);
        this.inertial.add(holder);
        this.cones.push({ holder, now, body });
      }
    }
  }

  /** Looks from another frame. */
  setFrame(frame) {
    this.frame = frame;
    this.buildTrails();
    this.fit();
  }

  /** Trails, and thrust along them, as seen from the frame. */
  buildTrails() {
    for (const child of [...this.trails.children]) {
      child.geometry.dispose();
      this.trails.remove(child);
    }
    this.recent = [];
    const { flight, frame } = this;
    const all = even(flight.time.length, Infinity);
    const poses = all.map((k) => flight.pose(frame, { k, part: 0 }));
    const inView = ({ origin, turn }, place) => rotate(conjugate(turn), minus(place, origin));
    this.places = new Map();
    for (const body of flight.bodies) {
      const isListed = this.listed.has(body.index);
      const places = (isListed ? all : even(all.length, 2)).map((k) => inView(poses[k], flight.center(body, { k, part: 0 })));
      this.places.set(body.index, places);
      if (isListed && diagonal(places) > 0) this.addTrail(body, places);
    }
    const size = diagonal([...this.places.values()].flat());
    for (const controls of flight.controls) {
      if (this.largest.force === 0 || !this.listed.has(controls.body)) continue;
      const body = flight.bodies[controls.body];
      const points = even(flight.time.length, THRUSTS).flatMap((k) => {
        const load = flight.load(controls.body, flight.time[k]);
        if (!load || norm(load.force) < 0.01 * this.largest.force) return [];
        const pose = poses[k];
        const from = inView(pose, nth(body.position, k));
        return [from, plus(from, rotate(conjugate(pose.turn), load.force), (0.12 * size) / this.largest.force)];
      });
      if (points.length > 0) this.trails.add(segments(points, COLORS.force, { transparent: true, opacity: 0.45 }));
    }
  }

  /** The whole way, faint, and on it the way that lies shortly behind. */
  addTrail(body, places) {
    const lengths = new Float64Array(places.length);
    for (let k = 1; k < places.length; k++) lengths[k] = lengths[k - 1] + norm(minus(places[k], places[k - 1]));
    const length = RECENT * diagonal(places);
    // The more often it goes round, the fainter.
    const opacity = Math.max(0.05, Math.min(0.3, (1.2 * length) / lengths[places.length - 1]));
    const whole = line(places, bodyColor(body.index), { transparent: true, opacity });
    const recent = line(places, bodyColor(body.index));
    this.trails.add(whole, recent);
    this.recent.push({ trail: recent, lengths, length });
  }

  /** Looks at everything that moves, or at the body in focus, from where it is seen best. */
  fit() {
    const { flight, focus } = this;
    const moment = flight.at(this.time);
    let points;
    let around = 0;
    if (focus !== null) {
      points = [this.placeNow(flight.bodies[focus], moment)];
      around = 2.6 * flight.bodies[focus].extent;
    } else {
      points = [...this.places.values()].flat();
      if (this.frame.kind === "inertial") {
        if (flight.scenery.attractor) points.push(...aroundSphere(flight.scenery.attractor.position, flight.scenery.attractor.radius));
        points.push(...this.surrounds);
        if (flight.maneuver?.position) points.push(flight.maneuver.position);
        const [low, high] = box(points);
        const near = (place) => place.every((x, i) => x >= low[i] - 0.6 * diagonal(points) && x <= high[i] + 0.6 * diagonal(points));
        if (this.orbits.every(near)) points.push(...this.orbits);
      } else {
        points.push([0, 0, 0]);
      }
      const span = diagonal(points);
      const largest = Math.max(...flight.bodies.filter((body) => this.listed.has(body.index)).map((body) => body.extent), 0);
      around = Math.max(span > 0 ? largest : 1.55 * largest, this.reach);
    }
    const up = flight.scenery.gravity ? unit(times(flight.scenery.gravity, -1)) : [0, 0, 1];
    this.direction = focus !== null && this.direction ? this.direction : bestDirection([...this.places.values()], up);
    this.frameAll(points, around, up);
    // OrbitControls takes the upright direction when it is made.
    this.controls.dispose();
    const { target, minDistance, maxDistance } = this.controls;
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    Object.assign(this.controls, { minDistance, maxDistance });
    this.controls.target.copy(target);
    this.watchControls();
    this.controls.update();
    this.isFitted = true;
    this.followed = null;
    this.stale = true;
  }

  /** Puts the camera so near that spheres of radius `around` (m) about all points are just seen. */
  frameAll(points, around, up) {
    const towards = this.direction;
    const side = unit(cross(up, towards));
    const top = cross(towards, side);
    const seen = points.map((place) => [dot(place, side), dot(place, top), dot(place, towards)]);
    const [low, high] = box(seen);
    const middle = times(plus(low, high), 0.5);
    const radius = Math.max(...seen.map((place) => norm(minus(place, middle)))) + around || 1;
    const tangent = Math.tan((Math.PI / 360) * FIELD_OF_VIEW);
    const tangents = [tangent * this.camera.aspect, tangent];
    const margin = 1.12;
    const distance = Math.max(...seen.map((place) => {
      const arm = minus(place, middle);
      return Math.max(...tangents.map((tangent, i) => arm[2] + (margin * (Math.abs(arm[i]) + around * Math.hypot(1, tangent))) / tangent));
    }));
    this.radius = radius;
    this.root.scale.setScalar(1 / radius);
    this.root.updateMatrixWorld(true);
    this.camera.up.copy(toVector(up));
    const center = plus(plus(times(side, middle[0]), top, middle[1]), towards, middle[2]);
    this.controls.target.copy(toVector(times(center, 1 / radius)));
    this.camera.position.copy(this.controls.target).addScaledVector(toVector(towards), distance / radius);
  }

  resize() {
    const { clientWidth, clientHeight } = this.host;
    Object.assign(this, { width: Math.max(clientWidth, 1), height: Math.max(clientHeight, 1) });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(this.width, this.height);
    this.camera.aspect = this.width / this.height;
    this.camera.updateProjectionMatrix();
    this.stale = true;
    if (this.isFitted) this.fit();
  }

  /** Position of a body in the frame (m). */
  placeNow(body, moment) {
    const { origin, turn } = this.flight.pose(this.frame, moment);
    return rotate(conjugate(turn), minus(this.flight.position(body, moment), origin));
  }

  /** Pixels of a length of 1 m at a place in the frame. */
  pixels(place) {
    const world = this.root.localToWorld(toVector(place));
    const distance = Math.max(this.camera.position.distanceTo(world), 1e-9);
    return (this.root.scale.x * this.height) / (2 * Math.tan((Math.PI / 360) * FIELD_OF_VIEW) * distance);
  }

  /** By how much something of an extent (m) is drawn larger so that it is seen. */
  enlarged(extent, place, least) {
    if (this.trueSize) return 1;
    return Math.max(1, least / Math.max(extent * this.pixels(place), 1e-30));
  }

  /** Puts everything where it is at the time, and draws. */
  draw() {
    const { flight, frame } = this;
    const moment = flight.at(this.time);
    const { origin, turn } = flight.pose(frame, moment);
    const back = conjugate(turn);
    this.inertial.quaternion.copy(toQuaternion(back));
    this.inertial.position.copy(toVector(rotate(back, times(origin, -1))));
    this.triad.visible = this.withAxes;
    const reached = lastAtOrBefore(flight.time, this.time);
    for (const { trail, lengths, length } of this.recent) {
      const from = lastAtOrBefore(lengths, lengths[reached] - length);
      trail.geometry.setDrawRange(from, reached - from + 1);
    }
    for (const item of this.bodies) {
      const { body, group, look, own } = item;
      const listed = this.listed.has(body.index);
      const place = rotate(back, minus(flight.position(body, moment), origin));
      group.position.copy(toVector(place));
      group.quaternion.copy(toQuaternion(compose(back, flight.attitude(body, moment))));
      const least = listed && this.bodies.length <= MANY ? LEAST_PIXELS.few : listed ? 7 : LEAST_PIXELS.many;
      item.factor = this.enlarged(body.extent, place, least);
      group.scale.setScalar(item.factor);
      item.place = place;
      if (body.index === this.focus) this.follow(place);
      own.visible = this.withAxes && listed && (body.extent * item.factor * this.pixels(place) > 9);
      look.traverse((part) => part.material?.color.set(listed ? bodyColor(body.index) : COLORS.other));
    }
    for (const { group, body, holder } of this.frames) {
      group.visible = this.withAxes;
      const length = body ? 0.5 * body.extent : 0.06 * this.radius;
      group.scale.setScalar(length);
      holder.visible = this.withAxes;
    }
    if (this.attractor) {
      const { radius, position } = flight.scenery.attractor;
      const place = rotate(back, minus(position, origin));
      this.attractor.scale.setScalar(radius > 0 ? this.enlarged(radius, place, 5) : 6 / this.pixels(place));
    }
    if (this.target) {
      const { origin: at, extent } = this.target.userData;
      const place = rotate(back, minus(at, origin));
      this.target.scale.setScalar(this.enlarged(extent, place, LEAST_PIXELS.few));
    }
    for (const { holder, now, body } of this.cones ?? []) {
      holder.position.copy(toVector(flight.position(body, moment)));
      now.quaternion.copy(toQuaternion(flight.attitude(body, moment)));
    }
    for (const arrows of this.arrows) {
      const load = flight.load(arrows.body, this.time);
      const { place, body } = this.bodies[arrows.body];
      const attitude = flight.attitude(body, moment);
      const vectors = { force: load?.force ?? [0, 0, 0], moment: rotate(attitude, load?.moment ?? [0, 0, 0]) };
      for (const kind of ["force", "moment"]) {
        const share = this.largest[kind] > 0 ? norm(vectors[kind]) / this.largest[kind] : 0;
        point(arrows[kind], place, rotate(back, vectors[kind]), share < 0.01 ? 0 : STRONGEST * this.radius * share);
      }
    }
    this.placeTriad();
    this.renderer.render(this.sceneRoot, this.camera);
    this.placeMarks();
    this.stale = false;
  }

  /** Takes the camera along with the body in focus. */
  follow(place) {
    const here = this.root.localToWorld(toVector(place));
    if (this.followed) {
      const shift = here.clone().sub(this.followed);
      this.controls.target.add(shift);
      this.camera.position.add(shift);
      this.camera.updateMatrixWorld();
    }
    this.followed = here;
  }

  /** The axes of the frame in the lower left corner. */
  placeTriad() {
    const tangent = Math.tan((Math.PI / 360) * FIELD_OF_VIEW);
    const pixel = (2 * tangent) / this.height;
    this.triad.position.set(-tangent * this.camera.aspect + 62 * pixel, -tangent + 62 * pixel, -1);
    this.triad.scale.setScalar(38 * pixel);
    // As it would look in the middle of the picture.
    this.triad.quaternion.setFromUnitVectors(new Vector3(0, 0, -1), this.triad.position.clone().normalize());
    this.triad.quaternion.multiply(this.camera.quaternion.clone().invert());
    this.sceneRoot.updateMatrixWorld(true);
  }

  /** Names beside what they name, none over another. */
  placeMarks() {
    const marks = this.host.querySelector("#marks");
    const taken = [];
    const texts = [];
    const add = (world, text, kind = "") => {
      const seen = world.project(this.camera);
      if (Math.abs(seen.z) > 1) return;
      const x = (0.5 + 0.5 * seen.x) * this.width;
      const y = (0.5 - 0.5 * seen.y) * this.height;
      const size = [text.length * 6.6 + 4, 15];
      const places = [[8, -18], [8, 4], [-size[0] - 8, -18], [-size[0] - 8, 4]].map(([right, down]) => [x + right, y + down]);
      const free = places.find(([left, top]) => left > 0 && top > 0 && left + size[0] < this.width && top + size[1] < this.height
        && taken.every((other) => left > other[2] || left + size[0] < other[0] || top > other[3] || top + size[1] < other[1]));
      if (!free) return;
      taken.push([free[0], free[1], free[0] + size[0], free[1] + size[1]]);
      texts.push({ text, kind, x: free[0], y: free[1] });
    };
    if (this.withLabels) {
      for (const { body, place, factor } of this.bodies) {
        if (!this.listed.has(body.index)) continue;
        const enlarged = factor > 1.05 ? ` ×${factorText(factor)}` : "";
        add(this.root.localToWorld(toVector(place)), body.name + enlarged, this.isHidden(place) ? "hidden" : "");
      }
      if (this.withAxes) {
        for (const { name, holder } of this.frames) add(holder.getWorldPosition(new Vector3()), name, "frame");
      }
    }
    if (this.withAxes) {
      for (const [axis, name] of ["x", "y", "z"].entries()) {
        const tip = [0, 0, 0];
        tip[axis] = 1.2;
        const world = this.triad.localToWorld(toVector(tip));
        const seen = world.project(this.camera);
        if (Math.abs(seen.z) < 1) texts.push({ text: name, kind: "frame", x: (0.5 + 0.5 * seen.x) * this.width - 3, y: (0.5 - 0.5 * seen.y) * this.height - 9 });
      }
    }
    while (marks.children.length < texts.length) marks.append(document.createElement("span"));
    [...marks.children].forEach((span, i) => {
      const mark = texts[i];
      span.hidden = !mark;
      if (!mark) return;
      if (span.textContent !== mark.text) span.textContent = mark.text;
      span.className = mark.kind;
      span.style.transform = `translate(${mark.x.toFixed(1)}px, ${mark.y.toFixed(1)}px)`;
    });
    this.drawBar();
  }

  /** Whether the attractor is before a place in the frame. */
  isHidden(place) {
    const attractor = this.flight.scenery.attractor;
    if (!attractor?.radius) return false;
    const center = this.attractor.getWorldPosition(new Vector3()).sub(this.camera.position);
    const arm = this.root.localToWorld(toVector(place)).sub(this.camera.position);
    const along = arm.clone().normalize();
    const nearest = center.dot(along);
    return nearest > 0 && nearest < arm.length() && center.addScaledVector(along, -nearest).length() < attractor.radius * this.root.scale.x;
  }

  /** A round length in the plane of what is looked at. */
  drawBar() {
    const pixels = this.pixels(this.root.worldToLocal(this.controls.target.clone()).toArray());
    const wanted = 110 / pixels;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].map((digit) => digit * power).find((length) => length <= wanted) ?? power;
    const bar = this.host.querySelector("#bar");
    bar.style.width = `${(length * pixels).toFixed(1)}px`;
    bar.firstElementChild.textContent = lengthText(length);
  }
}

function box(points) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const place of points) {
    for (let i = 0; i < 3; i++) {
      low[i] = Math.min(low[i], place[i]);
      high[i] = Math.max(high[i], place[i]);
    }
  }
  return [low, high];
}

/** The ends of a sphere's diameters. */
function aroundSphere(center, radius) {
  return [0, 1, 2].flatMap((axis) => [-radius, radius].map((offset) => center.map((x, i) => (i === axis ? x + offset : x))));
}

function diagonal(points) {
  return points.length === 0 ? 0 : norm(minus(...box(points).reverse()));
}

/** The direction to look from, in which curves cover the largest area, none from its edge. */
function bestDirection(curves, up) {
  const right = unit(cross(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
  const ahead = cross(right, up);
  const spreads = curves.map((curve) => {
    const chosen = even(curve.length, 200).map((k) => curve[k]);
    const center = times(chosen.reduce((sum, place) => plus(sum, place), [0, 0, 0]), 1 / Math.max(chosen.length, 1));
    return chosen.map((place) => minus(place, center));
  }).filter((arms) => arms.length > 2 && arms.some((arm) => norm(arm) > 0));
  let best = { score: -Infinity };
  for (let azimuth = 300; azimuth < 660; azimuth += 10) {
    for (const elevation of [20, 25, 30, 35, 40]) {
      const [a, e] = [azimuth, elevation].map((angle) => ((angle + 5) * Math.PI) / 180);
      const level = plus(times(right, Math.cos(a)), ahead, Math.sin(a));
      const towards = plus(times(level, Math.cos(e)), up, Math.sin(e));
      const side = cross(up, level);
      const top = cross(towards, side);
      let score = 0;
      for (const arms of spreads) {
        let [xx, xy, yy, all] = [0, 0, 0, 0];
        for (const arm of arms) {
          const [x, y] = [dot(arm, side), dot(arm, top)];
          [xx, xy, yy, all] = [xx + x * x, xy + x * y, yy + y * y, all + dot(arm, arm)];
        }
        score += Math.log(Math.max(xx * yy - xy * xy, 0) / (all * all) + 1e-5) + 2 * Math.log((xx + yy) / all + 1e-5);
      }
      if (score > best.score + 1e-9) best = { score, towards };
    }
  }
  return best.towards;
}
