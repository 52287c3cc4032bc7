// What a maneuver goes to and keeps clear of.

/** That of all planned bodies, with the `targets` of each. */
function buildGoals(flight, goals) {
  const built = { group: new Group(), targets: [], moving: [], orbits: [], surrounds: [], reach: 0 };
  for (const goal of goals) {
    const one = buildGoal(flight, goal);
    built.group.add(one.group);
    if (one.target) built.targets.push(one.target);
    for (const key of ["moving", "orbits", "surrounds"]) built[key].push(...one[key]);
    built.reach = Math.max(built.reach, one.reach);
  }
  return built;
}

/**
 * In the inertial frame: `group` has all of it, `target` the shadow of the body there, `moving` groups with the place of one
 * body or frame and the attitude of one.
 * `orbits` and `surrounds` are points (m) to be seen, with what is within `reach` (m) of the body.
 */
function buildGoal(flight, goal) {
  const built = { group: new Group(), target: null, moving: [], orbits: [], surrounds: [], reach: 0 };
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
    built.orbits.push(...places);
    built.group.add(color === COLORS.target ? dashedLine(places, color, 0.02 * size) : line(places, color));
  }
  const origin = goal.position ?? places[places.length - 1];
  if (goal.position || goal.attitude) {
    built.target = new Group();
    built.target.add(ghost(body.shape));
    if (goal.attitude) {
      const own = axes();
      own.scale.setScalar(1.5 * body.extent);
      built.target.add(own);
      built.target.quaternion.copy(toQuaternion(goal.attitude));
    }
    built.target.position.copy(toVector(origin));
    built.target.userData = { origin, extent: body.extent };
    built.group.add(built.target);
  }
  if (goal.spin_direction) {
    const spin = arrow(COLORS.target);
    const length = Math.max(0.1 * size, 1.5 * body.extent);
    point(spin, origin, goal.spin_direction, length);
    built.surrounds.push(plus(origin, unit(goal.spin_direction), length));
    built.group.add(spin);
  }
  const last = { k: flight.time.length - 1, part: 0 };
  for (const limit of goal.limits) {
    const frame = new Group();
    const end = flight.poseOf(limit.frame, last);
    const placed = (place) => plus(end.origin, rotate(end.turn, place));
    if (limit.kind === "keep_in_sphere") {
      frame.add(translucentEllipsoid({ center: limit.center, axes: [1, 0, 0, 0], semi_axes: Array(3).fill(limit.radius) }, COLORS.corridor));
      built.surrounds.push(...aroundSphere(placed(limit.center), limit.radius));
    }
    if (limit.kind === "keep_out_ellipsoid") {
      frame.add(translucentEllipsoid(limit, COLORS.forbidden));
      built.surrounds.push(...aroundSphere(placed(limit.center), Math.max(...limit.semi_axes)));
    }
    if (limit.kind === "corridor") {
      const ways = even(flight.time.length, 200).map((k) => [nth(body.position, k), flight.poseOf(limit.frame, { k, part: 0 })]);
      const reach = most(ways.map(([place, { origin, turn }]) => norm(minus(rotate(conjugate(turn), minus(place, origin)), limit.apex))));
      const corridor = cone(limit.apex, limit.axis, limit.half_angle, reach, COLORS.corridor);
      frame.add(corridor);
      built.surrounds.push(...corridor.userData.rim.map((place) => placed(plus(place, limit.apex))));
    }
    // Cones of directions move with the body.
    if (limit.kind === "keep_out_cone") {
      const reach = 0.5 * size;
      built.reach = Math.max(built.reach, reach);
      frame.add(cone([0, 0, 0], unit(limit.direction), limit.half_angle, reach, COLORS.forbidden));
      const pointing = (k) => compose(conjugate(flight.poseOf(limit.frame, { k, part: 0 }).turn), flight.attitude(body, { k, part: 0 }));
      const path = even(flight.time.length, 600).map((k) => times(rotate(pointing(k), unit(limit.axis)), reach));
      frame.add(line(path, bodyColor(body.index)));
      const now = line([[0, 0, 0], times(unit(limit.axis), reach)], "#ffffff");
      built.group.add(now);
      built.moving.push({ group: now, place: body, turn: body });
    }
    if (limit.kind === "line_of_sight" || limit.kind === "plume") {
      const isPlume = limit.kind === "plume";
      const color = isPlume ? COLORS.forbidden : COLORS.corridor;
      const distances = even(flight.time.length, 200).map((k) => {
        const { origin, turn } = flight.poseOf(limit.frame, { k, part: 0 });
        return norm(minus(plus(origin, rotate(turn, limit.point)), nth(body.position, k)));
      });
      const reach = isPlume ? limit.distance : Math.min(...distances);
      const own = new Group();
      own.add(cone([0, 0, 0], limit.axis, limit.half_angle, reach, color));
      built.group.add(own);
      built.moving.push({ group: own, place: body, turn: body });
      frame.add(spot(limit.point, 0.1 * body.extent, color));
    }
    built.group.add(frame);
    built.moving.push({ group: frame, place: limit.kind === "keep_out_cone" ? body : limit.frame, turn: limit.frame });
  }
  return built;
}
