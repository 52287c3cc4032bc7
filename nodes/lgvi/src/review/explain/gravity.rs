use std::fmt;

use lgvi_scene::Scene;
use serde::Serialize;

/// What acts, in SI; each kind is there or not.
#[derive(Debug, Serialize)]
pub(super) struct Gravity {
    central: Option<Central>,
    /// (m/s²)
    uniform: Option<[f64; 3]>,
    /// Gravitational constant of the bodies' mutual attraction (m³/(kg s²)).
    mutual: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Central {
    name: Option<&'static str>,
    /// (m³/s²)
    gm: f64,
    j2: Option<f64>,
    /// (m)
    radius: f64,
    /// There are bodies that an atmosphere slows down.
    drag: bool,
}

impl Gravity {
    pub(super) fn of(scene: &Scene) -> Self {
        let units = &scene.units;
        let acceleration = units.length / (units.time * units.time);
        let area = units.length * units.length;
        let gravity = &scene.gravity;
        Self {
            central: gravity.central.as_ref().map(|central| Central {
                name: central.name,
                gm: central.gm * acceleration * area,
                j2: central.oblateness.map(|oblateness| oblateness.j2),
                radius: central.radius * units.length,
                drag: scene.has_drag(),
            }),
            uniform: gravity.uniform.map(|g| (g * acceleration).into()),
            mutual: gravity
                .mutual
                .map(|constant| constant * acceleration * area / units.mass),
        }
    }
}

impl fmt::Display for Gravity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(Central {
            name, gm, j2, drag, ..
        }) = &self.central
        {
            let shape = match j2 {
                Some(j2) => format!("oblate with J₂ = {j2:e}"),
                None => "a sphere or point".into(),
            };
            let name = name.unwrap_or("fixed attractor");
            let drag = if *drag { ", with drag" } else { "" };
            parts.push(format!("{name}, {shape}, GM = {gm:e} m³/s²{drag}"));
        }
        if let Some(g) = &self.uniform {
            parts.push(format!("uniform, {g:?} m/s²"));
        }
        if let Some(constant) = self.mutual {
            parts.push(format!("mutual, G = {constant:e} m³/(kg s²)"));
        }
        if parts.is_empty() {
            parts.push("none".into());
        }
        write!(f, "{}", parts.join("; "))
    }
}
