//! Payloads whose lengths promise far more than there is must cost no memory to match.

#![allow(clippy::unwrap_used)]
#![allow(unsafe_code, reason = "an allocator that records the largest request")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicUsize, Ordering},
};

use lgvi_msgs::{
    RosMessage, cdr,
    diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue},
    msg::{BodyState, SystemState},
    nav_msgs::Path,
    visualization_msgs::MarkerArray,
};

struct Recording;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

unsafe impl GlobalAlloc for Recording {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Recording = Recording;

/// serde reserves at most this much for a length it cannot check.
const RESERVE: usize = 1 << 20;

fn check<M: RosMessage>(message: &M) {
    let original = cdr::encode(message).unwrap();
    for offset in (4..original.len() - 3).step_by(4) {
        for length in [u32::MAX, u32::MAX / 2, 1 << 30, 1 << 24] {
            let mut bytes = original.clone();
            bytes[offset..offset + 4].copy_from_slice(&length.to_le_bytes());
            LARGEST.store(0, Ordering::Relaxed);
            // A number may have any value: whether this decodes is not the question.
            let _ = cdr::decode::<M>(&bytes);
            let largest = LARGEST.load(Ordering::Relaxed);
            assert!(
                largest <= RESERVE,
                "{largest} bytes for {} at {offset}",
                M::TYPE_NAME
            );
        }
    }
}

#[test]
fn memory_is_bounded() {
    let value = KeyValue {
        key: "steps".to_owned(),
        value: "12".to_owned(),
    };
    let status = DiagnosticStatus {
        values: vec![value; 3],
        ..Default::default()
    };
    check(&DiagnosticArray {
        status: vec![status; 2],
        ..Default::default()
    });
    check(&SystemState {
        bodies: vec![BodyState::default(); 2],
        ..Default::default()
    });
    check(&Path {
        poses: vec![Default::default(); 2],
        ..Default::default()
    });
    check(&MarkerArray {
        markers: vec![Default::default(); 2],
    });

    let claims_4_gib = b"\x00\x01\x00\x00\xff\xff\xff\xff";
    assert!(cdr::decode::<lgvi_msgs::std_msgs::String>(claims_4_gib).is_err());
    assert!(cdr::decode::<MarkerArray>(claims_4_gib).is_err());
}
