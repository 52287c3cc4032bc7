//! Quality of service as DDS policies.

use rustdds::{
    QosPolicies, QosPolicyBuilder,
    policy::{Durability, History, Reliability, ResourceLimits},
};

use crate::ros::Qos;

/// The fewest samples RustDDS keeps for a subscription, whatever its depth; it frees none before there are more.
const MIN_CACHE: usize = 64;

/// RustDDS gives up waiting only when it is woken; the limits are kept by us.
const NEVER: rustdds::Duration = rustdds::Duration::from_secs(1 << 20);

/// Policies of a publisher.
pub(super) fn offered(qos: &Qos) -> QosPolicies {
    policies(qos, qos.reliable && !qos.volatile, qos.window())
}

/// Policies of a subscription.
pub(super) fn requested(qos: &Qos) -> QosPolicies {
    policies(qos, qos.latched, qos.depth().max(MIN_CACHE))
}

fn policies(qos: &Qos, durable: bool, max_samples: usize) -> QosPolicies {
    let count = |count: usize| i32::try_from(count.max(1)).unwrap_or(i32::MAX);
    QosPolicyBuilder::new()
        .reliability(if qos.reliable {
            Reliability::Reliable {
                max_blocking_time: NEVER,
            }
        } else {
            Reliability::BestEffort
        })
        .durability(if durable {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        })
        .history(History::KeepLast {
            depth: count(qos.depth()),
        })
        .resource_limits(ResourceLimits {
            max_samples: count(max_samples),
            max_instances: 1,
            max_samples_per_instance: count(max_samples),
        })
        .build()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_offered_satisfies_what_is_requested() {
        let presets = [
            Qos::latched(1),
            Qos::reliable(10),
            Qos::volatile(10),
            Qos::sensor(5),
        ];
        let matching: Vec<Vec<bool>> = presets
            .iter()
            .map(|publisher| {
                presets
                    .iter()
                    .map(|subscription| {
                        offered(publisher)
                            .compliance_failure_wrt(&requested(subscription))
                            .is_none()
                    })
                    .collect()
            })
            .collect();
        assert_eq!(
            matching,
            [
                [true; 4],
                [true; 4],
                [false, true, true, true],
                [false, false, false, true]
            ],
            "rows are publishers, columns subscriptions: latched, reliable, volatile, sensor"
        );
    }
}
