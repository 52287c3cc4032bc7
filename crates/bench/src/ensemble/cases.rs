use lgvi_scene::Scene;

use crate::error::BenchError;
use crate::run::scene;

/// A scene whose samples are flown side by side and one after the other.
pub(super) struct Case {
    /// Name in the table.
    pub(super) name: &'static str,
    scene: &'static str,
    /// Lines of the scene, and what replaces them.
    lines: &'static [(&'static str, &'static str)],
    ensemble: &'static str,
}

pub(super) const CASES: [Case; 4] = [
    Case {
        name: "two dumbbells, `lgvi`",
        scene: "two_dumbbells",
        lines: &[],
        ensemble: SPREAD,
    },
    Case {
        name: "two dumbbells of equal transverse moments, `nystrom` 4",
        scene: "two_dumbbells",
        lines: &[
            (
                "integrator = \"lgvi\"",
                "integrator = { name = \"nystrom\", order = 4 }",
            ),
            ("steps = 15000", "steps = 3000"),
        ],
        ensemble: r#"
[ensemble]
samples = 1
seed = 1

[[ensemble.bodies]]
body = "dumbbell1"
position = 0.001
attitude = 0.01

[[ensemble.bodies]]
body = "dumbbell2"
velocity = 0.001
"#,
    },
    Case {
        name: "satellite round the oblate Earth, `nystrom` 6",
        scene: "oblate_orbit",
        lines: &[("steps = 8640", "steps = 2160")],
        ensemble: r#"
[ensemble]
samples = 1
seed = 1

[[ensemble.bodies]]
body = "satellite"
position = 100.0
attitude = 0.01
inertia = 0.01
"#,
    },
    Case {
        name: "binary asteroid, `nystrom` 8",
        scene: "binary_asteroid",
        lines: &[
            ("duration = 2592000.0", "duration = 259200.0"),
            ("steps = 8640", "steps = 864"),
        ],
        ensemble: r#"
[ensemble]
samples = 1
seed = 1

[[ensemble.bodies]]
body = "alpha"
inertia = 0.01

[[ensemble.bodies]]
body = "beta"
position = 1.0
attitude = 0.01
inertia = 0.01
"#,
    },
];

const SPREAD: &str = r#"
[ensemble]
samples = 1
seed = 1

[[ensemble.bodies]]
body = "dumbbell1"
position = 0.001
attitude = 0.01
inertia = 0.01

[[ensemble.bodies]]
body = "dumbbell2"
velocity = 0.001
mass = 0.01
"#;

impl Case {
    /// The scene with its ensemble. `steps` replaces 15 000 steps.
    pub(super) fn scene(&self, steps: u64) -> Result<Scene, BenchError> {
        let mut text = format!("{}{}", scene(self.scene)?.text, self.ensemble);
        for (line, instead) in self.lines {
            text = text.replace(line, instead);
        }
        let text = text.replace("steps = 15000", &format!("steps = {steps}"));
        Scene::parse(self.scene, &text).map_err(|source| BenchError::Scene {
            name: self.scene.into(),
            source,
        })
    }
}
