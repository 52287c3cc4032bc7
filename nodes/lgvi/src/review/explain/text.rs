//! An explanation as a person reads it.

use std::fmt::{Display, Formatter, Result};

use super::Explanation;
use super::integrator::Integrator;

impl Display for Explanation {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{}", self.title)?;
        write!(
            f,
            "\n  run         {} s in {} steps of {} s",
            self.duration, self.steps, self.step_size
        )?;
        for body in &self.bodies {
            write!(
                f,
                "\n  body        {}: {}, {}, {}",
                body.name, body.kind, body.mobility, body.distribution
            )?;
            for (what, names) in [("wheels", &body.wheels), ("thrusters", &body.thrusters)] {
                if names.is_empty() {
                    continue;
                }
                write!(f, "\n  {what:<12}of {}: {}", body.name, names.join(", "))?;
            }
            if let Some(engine) = &body.engine {
                write!(f, "\n  engine      of {}: ", body.name)?;
                if let Some(thrust) = engine.thrust {
                    write!(f, "thrust {thrust} N, ")?;
                }
                write!(f, "exhaust velocity {} m/s", engine.exhaust_velocity)?;
            }
            if let Some(given) = &body.given {
                write!(
                    f,
                    "\n  state       by {given}: position {:.6?} m, velocity {:.6?} m/s",
                    body.position, body.velocity
                )?;
            }
        }
        write!(f, "\n  gravity     {}", self.gravity)?;
        for docking in &self.docking {
            write!(f, "\n  docking     {docking}")?;
        }
        for sensor in &self.sensors {
            write!(f, "\n  sensor      {sensor}")?;
        }
        if let Some(maneuver) = &self.maneuver {
            write!(f, "\n  maneuver    {maneuver}")?;
        }
        if let Some(seed) = self.disturbance {
            write!(
                f,
                "\n  disturbed   by seed {seed}: states at the start and actuators are not quite those of the plan"
            )?;
        }
        write!(f, "{}{}", self.integrator, self.skips)?;
        for warning in &self.warnings {
            write!(f, "\n  warning     {warning}")?;
        }
        Ok(())
    }
}

impl Display for Integrator {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "\n  integrator  {}", self.method)?;
        match self.order {
            Some(order) => write!(f, "\n  order       {order}")?,
            None => write!(f, "\n  order       exact")?,
        }
        write!(
            f,
            "\n  steps       {} a step of the run, of {} s",
            self.substeps, self.step_size
        )?;
        if self.evaluations > 0.0 {
            write!(f, ", {:.1} evaluations of gravity each", self.evaluations)?;
        }
        if self.subdivide > 0 {
            write!(
                f,
                "\n  subdivision halves a step up to {} times where it cannot be made as one",
                self.subdivide
            )?;
        }
        write!(
            f,
            "\n  turn        {:.2e} rad a step at most in the first {} steps",
            self.largest_turn, self.trial_steps
        )?;
        match self.turn_limit {
            Some(limit) => write!(f, "; always solvable up to {limit:.2} rad")?,
            None => write!(f, "; solvable for any turn")?,
        }
        match &self.choice {
            Some(choice) => write!(f, "{choice}"),
            None => Ok(()),
        }
    }
}
