// Bodies, attractor, arrows and cones as three.js objects, in meters.

const {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DoubleSide, Group, Line, LineBasicMaterial,
  LineDashedMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, Quaternion, SphereGeometry, Vector3,
} = libraries;

const BODY_COLORS = ["#f2994a", "#56b4e9", "#d98cc0", "#b5c34a", "#a99cf5", "#c9a27a"];
const COLORS = {
  force: "#ffe14d", moment: "#ff5fd2", target: "#3ddc84", initial: "#9aa7b8", forbidden: "#ff4d4d", corridor: "#2ec4b6",
  attractor: "#7f8ca6", grid: "#a9b7cf", axes: ["#ff6b5e", "#4cd964", "#5b9dff"], other: "#77828f", pivot: "#ffffff",
};

function bodyColor(index) {
  return BODY_COLORS[index % BODY_COLORS.length];
}

/** three.js has the scalar last. */
const toQuaternion = ([w, x, y, z]) => new Quaternion(x, y, z, w);
const toVector = ([x, y, z]) => new Vector3(x, y, z);

function positions(points) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points.flat()), 3));
  return geometry;
}

function line(points, color, options = {}) {
  return new Line(positions(points), new LineBasicMaterial({ color, ...options }));
}

function dashedLine(points, color, dash) {
  const dashed = new Line(positions(points), new LineDashedMaterial({ color, dashSize: dash, gapSize: 0.6 * dash }));
  dashed.computeLineDistances();
  return dashed;
}

function segments(points, color, options = {}) {
  return new LineSegments(positions(points), new LineBasicMaterial({ color, ...options }));
}

/** A solid in its frame. Every other octant is darker, so that a turn is seen; a `coarse` ellipsoid has fewer faces. */
function solid(shape, color, { coarse = false, ...options } = {}) {
  const material = () => new MeshLambertMaterial({ color, ...options });
  if (shape.kind === "mesh") {
    const vertices = unpack(shape.vertices);
    const geometry = checkered(positions(shape.faces.flat().map((vertex) => nth(vertices, vertex))));
    geometry.computeVertexNormals();
    return new Mesh(geometry, new MeshLambertMaterial({ color, vertexColors: true, ...options }));
  }
  if (shape.kind === "ellipsoid") {
    const mesh = new Mesh(checkered(new SphereGeometry(1, coarse ? 16 : 48, coarse ? 12 : 32).toNonIndexed()), new MeshLambertMaterial({ color, vertexColors: true, ...options }));
    mesh.scale.copy(toVector(shape.semi_axes));
    mesh.quaternion.copy(toQuaternion(shape.axes));
    mesh.position.copy(toVector(shape.center));
    return mesh;
  }
  const group = new Group();
  const centers = unpack(shape.centers);
  const farthest = most(even(centers.length / 3, Infinity).map((k) => norm(nth(centers, k))));
  const radius = Math.max(shape.radius, 0.02 * farthest);
  for (let k = 0; k < centers.length / 3; k++) {
    const ball = new Mesh(new SphereGeometry(radius, 28, 20), material());
    ball.position.copy(toVector(nth(centers, k)));
    group.add(ball);
    const arm = nth(centers, k);
    if (norm(arm) > radius) group.add(rod([0, 0, 0], arm, Math.min(0.35 * radius, 0.04 * farthest + 0.1 * radius), material()));
  }
  return group;
}

function checkered(geometry) {
  const corners = geometry.getAttribute("position");
  const colors = new Float32Array(3 * corners.count);
  for (let face = 0; face < corners.count; face += 3) {
    let octant = 1;
    for (const get of ["getX", "getY", "getZ"]) octant *= Math.sign(corners[get](face) + corners[get](face + 1) + corners[get](face + 2)) || 1;
    colors.fill(octant > 0 ? 1 : 0.66, 3 * face, 3 * face + 9);
  }
  geometry.setAttribute("color", new BufferAttribute(colors, 3));
  return geometry;
}

function rod(from, to, radius, material) {
  const along = toVector(minus(to, from));
  const mesh = new Mesh(new CylinderGeometry(radius, radius, along.length(), 14), material);
  mesh.position.copy(toVector(from)).addScaledVector(along, 0.5);
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.normalize());
  return mesh;
}

/** An arrow of length 1 along y, which nothing hides; `point` turns and stretches it. */
function arrow(color) {
  const material = new MeshBasicMaterial({ color, depthTest: false });
  const group = new Group();
  const shaft = new Mesh(new CylinderGeometry(0.018, 0.018, 0.78, 12), material);
  shaft.position.y = 0.39;
  const head = new Mesh(new ConeGeometry(0.06, 0.22, 16), material);
  head.position.y = 0.89;
  for (const part of [shaft, head]) part.renderOrder = 1;
  group.add(shaft, head);
  return group;
}

function point(arrow, from, along, length) {
  arrow.visible = length > 0;
  if (!arrow.visible) return;
  arrow.position.copy(toVector(from));
  arrow.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), toVector(unit(along)));
  arrow.scale.setScalar(length);
}

/** What a body turns about, and the line from there to its center. */
function pivot(body) {
  const ball = new Mesh(new SphereGeometry(0.025 * body.extent, 20, 14), new MeshBasicMaterial({ color: COLORS.pivot, depthTest: false }));
  ball.renderOrder = 1;
  const parts = [ball];
  if (body.shape.center) {
    const arm = line([[0, 0, 0], body.shape.center], COLORS.pivot, { depthTest: false });
    arm.renderOrder = 1;
    parts.push(arm);
  }
  return parts;
}

/** Axes of length 1: x, y and z in their colors. */
function axes() {
  const group = new Group();
  for (let axis = 0; axis < 3; axis++) {
    const tip = [0, 0, 0];
    tip[axis] = 1;
    group.add(line([[0, 0, 0], tip], COLORS.axes[axis]));
  }
  return group;
}

/** The mantle of a cone with lines on it. */
function cone(apex, axis, halfAngle, side, color) {
  const group = new Group();
  const across = unit(cross(axis, Math.abs(axis[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0]));
  const third = cross(axis, across);
  const rim = Array.from({ length: 65 }, (_, k) => {
    const angle = (2 * Math.PI * k) / 64;
    const out = plus(times(across, Math.cos(angle)), third, Math.sin(angle));
    return plus(times(axis, side * Math.cos(halfAngle)), out, side * Math.sin(halfAngle));
  });
  const faces = rim.slice(1).flatMap((next, k) => [[0, 0, 0], rim[k], next]);
  const material = new MeshBasicMaterial({ color, transparent: true, opacity: 0.22, side: DoubleSide, depthWrite: false });
  group.add(new Mesh(positions(faces), material), line(rim, color));
  group.add(segments(even(8, 8).flatMap((k) => [[0, 0, 0], rim[8 * k]]), color, { transparent: true, opacity: 0.5 }));
  group.position.copy(toVector(apex));
  group.userData = { rim: even(8, 8).map((k) => rim[8 * k]) };
  return group;
}

function translucentEllipsoid({ center, axes, semi_axes }, color) {
  const group = new Group();
  const material = new MeshBasicMaterial({ color: color, transparent: true, opacity: 0.25, depthWrite: false });
  group.add(new Mesh(new SphereGeometry(1, 40, 28), material), graticule(1, color, 0.45));
  group.scale.copy(toVector(semi_axes));
  group.quaternion.copy(toQuaternion(axes));
  group.position.copy(toVector(center));
  return group;
}

/** A small ball at a point. */
function spot(place, radius, color) {
  const ball = new Mesh(new SphereGeometry(radius, 16, 12), new MeshBasicMaterial({ color }));
  ball.position.copy(toVector(place));
  return ball;
}

/** Parallels and meridians about z. */
function graticule(radius, color, opacity) {
  const points = [];
  const at = (longitude, latitude) => times([Math.cos(latitude) * Math.cos(longitude), Math.cos(latitude) * Math.sin(longitude), Math.sin(latitude)], radius);
  const step = Math.PI / 72;
  for (let k = 0; k < 144; k++) {
    for (let latitude = -2; latitude <= 2; latitude++) {
      points.push(at(k * step, (latitude * Math.PI) / 6), at((k + 1) * step, (latitude * Math.PI) / 6));
    }
  }
  for (let meridian = 0; meridian < 12; meridian++) {
    for (let k = -36; k < 36; k++) points.push(at((meridian * Math.PI) / 6, k * step), at((meridian * Math.PI) / 6, (k + 1) * step));
  }
  return segments(points, color, { transparent: true, opacity });
}

/** The attractor: a globe of its radius, or of radius 1 for a point. */
function globe({ radius, pole }) {
  const group = new Group();
  const size = radius || 1;
  group.add(new Mesh(new SphereGeometry(size, 160, 120), new MeshLambertMaterial({ color: COLORS.attractor })));
  if (radius > 0) group.add(graticule(size * 1.002, COLORS.grid, 0.5));
  group.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), toVector(unit(pole ?? [0, 0, 1])));
  return group;
}

/** A shadow of a body where it is to arrive. */
function ghost(shape) {
  return solid(shape, COLORS.target, { transparent: true, opacity: 0.35, depthWrite: false });
}
