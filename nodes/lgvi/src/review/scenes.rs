//! The scenes that are shipped.

macro_rules! shipped {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!("../../../../scenes/", $name, ".toml")),
        )
    };
}
/// Names and texts of the shipped scenes.
pub const SCENES: [(&str, &str); 31] = [
    shipped!("asteroid_orbiter"),
    shipped!("binary_asteroid"),
    shipped!("dispersed_capture"),
    shipped!("docking"),
    shipped!("docking_corridor"),
    shipped!("earth_mars"),
    shipped!("formation_change"),
    shipped!("free_body"),
    shipped!("goddard"),
    shipped!("inclination_change"),
    shipped!("inclination_replan"),
    shipped!("inspection"),
    shipped!("low_orbit_approach"),
    shipped!("minimum_fuel"),
    shipped!("minimum_time_slew"),
    shipped!("oblate_orbit"),
    shipped!("orbital_capture"),
    shipped!("pendulum"),
    shipped!("phased_docking"),
    shipped!("propellant_transfer"),
    shipped!("relative_orbit"),
    shipped!("rocks"),
    shipped!("slew_keep_out"),
    shipped!("thruster_approach"),
    shipped!("thruster_rendezvous"),
    shipped!("tumbling_replan"),
    shipped!("tumbling_target"),
    shipped!("two_dumbbells"),
    shipped!("uncertain_flyaround"),
    shipped!("wheel_slew"),
    shipped!("wheel_slew_plan"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_scene_is_there() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
        let files = std::fs::read_dir(folder).unwrap();
        let paths = files.map(|file| file.unwrap().path());
        let scenes = paths.filter(|path| path.extension().is_some_and(|end| end == "toml"));
        let mut names: Vec<_> = scenes
            .map(|path| path.file_stem().unwrap().to_owned())
            .collect();
        names.sort();
        assert_eq!(names, SCENES.map(|(name, _)| name));
    }
}
