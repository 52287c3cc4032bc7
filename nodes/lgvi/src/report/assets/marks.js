// What is written over the view: names, the axes in its corner, the scale.

class Marks {
  constructor(view) {
    this.view = view;
    this.triad = axes();
    this.triad.traverse((part) => part.material && Object.assign(part.material, { depthTest: false }));
    view.camera.add(this.triad);
  }

  /** The axes of the frame in the lower left corner. */
  placeTriad() {
    const { camera, height, sceneRoot } = this.view;
    const tangent = Math.tan((Math.PI / 360) * FIELD_OF_VIEW);
    const pixel = (2 * tangent) / height;
    this.triad.position.set(-tangent * camera.aspect + 62 * pixel, -tangent + 62 * pixel, -1);
    this.triad.scale.setScalar(38 * pixel);
    // As it would look in the middle of the picture.
    this.triad.quaternion.setFromUnitVectors(new Vector3(0, 0, -1), this.triad.position.clone().normalize());
    this.triad.quaternion.multiply(camera.quaternion.clone().invert());
    sceneRoot.updateMatrixWorld(true);
  }

  /** Names beside what they name, none over another. */
  placeNames() {
    const { view } = this;
    const marks = view.host.querySelector("#marks");
    const taken = [];
    const texts = [];
    const add = (world, text, kind = "") => {
      const seen = world.project(view.camera);
      if (Math.abs(seen.z) > 1) return;
      const x = (0.5 + 0.5 * seen.x) * view.width;
      const y = (0.5 - 0.5 * seen.y) * view.height;
      const size = [text.length * 6.6 + 4, 15];
      const places = [[8, -18], [8, 4], [-size[0] - 8, -18], [-size[0] - 8, 4]].map(([right, down]) => [x + right, y + down]);
      const free = places.find(([left, top]) => left > 0 && top > 0 && left + size[0] < view.width && top + size[1] < view.height
        && taken.every((other) => left > other[2] || left + size[0] < other[0] || top > other[3] || top + size[1] < other[1]));
      if (!free) return;
      taken.push([free[0], free[1], free[0] + size[0], free[1] + size[1]]);
      texts.push({ text, kind, x: free[0], y: free[1] });
    };
    if (view.withLabels) {
      for (const { body, place, factor } of view.bodies) {
        if (!view.listed.has(body.index)) continue;
        const enlarged = factor > 1.05 ? `, drawn ×${factorText(factor)}` : "";
        add(view.root.localToWorld(toVector(place)), body.name + enlarged, this.isHidden(place) ? "hidden" : "");
      }
      if (view.withAxes) {
        for (const { name, holder } of view.frames) add(holder.getWorldPosition(new Vector3()), name, "frame");
      }
    }
    if (view.withAxes) {
      for (const [axis, name] of ["x", "y", "z"].entries()) {
        const tip = [0, 0, 0];
        tip[axis] = 1.2;
        const world = this.triad.localToWorld(toVector(tip));
        const seen = world.project(view.camera);
        if (Math.abs(seen.z) < 1) texts.push({ text: name, kind: "frame", x: (0.5 + 0.5 * seen.x) * view.width - 3, y: (0.5 - 0.5 * seen.y) * view.height - 9 });
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
  }

  /** Whether the attractor is before a place in the frame. */
  isHidden(place) {
    const { view } = this;
    const attractor = view.flight.scenery.attractor;
    if (!attractor?.radius) return false;
    const center = view.attractor.getWorldPosition(new Vector3()).sub(view.camera.position);
    const arm = view.root.localToWorld(toVector(place)).sub(view.camera.position);
    const along = arm.clone().normalize();
    const nearest = center.dot(along);
    return nearest > 0 && nearest < arm.length() && center.addScaledVector(along, -nearest).length() < attractor.radius * view.root.scale.x;
  }

  /** A round length in the plane of what is looked at. */
  drawBar() {
    const { view } = this;
    const pixels = view.pixels(view.root.worldToLocal(view.controls.target.clone()).toArray());
    const wanted = 110 / pixels;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].map((digit) => digit * power).find((length) => length <= wanted) ?? power;
    const bar = view.host.querySelector("#bar");
    bar.style.width = `${(length * pixels).toFixed(1)}px`;
    bar.firstElementChild.textContent = lengthText(length);
  }
}
