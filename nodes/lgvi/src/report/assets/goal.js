// What a maneuver goes to and keeps clear of.

/**
 * In the inertial frame: `group` has all of it, `target` the shadow of the body there, `cones` what moves with the body.
 * `orbits` and `surrounds` are points (m) to be seen, with what is within `reach` (m) of the body.
 */
function buildGoal(flight, goal) {
  const built = { group: new Group(), target: null, cones: [], orbits: [], surrounds: [], reach: 0 };
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
  for (const limit of goal.limits) {
    if (limit.kind === "keep_out_sphere") {
      built.group.add(keepOutSphere(limit.center, limit.radius));
      built.surrounds.push(...aroundSphere(limit.center, limit.radius));
    }
    if (limit.kind === "corridor") {
      const reach = most(places.map((place) => norm(minus(place, limit.apex))));
      const corridor = cone(limit.apex, limit.axis, limit.half_angle, reach, COLORS.corridor);
      built.group.add(corridor);
      built.surrounds.push(...corridor.userData.rim.map((place) => plus(place, limit.apex)));
    }
    // Cones of directions move with the body.
    if (limit.kind === "keep_out_cone") {
      const reach = 0.5 * size;
      built.reach = Math.max(built.reach, reach);
      const holder = new Group();
      holder.add(cone([0, 0, 0], unit(limit.direction), limit.half_angle, reach, COLORS.forbidden));
      const path = even(flight.time.length, 600).map((k) => times(rotate(flight.attitude(body, { k, part: 0 }), unit(limit.axis)), reach));
      holder.add(line(path, bodyColor(body.index)));
      const now = line([[0, 0, 0], times(unit(limit.axis), reach)], "#ffffff");
      holder.add(now);
      built.group.add(holder);
      built.cones.push({ holder, now, body });
    }
  }
  return built;
}
