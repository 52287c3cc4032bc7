use std::sync::Arc;

use lgvi_dynamics::drag::Atmosphere;
use lgvi_dynamics::gravity::{Moments, Multipole, Polyhedron};
use lgvi_dynamics::{BodyError, Drive, Inertia, Mobility, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::actuators;
use super::polyhedron::{DEGREE, polyhedron, work as work_of};
use crate::file::{BodyFile, InertiaFile, MobilityFile, MultipoleFile, PointFile, PolyhedronFile};
use crate::{SceneError, check};

/// Compiles the body whose keys begin with `key`, and its surface if the file gives one. Subtracts the cost of its point
/// cloud from `work`.
pub(super) fn body(
    key: &str,
    file: &BodyFile,
    atmosphere: Option<&Arc<Atmosphere>>,
    work: &mut u64,
) -> Result<(RigidBody, Option<Polyhedron>), SceneError> {
    check::name(&format!("{key}.name"), &file.name)?;
    let mobility = mobility(&format!("{key}.mobility"), &file.mobility)?;
    let (body, mesh) = rigid_body(key, file, &mobility, work)?;
    let body = body
        .with_mobility(mobility)
        .with_radius(file.radius)
        .map_err(|_| {
            SceneError::value(format!("{key}.radius"), file.radius, "a finite number ≥ 0")
        })?;
    let mut body = actuators::with_actuators(key, file, body)?;
    if let Some(drag) = file.drag {
        let key = format!("{key}.drag");
        if *body.mobility() != Mobility::Free {
            let expected = "none: only a free body is slowed down";
            return Err(SceneError::value(key, drag.area, expected));
        }
        body = body.with_drag(drag.parse(&key, atmosphere)?);
    }
    Ok((body, mesh))
}

fn mobility(key: &str, file: &MobilityFile) -> Result<Mobility, SceneError> {
    let vector = |name: &str, value| check::vector(&format!("{key}.{name}"), value);
    Ok(match *file {
        MobilityFile::Free => Mobility::Free,
        MobilityFile::Pivoted => Mobility::Pivoted,
        MobilityFile::Fixed => Mobility::Fixed,
        MobilityFile::Uniform { velocity, spin } => Mobility::Driven(Drive::uniform(
            vector("uniform.velocity", velocity)?,
            vector("uniform.spin", spin)?,
        )),
        MobilityFile::Circle { center, rate, spin } => Mobility::Driven(Drive::circle(
            vector("circle.center", center)?,
            vector("circle.rate", rate)?,
            vector("circle.spin", spin)?,
        )),
    })
}

/// Returns the body, and its surface if the file gives one.
fn rigid_body(
    key: &str,
    file: &BodyFile,
    mobility: &Mobility,
    work: &mut u64,
) -> Result<(RigidBody, Option<Polyhedron>), SceneError> {
    let refuse = |error: BodyError| {
        let expected = format!("the masses of a rigid body: {error}");
        SceneError::value(key, &file.name, expected)
    };
    check::positive(&format!("{key}.mass"), file.mass)?;
    let points: Vec<_> = file.points.iter().map(point).collect();
    match (&file.multipole, &file.polyhedron) {
        (Some(_), Some(_)) => {
            let expected = "a `multipole` or a `polyhedron`, not both";
            Err(SceneError::value(key, &file.name, expected))
        }
        (Some(multipole), None) => {
            let (inertia, multipole) = expansion(key, file, multipole, points)?;
            let body = RigidBody::with_multipole(inertia, multipole).map_err(refuse)?;
            Ok((body, None))
        }
        (None, Some(_)) if !points.is_empty() => {
            let key = format!("{key}.points");
            let expected = "none beside a `polyhedron`";
            Err(SceneError::value(key, points.len(), expected))
        }
        (None, Some(shape)) => {
            let (body, mesh) = solid(key, file, shape, work)?;
            Ok((body, Some(mesh)))
        }
        (None, None) => {
            let inertia = given_inertia(key, file)?;
            let body = if *mobility == Mobility::Pivoted {
                RigidBody::pivoted(file.mass, inertia, points)
            } else {
                RigidBody::new(file.mass, inertia, points)
            };
            Ok((body.map_err(refuse)?, None))
        }
    }
}

/// Returns a body that is defined by its `polyhedron`, and the polyhedron.
fn solid(
    key: &str,
    file: &BodyFile,
    shape: &PolyhedronFile,
    work: &mut u64,
) -> Result<(RigidBody, Polyhedron), SceneError> {
    let key_of_shape = format!("{key}.polyhedron");
    let polyhedron = polyhedron(&key_of_shape, shape, file.mass)?;
    let inertia = match &file.inertia {
        Some(_) => Some(given_inertia(key, file)?),
        None => None,
    };
    let degree = shape.degree.unwrap_or(DEGREE);
    *work = work
        .checked_sub(work_of(&polyhedron, degree))
        .ok_or_else(|| {
            let key = format!("{key_of_shape}.degree");
            let expected = format!(
                "a lower degree or fewer faces than {}, of all bodies together",
                polyhedron.faces().len()
            );
            SceneError::value(key, degree, expected)
        })?;
    let body = RigidBody::with_polyhedron(inertia, &polyhedron, degree);
    let body = body.map_err(|error| match error {
        BodyError::CloudDegree(_) | BodyError::Polyhedron(_) => {
            let expected = format!("2 to 10: {error}");
            SceneError::value(format!("{key_of_shape}.degree"), degree, expected)
        }
        _ => {
            let expected = format!("the shape of a rigid body: {error}");
            SceneError::value(key_of_shape, &file.name, expected)
        }
    })?;
    Ok((body, polyhedron))
}

/// Returns the inertia and the multipole expansion of a body that is defined by its `multipole`.
fn expansion(
    key: &str,
    file: &BodyFile,
    multipole: &MultipoleFile,
    points: Vec<PointMass>,
) -> Result<(Inertia, Multipole), SceneError> {
    let &MultipoleFile { order, ellipsoid } = multipole;
    let mass = file.mass;
    let refuse = |value: &dyn std::fmt::Debug, name: &str, expected: &str| {
        Err(SceneError::value(format!("{key}.{name}"), value, expected))
    };
    match (order, ellipsoid) {
        (2, None) if points.is_empty() => {
            let inertia = given_inertia(key, file)?;
            let multipole = Multipole::of_inertia(mass, &inertia);
            Ok((inertia, multipole))
        }
        (2, None) => refuse(
            &file.points.len(),
            "points",
            "none: a multipole of order 2 is that of the inertia",
        ),
        (2, Some(axes)) => refuse(
            &axes,
            "multipole.ellipsoid",
            "none: a multipole of order 2 is that of the inertia",
        ),
        (4, Some(axes)) if points.is_empty() => {
            if !axes.iter().all(|a| a.is_finite() && *a > 0.0) {
                let expected = "three semi-axes, finite numbers > 0";
                return refuse(&axes, "multipole.ellipsoid", expected);
            }
            let moments = Moments::of_ellipsoid(mass, axes);
            let inertia = match &file.inertia {
                Some(_) => given_inertia(key, file)?,
                None => homogeneous(key, axes, &moments.second)?,
            };
            Ok((inertia, Multipole::of_moments(mass, &moments)))
        }
        (4, None) if !points.is_empty() => {
            let inertia = given_inertia(key, file)?;
            // Validate the points even though the body does not keep them.
            RigidBody::new(mass, inertia.clone(), points.clone()).map_err(|error| {
                let expected = format!("the masses of a rigid body: {error}");
                SceneError::value(key, &file.name, expected)
            })?;
            let moments = Moments::of_points(&points);
            Ok((inertia, Multipole::of_moments(mass, &moments)))
        }
        (4, _) => refuse(
            &order,
            "multipole.order",
            "`ellipsoid` or the body's `points`, one of them, for order 4",
        ),
        _ => refuse(&order, "multipole.order", "2 or 4"),
    }
}

fn point(file: &PointFile) -> PointMass {
    PointMass {
        mass: file.mass,
        position: Vector3::from(file.position),
    }
}

fn given_inertia(key: &str, file: &BodyFile) -> Result<Inertia, SceneError> {
    let key = format!("{key}.inertia");
    match &file.inertia {
        Some(given) => inertia(&key, given),
        None => {
            let expected = "three principal moments or a 3×3 matrix";
            Err(SceneError::missing(key, expected))
        }
    }
}

pub(super) fn inertia(key: &str, file: &InertiaFile) -> Result<Inertia, SceneError> {
    let (matrix, written) = match file {
        InertiaFile::Principal(moments) => (
            Matrix3::from_diagonal(&Vector3::from(*moments)),
            format!("{moments:?}"),
        ),
        InertiaFile::Matrix(rows) => (check::matrix(*rows), format!("{rows:?}")),
    };
    Inertia::new(matrix).map_err(|error| SceneError::Value {
        line: None,
        key: key.to_owned(),
        value: written,
        expected: format!("the inertia of a rigid body: {error}"),
    })
}

/// Returns the inertia that follows from the moments `∫ρρᵀ dm` of an ellipsoid.
fn homogeneous(key: &str, axes: [f64; 3], second: &Matrix3<f64>) -> Result<Inertia, SceneError> {
    let matrix = Matrix3::from_diagonal_element(second.trace()) - second;
    Inertia::new(matrix).map_err(|error| {
        let expected = format!("an ellipsoid that is a rigid body: {error}");
        SceneError::value(format!("{key}.multipole.ellipsoid"), axes, expected)
    })
}
