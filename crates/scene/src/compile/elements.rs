use crate::angle::{AngleFile, angle};
use crate::file::ElementsFile;
use crate::orbit::{Elements, true_anomaly};
use crate::{SceneError, check};

/// The least `1 + e cos ν` on a hyperbola whose mean anomaly is given: rounding changes the distance by 1e-8 of it there.
const ASYMPTOTE: f64 = 1e-8;

/// Compiles the orbital elements at `key`.
pub(super) fn elements(key: &str, file: &ElementsFile) -> Result<Elements, SceneError> {
    let at = |name: &str| format!("{key}.{name}");
    let e = check::not_negative(&at("eccentricity"), file.eccentricity)?;
    let angle = |name: &'static str, file: &AngleFile| {
        let angle = angle(name, file).map_err(|error| SceneError::parameter(at(name), error))?;
        if angle.is_finite() {
            return Ok(angle);
        }
        Err(SceneError::value(at(name), angle, "a finite angle"))
    };
    let optional = |name, file: &Option<AngleFile>| match file {
        Some(file) => angle(name, file),
        None => Ok(0.0),
    };
    Ok(Elements {
        periapsis: periapsis(&at, file)?,
        eccentricity: e,
        inclination: optional("inclination", &file.inclination)?,
        raan: optional("raan", &file.raan)?,
        argument_of_periapsis: optional("argument_of_periapsis", &file.argument_of_periapsis)?,
        true_anomaly: match (&file.true_anomaly, &file.mean_anomaly) {
            (Some(_), Some(_)) => {
                let expected = "one of `true_anomaly` and `mean_anomaly`";
                return Err(SceneError::value(at("mean_anomaly"), "given", expected));
            }
            (None, Some(_)) if e == 1.0 => {
                let expected = "none on a parabola; give the `true_anomaly`";
                return Err(SceneError::value(at("mean_anomaly"), "given", expected));
            }
            (None, Some(mean)) => {
                let mean = angle("mean_anomaly", mean)?;
                let anomaly = true_anomaly(e, mean);
                // Of a hyperbola, so near the asymptote the true anomaly does not tell the distance.
                if e > 1.0 && 1.0 + e * libm::cos(anomaly) < ASYMPTOTE {
                    let expected = "an anomaly farther from the asymptote of the hyperbola";
                    return Err(SceneError::value(at("mean_anomaly"), mean, expected));
                }
                anomaly
            }
            (given, None) => {
                let anomaly = optional("true_anomaly", given)?;
                if 1.0 + e * libm::cos(anomaly) <= 0.0 {
                    let limit = libm::acos(-1.0 / e);
                    let expected = format!(
                        "an angle between −{limit} and {limit} rad, the asymptotes of eccentricity {e}"
                    );
                    return Err(SceneError::value(at("true_anomaly"), anomaly, expected));
                }
                anomaly
            }
        },
    })
}

/// Returns the distance of the periapsis.
fn periapsis(at: &dyn Fn(&str) -> String, file: &ElementsFile) -> Result<f64, SceneError> {
    let e = file.eccentricity;
    match (file.semi_major_axis, file.periapsis) {
        (None, Some(periapsis)) => check::positive(&at("periapsis"), periapsis),
        (Some(axis), None) => {
            let expected = if e < 1.0 {
                "a finite number > 0 on an ellipse"
            } else if e > 1.0 {
                "a finite number < 0 on a hyperbola"
            } else {
                "none on a parabola, which has no such axis; give the `periapsis`"
            };
            let periapsis = axis * (1.0 - e);
            if periapsis.is_finite() && periapsis > 0.0 {
                Ok(periapsis)
            } else {
                Err(SceneError::value(at("semi_major_axis"), axis, expected))
            }
        }
        (Some(axis), Some(_)) => {
            let expected = "none beside `periapsis`";
            Err(SceneError::value(at("semi_major_axis"), axis, expected))
        }
        (None, None) => {
            let expected = "a number, or the `periapsis`";
            Err(SceneError::missing(at("semi_major_axis"), expected))
        }
    }
}
