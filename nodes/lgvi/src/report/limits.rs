//! What a maneuver keeps to: what it looks like, and what it bounds over time, in SI units.

use lgvi_control::constraint::{ComponentLimit, Moving, NormLimit, Region};
use lgvi_control::{Constraint, Place};
use lgvi_scene::{Maneuver, Units};
use serde::Serialize;

use super::packed::{FrameMotion, Packed, quaternion};
use crate::plot::data::{FlightData, Sample};
use crate::plot::margins::Margin;

/// What the maneuver keeps to, in its frame.
#[derive(Serialize)]
pub(super) struct Kept {
    /// `None` for what is only plotted.
    #[serde(flatten)]
    limit: Option<Limit>,
    /// Whether a violation has a price instead of being forbidden.
    soft: bool,
    /// Where its frame is, at the times of the states; `None` for the inertial frame.
    frame: Option<FrameMotion>,
    plot: Option<Plot>,
}

/// What a limit bounds, at the times of the states.
#[derive(Serialize)]
struct Plot {
    title: &'static str,
    unit: &'static str,
    bound: f64,
    /// Whether the values are to be above the bound, not below.
    least: bool,
    values: Packed,
}

/// An `axis` is that of the body, in its frame; that of a corridor is in the frame of the limit.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Limit {
    KeepOutEllipsoid {
        center: [f64; 3],
        semi_axes: [f64; 3],
        /// w, x, y, z
        axes: [f64; 4],
    },
    KeepInSphere {
        center: [f64; 3],
        radius: f64,
    },
    KeepOutCone {
        axis: [f64; 3],
        direction: [f64; 3],
        half_angle: f64,
    },
    Corridor {
        apex: [f64; 3],
        axis: [f64; 3],
        half_angle: f64,
    },
    LineOfSight {
        axis: [f64; 3],
        point: [f64; 3],
        half_angle: f64,
    },
    Plume {
        axis: [f64; 3],
        point: [f64; 3],
        half_angle: f64,
        distance: f64,
    },
    /// (N) or (N m); JSON has no infinity, and so `null` is no limit.
    Norm {
        of: &'static str,
        limit: f64,
    },
    Components {
        of: &'static str,
        limits: [f64; 3],
    },
}

/// Those that can be drawn or plotted.
pub(super) fn limits(data: &FlightData, samples: &[&Sample], maneuver: &Maneuver) -> Vec<Kept> {
    let scene = &data.scene;
    let units = &scene.units;
    let always = maneuver.constraints.iter().map(|one| (one, true));
    let phases = maneuver.phases.iter();
    let in_phases = phases.flat_map(|phase| phase.constraints.iter().map(|one| (one, false)));
    let limits = always.chain(in_phases).filter_map(|(constraint, always)| {
        let limit = match constraint.region() {
            Some(region) => drawn(region, units.length),
            // What holds in a phase is not plotted over the whole flight.
            None if always => on_load(constraint, units),
            None => None,
        };
        let samples_of = samples.iter().copied().filter(|_| always);
        let plot = Margin::of(data, maneuver.body, constraint, samples_of).map(|margin| {
            let mut values = Packed::default();
            values.push(&margin.values);
            Plot {
                title: margin.title,
                unit: margin.unit,
                bound: margin.bound,
                least: margin.is_least,
                values,
            }
        });
        let moving = constraint.downcast_ref::<Moving>();
        let frame = moving.map(|moving| {
            let mut motion = FrameMotion::default();
            for sample in samples {
                let pose = moving.pose(scene.h() * sample.step as f64);
                motion.push(&(pose.origin * units.length), &pose.rotation);
            }
            motion
        });
        (limit.is_some() || plot.is_some()).then_some(Kept {
            limit,
            soft: constraint.price().is_some(),
            frame,
            plot,
        })
    });
    limits.collect()
}

/// A region of states as it is drawn, with the unit of length (m).
fn drawn(region: Region, length: f64) -> Option<Limit> {
    Some(match region {
        Region::OutsideEllipsoid {
            center,
            semi_axes,
            axes,
        } => Limit::KeepOutEllipsoid {
            center: (center * length).into(),
            semi_axes: (semi_axes * length).into(),
            axes: quaternion(&axes),
        },
        Region::InsideSphere { center, radius } => Limit::KeepInSphere {
            center: (center * length).into(),
            radius: radius * length,
        },
        Region::OutsideCone {
            axis,
            direction,
            half_angle,
        } => Limit::KeepOutCone {
            axis: axis.into(),
            direction: direction.into(),
            half_angle,
        },
        Region::Corridor {
            apex,
            axis,
            half_angle,
        } => Limit::Corridor {
            apex: (apex * length).into(),
            axis: axis.into(),
            half_angle,
        },
        Region::InSight {
            axis,
            point,
            half_angle,
        } => Limit::LineOfSight {
            axis: axis.into(),
            point: (point * length).into(),
            half_angle,
        },
        Region::OutsidePlume {
            axis,
            point,
            half_angle,
            distance,
        } => Limit::Plume {
            axis: axis.into(),
            point: (point * length).into(),
            half_angle,
            distance: distance * length,
        },
        Region::AngularRate { .. } | Region::Speed { .. } => return None,
    })
}

/// A limit of force or moment.
fn on_load(constraint: &Constraint, units: &Units) -> Option<Limit> {
    let of = |place| match place {
        Place::Position => ("force", units.force()),
        Place::Attitude => ("moment", units.energy()),
    };
    if let Some(norm) = constraint.downcast_ref::<NormLimit>() {
        let (of, unit) = of(norm.place());
        let limit = norm.limit() * unit;
        return Some(Limit::Norm { of, limit });
    }
    let components = constraint.downcast_ref::<ComponentLimit>()?;
    let (of, unit) = of(components.place());
    let limits = (components.limit() * unit).into();
    Some(Limit::Components { of, limits })
}
