"""Histograms as SVG, in the style of the other pictures."""

import math
from html import escape

WIDTH, HEIGHT = 1000, 560
LEFT, RIGHT, TOP, BOTTOM = 82, 758, 38, 503
COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"]
GRID = "#E1E1E1"


def text(x, y, words, anchor="middle", turned=False):
    turn = f' transform="rotate(270, {x:.0f}, {y:.0f})"' if turned else ""
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" font-family="sans-serif" font-size="12"{turn}>{escape(words)}</text>'


def line(x1, y1, x2, y2, style):
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" {style}/>'


def draw(path, title, latencies, deadline):
    """Draws how many plans took how many milliseconds, in bars of 1 ms and on a logarithmic axis, by the kind of flight."""
    longest = max([deadline, *(value for values in latencies.values() for value in values)])
    end = math.ceil(1.04 * longest)
    counts = {label: [0] * end for label in latencies}
    for label, values in latencies.items():
        for value in values:
            counts[label][int(value)] += 1
    most = max(max(bars) for bars in counts.values())
    # A bar of one stands above the axis.
    low, high = math.log10(0.5), math.log10(1.5 * most)

    def across(value):
        return LEFT + (RIGHT - LEFT) * value / end

    def up(count):
        place = math.log10(max(count, 0.5))
        return BOTTOM - (BOTTOM - TOP) * (place - low) / (high - low)

    svg = [
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" xmlns="http://www.w3.org/2000/svg">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#FFFFFF"/>',
        f'<text x="385" y="28" text-anchor="middle" font-family="sans-serif" font-size="16">{escape(title)}</text>',
    ]
    stride = next(step for step in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 10**9) if end / step <= 10)
    for value in range(0, end + 1, stride):
        x = across(value)
        svg += [line(x, TOP, x, BOTTOM, f'stroke="{GRID}"'), text(x, BOTTOM + 18, f"{value}")]
    for decade in range(math.ceil(low), math.floor(high) + 1):
        y = up(10**decade)
        svg += [line(LEFT, y, RIGHT, y, f'stroke="{GRID}"'), text(LEFT - 8, y + 4, f"{10**decade}", "end")]
    svg += [
        line(LEFT, BOTTOM, RIGHT, BOTTOM, 'stroke="#000000"'),
        line(LEFT, TOP, LEFT, BOTTOM, 'stroke="#000000"'),
        text((LEFT + RIGHT) / 2, BOTTOM + 42, "time from the state to the published plan (ms)"),
        text(24, (TOP + BOTTOM) / 2, "plans in 1 ms", turned=True),
    ]
    for index, (label, bars) in enumerate(counts.items()):
        color = COLORS[index % len(COLORS)]
        outline = [f"{across(edge):.1f},{up(count):.1f}" for bar, count in enumerate(bars) for edge in (bar, bar + 1)]
        svg.append(f'<polyline fill="none" stroke="{color}" stroke-width="2" points="{" ".join(outline)}"/>')
        svg += legend(index, label, f'stroke="{color}" stroke-width="2"')
    dashed = 'stroke="#5A5A5A" stroke-width="2" stroke-dasharray="9 6"'
    svg.append(line(across(deadline), TOP, across(deadline), BOTTOM, dashed))
    svg += legend(len(counts), f"deadline, {deadline:g} ms", dashed)
    path.write_text("\n".join([*svg, "</svg>", ""]))


def legend(index, label, style):
    y = 60 + 24 * index
    return [line(RIGHT + 12, y, RIGHT + 36, y, style), text(RIGHT + 44, y + 4, label, "start")]
