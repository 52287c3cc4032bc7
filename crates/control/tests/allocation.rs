//! The Newton iteration does not allocate once it runs.

#![allow(clippy::expect_used)]
#![allow(dead_code, reason = "a case has more than this test needs")]

#[path = "suite/case.rs"]
mod case;

use allocation_counter::{AllocationInfo, measure};
use case::Case;
use lgvi_control::constraint::{KeepOutSphere, NormLimit, Place};
use lgvi_control::{
    Constraint, NewtonSettings, Phase, PlanError, Progress, Start, Transfer, solve,
};
use nalgebra::Vector3;

/// The allocations of a solution that is stopped after `iterations` iterations, counted with or without inequalities.
fn taken(transfer: &Transfer, constrained: bool, iterations: u32) -> AllocationInfo {
    // A single resolution, so that all iterations belong to one run.
    let settings = NewtonSettings {
        coarse: 60,
        ..NewtonSettings::default()
    };
    let mut seen = 0;
    let mut stopped = None;
    let info = measure(|| {
        let observe = |now: &Progress| {
            seen += u32::from((now.phase == Phase::Constrained) == constrained);
            seen <= iterations
        };
        stopped = solve(transfer, Start::Cold, &settings, observe).err();
    });
    assert!(
        matches!(stopped, Some(PlanError::Stopped { best: Some(_) })),
        "{iterations} iterations: {stopped:?}"
    );
    info
}

/// The allocations do not depend on the number of iterations.
#[test]
fn an_iteration_allocates_nothing() {
    let transfer = Case::load("C_ii").transfer(60);
    let sphere = KeepOutSphere::new(Vector3::new(-1.8, -1.7, -0.5), 0.2).expect("a sphere");
    let limit = NormLimit::new(Place::Position, 7.0).expect("a limit");
    let constraints = [Constraint::state(sphere), Constraint::commands(limit)];
    let bounded = transfer.clone().with_constraints(&constraints);
    for (transfer, constrained) in [(transfer, false), (bounded, true)] {
        let few = taken(&transfer, constrained, 1);
        assert!(few.count_total > 0, "constrained: {constrained}");
        for iterations in 2..=6 {
            let more = taken(&transfer, constrained, iterations);
            let counted = |info: &AllocationInfo| (info.count_total, info.bytes_total);
            assert_eq!(
                counted(&more),
                counted(&few),
                "constrained: {constrained}, {iterations} iterations"
            );
        }
    }
}
