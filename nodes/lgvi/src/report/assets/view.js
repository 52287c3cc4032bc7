// The motion in space, seen from a frame that may move with a body.

const { AmbientLight, DirectionalLight, OrbitControls, PerspectiveCamera, Scene, WebGLRenderer } = libraries;

/** Bodies are at least this large (px); of many, or without a trail, less. */
const LEAST_PIXELS = { few: 11, many: 3.5 };
const MANY = 8;
const FIELD_OF_VIEW = 40;
/** Length of the strongest load's arrow, of the picture's radius. */
const STRONGEST = 0.3;

class View {
  /** `listed` is the set of bodies with trail and name. */
  constructor(host, flight, listed) {
    Object.assign(this, { host, flight, listed, frame: { kind: "inertial" }, focus: null, time: flight.start });
    Object.assign(this, { trueSize: false, withAxes: true, withLabels: true, width: 1, height: 1 });
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
    const { scenery } = flight;
    this.inertial = new Group();
    this.trails = new Trails(flight);
    this.marks = new Marks(this);
    this.root.add(this.inertial, this.trails.group);
    const heaviest = heaviestOf(flight.bodies);
    this.bodies = flight.bodies.map((body) => {
      const group = new Group();
      const own = axes();
      own.scale.setScalar(1.5 * body.extent);
      const look = solid(body.shape, bodyColor(body.index), { coarse: flight.bodies.length > MANY && body.index !== heaviest });
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
    this.goal = flight.planned.length > 0 ? buildGoals(flight, flight.planned) : null;
    if (this.goal) this.inertial.add(this.goal.group);
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

  /** Looks from another frame. */
  setFrame(frame) {
    this.frame = frame;
    this.list();
    this.fit();
  }

  /** Takes up which bodies are listed. */
  list() {
    this.trails.build(this.frame, this.listed);
    this.stale = true;
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
      points = [...this.trails.places.values()].flat();
      if (this.frame.kind === "inertial") {
        if (flight.scenery.attractor) points.push(...aroundSphere(flight.scenery.attractor.position, flight.scenery.attractor.radius));
        points.push(...(this.goal?.surrounds ?? []));
        points.push(...flight.planned.flatMap(({ position }) => (position ? [position] : [])));
        const [low, high] = box(points);
        const near = (place) => place.every((x, i) => x >= low[i] - 0.6 * diagonal(points) && x <= high[i] + 0.6 * diagonal(points));
        if (this.goal?.orbits.every(near)) points.push(...this.goal.orbits);
      } else {
        points.push([0, 0, 0]);
      }
      const span = diagonal(points);
      const largest = most([0, ...flight.bodies.filter((body) => this.listed.has(body.index)).map((body) => body.extent)]);
      // Where bodies hardly move, their axes are to be seen too.
      around = Math.max(span > 4 * largest ? largest : 1.7 * largest, this.goal?.reach ?? 0);
    }
    const up = flight.scenery.gravity ? unit(times(flight.scenery.gravity, -1)) : [0, 0, 1];
    this.direction = focus !== null && this.direction ? this.direction : bestDirection([...this.trails.places.values()], up);
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
    const radius = most(seen.map((place) => norm(minus(place, middle)))) + around || 1;
    const tangent = Math.tan((Math.PI / 360) * FIELD_OF_VIEW);
    const tangents = [tangent * this.camera.aspect, tangent];
    const margin = 1.12;
    const distance = most(seen.map((place) => {
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

  /** By how much something of an extent (m) is drawn larger, so that it has a radius of `least` pixels. */
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
    this.marks.triad.visible = this.withAxes;
    this.trails.show(moment.k);
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
    for (const target of this.goal?.targets ?? []) {
      const { origin: at, extent } = target.userData;
      const place = rotate(back, minus(at, origin));
      target.scale.setScalar(this.enlarged(extent, place, LEAST_PIXELS.few));
    }
    for (const { group, place, turn } of this.goal?.moving ?? []) {
      group.position.copy(toVector(flight.poseOf(place, moment).origin));
      group.quaternion.copy(toQuaternion(flight.poseOf(turn, moment).turn));
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
    this.marks.placeTriad();
    this.renderer.render(this.sceneRoot, this.camera);
    this.marks.placeNames();
    this.marks.drawBar();
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
}
