//! What a person reads when a flight is over.

use std::fmt::{Display, Formatter, Result};

use lgvi_common::{Arrival, Miss};
use lgvi_scene::Scene;

use super::flown::Flown;

/// The line of a planned body; without its name if there is only one.
fn arrival(f: &mut Formatter<'_>, body: &str, cost: f64, miss: &Miss) -> Result {
    let of = match body {
        "" => String::new(),
        body => format!(" of {body}:"),
    };
    write!(
        f,
        "\n  arrival  {of} cost {cost:.9}, terminal error {:.1e}: {:.1e} m, {:.1e} kg m/s, {:.1e} rad, {:.1e} kg m²/s",
        miss.norm, miss.position, miss.linear_momentum, miss.attitude, miss.angular_momentum
    )
}

/// A flight of a scene, in a few lines.
pub(crate) struct Summary<'a>(pub(crate) &'a Scene, pub(crate) &'a Flown);

impl Display for Summary<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self(scene, flown) = self;
        write!(f, "{}", scene.title)?;
        if let (Some(plan), Some(seconds)) = (&flown.plan, flown.planning_seconds) {
            write!(
                f,
                "\n  planned   cost {:.9} in {} iterations ({} trajectories), terminal error {:.1e}, {seconds:.3} s",
                plan.cost, plan.iterations, plan.trials, plan.violation
            )?;
            if let Some(soft) = &plan.soft {
                write!(
                    f,
                    "\n  soft      constraints with a price are violated by up to {:.2e}, which costs {:.9} beside the commands",
                    soft.violation, soft.paid
                )?;
            }
        }
        if let Some(replanned) = &flown.replanned {
            let seconds = replanned.replans.iter().map(|replan| replan.seconds);
            write!(
                f,
                "\n  replanned {} times in flight, the old plan kept {} times, decided within {:.1} ms",
                replanned.published,
                replanned.kept,
                1e3 * seconds.fold(0.0, f64::max)
            )?;
        }
        if let Some(flight) = &flown.flight {
            let rate = flight.steps as f64 / flight.seconds;
            write!(
                f,
                "\n  flown     {} steps of {:.6e} s in {:.3} s, {rate:.0} steps/s",
                flight.steps, flight.step_size, flight.seconds
            )?;
            if let (Some(miss), Some(cost)) = (&flight.miss, flight.cost) {
                let first = match flight.companions.is_empty() {
                    true => "",
                    false => scene.planned_name(0),
                };
                arrival(f, first, cost, miss)?;
            }
            for Arrival { body, cost, miss } in &flight.companions {
                if let Some(miss) = miss {
                    arrival(f, body, *cost, miss)?;
                }
            }
            write!(
                f,
                "\n  energy    {:.9e} J at the start, {:+.3e} J at the end",
                flight.energy_start,
                flight.energy_end - flight.energy_start
            )?;
            write!(
                f,
                "\n  momentum  linear changed by {:.1e} kg m/s, angular by {:.1e} kg m²/s; |RᵀR − I| {:.1e}",
                flight.linear_momentum_change,
                flight.angular_momentum_change,
                flight.orthogonality_error
            )?;
            for docked in &flight.docked {
                write!(f, "\n  docked    {docked}")?;
            }
            if flight.overruns > 0 {
                write!(
                    f,
                    "\n  overruns  {} steps came later than their time",
                    flight.overruns
                )?;
            }
            if flight.late_controls > 0 {
                write!(
                    f,
                    "\n  late      {} control sequences came after the step at which they were to begin, and were refused",
                    flight.late_controls
                )?;
            }
            for timeouts in &flight.command_timeouts {
                write!(f, "\n  timeouts  {timeouts}")?;
            }
            if flight.cut_steps > 0 {
                write!(
                    f,
                    "\n  cut       {} steps could not be made as one",
                    flight.cut_steps
                )?;
            }
            if flight.detail_changes > 0 {
                write!(
                    f,
                    "\n  detail    {} interactions taken up in more or in less detail",
                    flight.detail_changes
                )?;
            }
        }
        let messages: u64 = flown.recorded.values().sum();
        write!(
            f,
            "\n  recorded  {messages} messages on {} topics, ",
            flown.recorded.len()
        )?;
        match (flown.lost, &flown.lost_unknown) {
            (Some(lost), _) => write!(f, "messages lost = {lost}")?,
            (None, Some(why)) => write!(f, "messages lost: unknown ({why})")?,
            (None, None) => write!(f, "messages lost: unknown")?,
        }
        if let Some(bag) = &flown.bag {
            write!(f, "\n  bag       {}", bag.display())?;
        }
        if let Some(picture) = &flown.picture {
            write!(f, "\n  picture   {}", picture.display())?;
        }
        for warning in &flown.warnings {
            write!(f, "\n  warning   {warning}")?;
        }
        Ok(())
    }
}
