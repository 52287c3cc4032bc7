use std::fmt::{Display, Formatter, Result};

use super::{Allowance, Skips, groups};

impl Display for Skips {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.allowance {
            Some(Allowance {
                tolerance,
                growth,
                evaluations,
            }) => write!(
                f,
                "\n  left out    what changes the end of the run by {} at most: at these distances {:.1e}; errors are taken to \
                 grow {growth:.1} times as in free motion (twice as measured in six directions, in {evaluations} evaluations of gravity)",
                short(*tolerance),
                self.bound
            )?,
            None if self.allowed == "nothing" => write!(f, "\n  left out    nothing, as asked")?,
            None => write!(f, "\n  left out    what makes no difference but rounding")?,
        }
        if let Some(reason) = &self.refused {
            write!(f, "; by the tolerance nothing: {reason}")?;
        }
        let [full, kept] = self.gravity_cost;
        if full > 0.0 {
            let less = 100.0 * (1.0 - kept / full);
            write!(
                f,
                "\n    gravity   {kept:.1} of {full:.1} points of mass an evaluation, {less:.0} % less"
            )?;
        }
        for group in groups::bodies(&self.bodies) {
            let names = ends(&group, |body| body.name.clone());
            let (body, moment) = (group[0], if group[0].moment { "" } else { ", no moment" });
            write!(
                f,
                "\n    {names}: translation {}; rotation {}{moment}",
                body.translation, body.rotation
            )?;
        }
        for group in groups::interactions(&self.interactions) {
            let names = ends(&group, |one| one.between.join("–"));
            let (one, bound) = (
                group[0],
                group.iter().map(|one| one.bound).fold(0.0, f64::max),
            );
            write!(f, "\n    {names}: {}, {}", one.computed, one.why)?;
            let limits = group.iter().filter_map(|one| match one.computed {
                "dropped" => one.dropped_beyond,
                "monopole" => one.monopole_beyond,
                _ => one.second_order_beyond.or(one.monopole_beyond),
            });
            let furthest = limits.fold(0.0, f64::max);
            if furthest > 0.0 {
                write!(
                    f,
                    " (allowed beyond {furthest:.3e} m, begun at 1.25 times that)"
                )?;
            }
            if bound > 0.0 {
                let each = if group.len() > 1 { " each" } else { "" };
                write!(f, ", error {bound:.1e} at most{each}")?;
            }
        }
        if let Some(half) = self.not_planned {
            write!(f, "\n    maneuver: {half} is not planned")?;
        }
        for demand in self.on_demand {
            write!(f, "\n    {demand}")?;
        }
        Ok(())
    }
}

/// A number to six digits, without those that are rounding.
fn short(number: f64) -> String {
    let rounded = format!("{number:.5e}").parse().unwrap_or(number);
    format!("{rounded:e}")
}

/// One, or the first and the last of several and their number.
fn ends<T>(group: &[&T], name: impl Fn(&T) -> String) -> String {
    match group {
        [first, .., last] => {
            let (first, last) = (name(first), name(last));
            format!("{first} … {last} ({})", group.len())
        }
        _ => group.iter().map(|one| name(one)).collect(),
    }
}
