"""What has come of the plans made in flight, as a table."""

import math
from collections import Counter

QUANTILES = [0.5, 0.95, 0.99, 0.999, 1.0]


class Kind:
    """Flights beside the same number of busy processes."""

    def __init__(self, busy, arguments, flights):
        self.label = f"{busy} busy processes"
        self.replans = [replan for flight in flights for replan in flight["replans"]]
        self.refused = sum(flight["refused"] for flight in flights)
        self.kept = [replan["kept"] for replan in self.replans if replan["kept"] is not None]
        self.seconds = sorted(replan["seconds"] for replan in self.replans if replan["kept"] is None)
        self.in_time = sum(seconds <= arguments.deadline for seconds in self.seconds)
        self.missed = sum(missed(flight["replans"], arguments.every) for flight in flights)
        self.others = sum(flight["others"] for flight in flights) / len(flights)

    @property
    def due(self):
        return len(self.replans) + self.missed

    def quantile(self, part):
        """The least latency (s) that at least this part of the plans due does not exceed; none where there was no plan."""
        rank = math.ceil(part * self.due)
        return self.seconds[rank - 1] if rank <= len(self.seconds) else math.inf

    def kept_because(self):
        # The step that a flight had reached is not a reason of its own.
        reasons = Counter("".join("#" if letter.isdigit() else letter for letter in why) for why in self.kept)
        reasons = [f"{count} times: {why}" for why, count in reasons.most_common()]
        return f"{self.label}: " + ("; ".join(reasons) or "no old plan kept")

    def cells(self):
        late = len(self.seconds) - self.in_time
        return [
            self.label,
            f"{self.due}",
            f"{100 * self.in_time / self.due:.2f} %",
            f"{late}",
            f"{len(self.kept)}",
            f"{self.missed}",
            f"{self.refused}",
            *(milliseconds(self.quantile(part)) for part in QUANTILES),
            f"{100 * self.others:.0f} %",
        ]


def milliseconds(seconds):
    return f"{1e3 * seconds:.1f}" if math.isfinite(seconds) else "none"


def missed(replans, every):
    """Turns that had passed before the planner was done with the one before."""
    turns = [0, *(replan["step"] // every for replan in replans)]
    return sum(after - before - 1 for before, after in zip(turns, turns[1:]))


def table(kinds):
    head = ["", "plans due", "by the deadline", "later, flown", "old plan kept", "turn missed", "refused"]
    head += ["50 % (ms)", "95 %", "99 %", "99.9 %", "longest", "cores taken by others"]
    rows = [head, ["---"] * len(head), *(kind.cells() for kind in kinds)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)
