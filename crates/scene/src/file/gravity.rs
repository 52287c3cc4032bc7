use serde::Deserialize;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct GravityFile {
    pub central: Option<CentralFile>,
    pub uniform: Option<UniformFile>,
    pub mutual: Option<MutualFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CentralFile {
    pub gm: f64,
    pub j2: Option<f64>,
    pub reference_radius: Option<f64>,
    pub pole: Option<[f64; 3]>,
    #[serde(default)]
    pub position: [f64; 3],
    #[serde(default)]
    pub radius: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct UniformFile {
    pub acceleration: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MutualFile {
    pub constant: f64,
}
