use nalgebra::SVector;

use super::*;
use crate::{Certificate, Plan, Sweep};

fn family(final_time: f64) -> MinimumTime {
    MinimumTime {
        plan: Plan {
            h: final_time,
            states: Vec::new(),
            commands: Vec::new(),
            controls: Vec::new(),
            multipliers: vec![SVector::zeros()],
            feedback: Vec::new(),
            actuator_feedback: Vec::new(),
            cost: 1.0,
            paid: 0.0,
            certificate: Certificate::default(),
            sweep: Sweep::default(),
        },
        final_time,
        lower_bound: 0.0,
        not_found: None,
        solves: 1,
    }
}

#[test]
fn a_family_that_fails_leaves_the_best_one() {
    let best = Some(family(2.0));
    let after = |found| shorter(best.clone(), found).map(|best| best.map(|best| best.final_time));
    assert_eq!(after(Ok(family(1.0))), Ok(Some(1.0)));
    assert_eq!(after(Ok(family(3.0))), Ok(Some(2.0)));
    let capped = FinalTimeError::NotConverged {
        solves: 100,
        final_time: 1.5,
        slope: -1.0,
    };
    assert_eq!(after(Err(capped)), Ok(Some(2.0)));
    let missing = PlanError::Between {
        constraint: 0,
        step: 1,
        violation: 0.1,
        best: None,
    };
    assert_eq!(after(Err(failed(1.5, missing))), Ok(Some(2.0)));
    let stopped = || failed(1.5, PlanError::Stopped { best: None });
    assert_eq!(after(Err(stopped())), Err(stopped()));
}
