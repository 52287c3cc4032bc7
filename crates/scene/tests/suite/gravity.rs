use lgvi_dynamics::Load;
use lgvi_scene::Scene;
use nalgebra::Vector3;

use crate::{BODY, RUN, assert_refused, with};

fn text(gravity: &str) -> String {
    format!("{RUN}\n{gravity}\n[[bodies]]\nname = \"body\"{BODY}")
}

/// Returns the force on the body of mass 2 at (3, 0, 0).
fn force(gravity: &str) -> Vector3<f64> {
    let scene = Scene::parse("test", &text(gravity)).unwrap();
    let mut loads = [Load::default()];
    scene.system().loads(&[scene.bodies[0].state], &mut loads);
    loads[0].force
}

/// In the plane of the equator an oblate planet pulls with `GM/r² (1 + 3/2 J₂ (a/r)²)`, above the pole with
/// `GM/r² (1 − 3 J₂ (a/r)²)`.
#[test]
fn fields_are_where_and_as_strong_as_the_scene_says() {
    let point = "[gravity.central]\ngm = 9.0\n";
    assert_eq!(force(point), Vector3::new(-2.0, 0.0, 0.0));
    let placed = "[gravity.central]\ngm = 9.0\nposition = [3, 3, 0]\n";
    assert_eq!(force(placed), Vector3::new(0.0, 2.0, 0.0));
    let planet = format!("{point}j2 = 0.06\nreference_radius = 1.5\n");
    let pull = 2.0 * (1.0 + 1.5 * 0.06 * 0.25);
    assert!((force(&planet) - Vector3::new(-pull, 0.0, 0.0)).norm() < 1e-15);
    let tipped = format!("{planet}pole = [-7, 0, 0]\n");
    let pull = 2.0 * (1.0 - 3.0 * 0.06 * 0.25);
    assert!((force(&tipped) - Vector3::new(-pull, 0.0, 0.0)).norm() < 1e-15);
    let both = format!("{point}[gravity.uniform]\nacceleration = [0, 0, -9.81]\n");
    assert_eq!(force(&both), Vector3::new(-2.0, 0.0, -19.62));
}

#[test]
fn mistakes_in_gravity_are_named() {
    for (gravity, parts) in [
        (
            "[gravity.central]\ngm = -1.0\n",
            &["`gravity.central.gm` is -1.0", "> 0"][..],
        ),
        (
            "[gravity.central]\ngm = 1.0\nj2 = 1e-3\n",
            &["`gravity.central.reference_radius` is missing", "`j2`"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nreference_radius = 1.0\n",
            &["`gravity.central.j2` is missing", "`reference_radius`"],
        ),
        (
            "[gravity.central]\ngm = 1.0\npole = [0, 0, 1]\n",
            &["`gravity.central.j2` is missing", "`pole`"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nj2 = 1.0\nreference_radius = 1\npole = [0, 0, 0]\n",
            &["`gravity.central.pole`", "[0.0, 0.0, 0.0]", "direction"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nj2 = nan\nreference_radius = 1\n",
            &["`gravity.central.j2` is NaN", "finite"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nradius = -2.0\n",
            &["`gravity.central.radius` is -2.0", "≥ 0"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nradius = 5.0\n",
            &["`bodies[0].position` is 3.0", "at least 5", "attractor"],
        ),
        (
            "[gravity.uniform]\nacceleration = [0, inf, 0]\n",
            &["`gravity.uniform.acceleration`", "inf", "finite"],
        ),
        (
            "[gravity.uniform]\nacceleration = 9.81\n",
            &["9.81", "array of length 3"],
        ),
        (
            "[gravity.mutual]\nconstant = 0\n",
            &["`gravity.mutual.constant` is 0.0", "> 0"],
        ),
        (
            "[gravity.center]\ngm = 1.0\n",
            &[
                "unknown field `center`",
                "`central`",
                "`uniform`",
                "`mutual`",
            ],
        ),
    ] {
        assert_refused(&text(gravity), parts);
    }
}

#[test]
fn bodies_that_start_inside_each_other_are_refused() {
    let other = with(BODY, "[3.0, 0.0, 0.0]", "[3.5, 0.0, 0.0]");
    let other = with(&other, "mass = 2.0", "mass = 2.0\nradius = 0.6");
    let text = format!(
        "{}\n[[bodies]]\nname = \"other\"{other}",
        text("[gravity.mutual]\nconstant = 1.0")
    );
    let parts = ["`bodies[0].position` is 0.5", "at least 0.6", "other"];
    assert_refused(&text, &parts);
}
