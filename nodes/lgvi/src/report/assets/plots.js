// Plots over time, which share their zoom and their cursor.

const { uPlot } = libraries;

const HEIGHT = 170;
const LINE_COLORS = ["#d55e00", "#009e73", "#0072b2", "#cc79a7", "#e69f00", "#56b4e9"];
const INK = "#222";

class Plots {
  /** `choose` is called with the time (s) of a click. */
  constructor(flight, choose) {
    Object.assign(this, { flight, choose, all: new Set(), time: flight.start, zoomed: null });
    this.unit = timeUnit(flight.end - flight.start);
  }

  /**
   * A plot in `host`: `time` (s); `unit` is that of all curves, each of which has `label`, `values` and perhaps `color`,
   * `dashed` and `breaks`, indices before which its line is broken; `stepped` curves keep a value until the next.
   */
  add(host, { title, unit, time, curves, stepped = false }) {
    const largest = most(curves.map((curve) => most(curve.values.map((value) => Math.abs(value ?? 0)))));
    const { size, symbol } = readable(largest, unit);
    const scaled = curves.map(({ values }) => Array.from(values, (value) => (value === null ? null : value / size)));
    const data = [Array.from(time, (t) => t / this.unit.size), ...scaled];
    const element = document.createElement("div");
    element.className = "plot";
    const heading = document.createElement("h3");
    heading.textContent = title;
    element.append(heading);
    host.append(element);
    const value = (_, number) => (number === null || number === undefined ? "–" : short(number, 5));
    const options = {
      // Slow curves have no stairs.
      pxAlign: 0,
      width: this.widthOf(host),
      height: HEIGHT,
      cursor: { sync: { key: "lgvi", filters: { pub: (kind) => kind === "mousemove" || kind === "mouseleave" } }, drag: { x: true, y: false, setScale: false }, points: { size: 5 } },
      scales: { x: { time: false, range: () => this.range() } },
      axes: [
        { label: `time (${this.unit.symbol})`, labelSize: 16, size: 26, labelFont: "12px system-ui, sans-serif", font: "11px system-ui, sans-serif", labelGap: 0, gap: 3 },
        { label: symbol, labelSize: 20, space: 22, size: (plot, values) => axisWidth(values), labelFont: "12px system-ui, sans-serif", font: "11px system-ui, sans-serif", values: (_, splits) => splits.map((split) => (split === null ? "" : short(split, 6))) },
      ],
      series: [
        { label: "t", value },
        ...curves.map((curve, index) => ({
          label: curve.label,
          stroke: curve.color ?? LINE_COLORS[index % LINE_COLORS.length],
          width: curve.dashed ? 1 : 1.4,
          dash: curve.dashed ? [6, 4] : undefined,
          points: { show: time.length === 1 },
          value,
          // Pixels in which no line goes from one side to the other.
          gaps: (plot, _, from, to, gaps) => {
            const x = (k) => plot.valToPos(data[0][k], "x", true);
            const breaks = (curve.breaks ?? []).filter((k) => k > from && k <= to);
            return [...gaps, ...breaks.map((k) => [x(k - 1) - 2, x(k) + 2])];
          },
          ...(stepped ? { paths: uPlot.paths.stepped({ align: 1 }) } : {}),
        })),
      ],
      hooks: {
        setSelect: [(plot) => this.select(plot)],
        draw: [(plot) => this.mark(plot)],
      },
    };
    const plot = new uPlot(options, data, element);
    const now = document.createElement("div");
    now.className = "now";
    plot.over.append(now);
    plot.over.addEventListener("dblclick", () => this.zoom(null));
    plot.over.addEventListener("click", () => {
      if (plot.cursor.left >= 0) this.choose(plot.posToVal(plot.cursor.left, "x") * this.unit.size);
    });
    const item = { plot, now, time, element, host };
    plot.item = item;
    this.all.add(item);
    this.mark(plot);
    return item;
  }

  clear(host) {
    for (const item of this.all) {
      if (item.host !== host) continue;
      item.plot.destroy();
      this.all.delete(item);
    }
    host.replaceChildren();
  }

  range() {
    return this.zoomed ?? [this.flight.start / this.unit.size, (this.flight.end > this.flight.start ? this.flight.end : this.flight.start + 1) / this.unit.size];
  }

  select(plot) {
    const { left, width } = plot.select;
    if (width < 3) return;
    const zoomed = [left, left + width].map((x) => plot.posToVal(x, "x"));
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoom(zoomed);
  }

  /** Shows from one time to another (in the unit of the axes), or everything. */
  zoom(range) {
    this.zoomed = range;
    const [min, max] = this.range();
    for (const { plot } of this.all) plot.setScale("x", { min, max });
  }

  /** Shows the time `t` (s) in all plots, and the values there. */
  seek(t) {
    this.time = t;
    for (const item of this.all) {
      this.mark(item.plot);
      if (!item.plot.over.matches(":hover")) item.plot.setLegend({ idx: lastAtOrBefore(item.time, t) }, false);
    }
  }

  mark(plot) {
    if (!plot.item) return;
    const x = plot.valToPos(this.time / this.unit.size, "x");
    const { now } = plot.item;
    now.hidden = !(x >= 0 && x <= plot.over.clientWidth);
    now.style.left = `${x}px`;
  }

  widthOf(host) {
    return Math.max(host.clientWidth, 240);
  }

  resize() {
    for (const { plot, host } of this.all) plot.setSize({ width: this.widthOf(host), height: HEIGHT });
    // A new size empties the legends.
    requestAnimationFrame(() => this.seek(this.time));
  }
}

function axisWidth(values) {
  const longest = Math.max(...(values ?? [""]).map((value) => value.length), 3);
  return 20 + 6.6 * longest;
}
