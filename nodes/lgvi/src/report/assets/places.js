// Points: their box, and from where curves are seen best.

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
