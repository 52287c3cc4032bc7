use crate::file::{CentralFile, GravityFile};
use crate::gravity::{CentralAttractor, Oblateness, SceneGravity};
use crate::{SceneError, check};

pub(super) fn gravity(file: &GravityFile) -> Result<SceneGravity, SceneError> {
    let (central, uniform, mutual) = (&file.central, &file.uniform, &file.mutual);
    Ok(SceneGravity {
        central: central.as_ref().map(attractor).transpose()?,
        uniform: uniform
            .as_ref()
            .map(|file| check::vector("gravity.uniform.acceleration", file.acceleration))
            .transpose()?,
        mutual: mutual
            .as_ref()
            .map(|file| check::positive("gravity.mutual.constant", file.constant))
            .transpose()?,
    })
}

fn attractor(file: &CentralFile) -> Result<CentralAttractor, SceneError> {
    let gm = check::positive("gravity.central.gm", file.gm)?;
    let position = check::vector("gravity.central.position", file.position)?;
    let oblateness = oblateness(file)?;
    CentralAttractor::new(gm, position, file.radius, oblateness).map_err(|_| {
        SceneError::value("gravity.central.radius", file.radius, "a finite number ≥ 0")
    })
}

fn oblateness(file: &CentralFile) -> Result<Option<Oblateness>, SceneError> {
    let Some(j2) = file.j2 else {
        let unused = [
            ("reference_radius", file.reference_radius.is_some()),
            ("pole", file.pole.is_some()),
        ];
        return match unused.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(SceneError::missing(
                "gravity.central.j2",
                format!("a number, as there is a `{key}`"),
            )),
            None => Ok(None),
        };
    };
    let radius = file.reference_radius.ok_or_else(|| {
        SceneError::missing(
            "gravity.central.reference_radius",
            "the radius that belongs to `j2`",
        )
    })?;
    let pole = file.pole.unwrap_or([0.0, 0.0, 1.0]);
    let length = check::vector("gravity.central.pole", pole)?.norm();
    if !length.is_normal() {
        let expected = "the direction of the pole, of any length > 0";
        return Err(SceneError::value("gravity.central.pole", pole, expected));
    }
    if !j2.is_finite() {
        return Err(SceneError::value(
            "gravity.central.j2",
            j2,
            "a finite number",
        ));
    }
    Ok(Some(Oblateness {
        j2,
        reference_radius: check::positive("gravity.central.reference_radius", radius)?,
        pole: nalgebra::Vector3::from(pole) / length,
    }))
}
