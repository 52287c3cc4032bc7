//! Newton's iteration allocates nothing once it runs.

#![allow(clippy::expect_used)]
#![allow(unsafe_code, reason = "an allocator that counts")]
#![allow(dead_code, reason = "a case has more than this test needs")]

#[path = "suite/case.rs"]
mod case;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use case::Case;
use lgvi_control::{Constraint, NewtonSettings, Phase, Progress, Start, solve};
use nalgebra::Vector3;

struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn an_iteration_allocates_nothing() {
    let transfer = Case::load("C_ii").transfer(60);
    // One resolution only, so that all iterations are of one run.
    let settings = NewtonSettings {
        coarse: 60,
        ..NewtonSettings::default()
    };
    let sphere = Constraint::KeepOutSphere {
        center: Vector3::new(-1.8, -1.7, -0.5),
        radius: 0.2,
    };
    let constraints = vec![sphere, Constraint::ForceNorm { limit: 7.0 }];
    let bounded = transfer
        .clone()
        .with_constraints(constraints)
        .expect("constraints");
    for (transfer, constrained) in [(transfer, false), (bounded, true)] {
        let mut counts = Vec::with_capacity(1000);
        let observe = |now: &Progress| {
            if (now.phase == Phase::Constrained) == constrained {
                counts.push(COUNT.load(Ordering::Relaxed));
            }
            true
        };
        solve(&transfer, Start::Cold, &settings, observe).expect("a plan");
        assert!(counts.len() > 5);
        assert!(
            counts.windows(2).all(|pair| pair[0] == pair[1]),
            "{counts:?}"
        );
    }
}
