use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::{ChartOrigin, KeplerScheme, Quadrature, Rotor};
use lgvi_scene::{Integration, Scene};

use crate::{BODY, RUN, assert_refused, with};

fn text(integrator: &str) -> String {
    let run = with(RUN, "integrator = \"lgvi\"", integrator);
    format!("{run}\n[[bodies]]\nname = \"body\"{BODY}")
}

fn method(integrator: &str) -> Method {
    let scene = Scene::parse("test", &text(integrator)).unwrap();
    match scene.integration {
        Integration::Method(method) => method,
        other => panic!("{other:?}"),
    }
}

#[test]
fn integrators_are_named_by_a_word_or_a_table() {
    let cayley = Rotor::Discrete;
    for (integrator, expected) in [
        (r#"integrator = "lgvi""#, Method::Lgvi(cayley)),
        (r#"integrator = "lie_euler""#, Method::LieEuler(cayley)),
        (r#"integrator = { name = "lgvi" }"#, Method::Lgvi(cayley)),
        (
            r#"integrator = { name = "lgvi", rotor = "discrete" }"#,
            Method::Lgvi(cayley),
        ),
        (r#"integrator = "lgvi_lagrangian""#, Method::LagrangianLgvi),
        (
            r#"integrator = { name = "composition", order = 8 }"#,
            Method::Composition {
                order: 8,
                rotor: cayley,
            },
        ),
        (
            r#"integrator = { name = "nystrom", order = 6 }"#,
            Method::Nystrom { order: 6 },
        ),
        (
            r#"integrator = { name = "galerkin", degree = 3 }"#,
            Method::Galerkin {
                degree: 3,
                quadrature: Quadrature::Gauss(3),
                origin: ChartOrigin::Middle,
            },
        ),
        (
            r#"integrator = { name = "euler_poincare", degree = 2, quadrature = "lobatto", origin = "start" }"#,
            Method::EulerPoincare {
                degree: 2,
                quadrature: Quadrature::Lobatto(3),
                origin: ChartOrigin::Start,
            },
        ),
        (
            r#"integrator = { name = "galerkin", degree = 2, points = 5 }"#,
            Method::Galerkin {
                degree: 2,
                quadrature: Quadrature::Gauss(5),
                origin: ChartOrigin::Middle,
            },
        ),
        (r#"integrator = "closed_form""#, Method::ClosedForm),
        (
            r#"integrator = "explicit_midpoint""#,
            Method::ExplicitMidpoint,
        ),
        (
            r#"integrator = "implicit_midpoint""#,
            Method::ImplicitMidpoint,
        ),
        (r#"integrator = "crouch_grossman""#, Method::CrouchGrossman),
        (r#"integrator = "runge_kutta4""#, Method::RungeKutta4),
        (
            r#"integrator = { name = "fehlberg78", tolerance = 1e-9 }"#,
            Method::Fehlberg78 { tolerance: 1e-9 },
        ),
        (
            r#"integrator = { name = "dormand_prince853", tolerance = 1e-9 }"#,
            Method::DormandPrince853 { tolerance: 1e-9 },
        ),
        (
            r#"integrator = { name = "taylor", tolerance = 1e-9 }"#,
            Method::Taylor { tolerance: 1e-9 },
        ),
    ] {
        assert_eq!(method(integrator), expected, "{integrator}");
    }
}

#[test]
fn unknown_integrators_and_keys_are_named() {
    for (integrator, parts) in [
        (
            r#"integrator = "rk4""#,
            &["unknown variant `rk4`", "`lgvi`", "`nystrom`"][..],
        ),
        (
            r#"integrator = { name = "rk4" }"#,
            &["unknown variant `rk4`", "`lgvi`"],
        ),
        (r#"integrator = { order = 4 }"#, &["missing field `name`"]),
        (
            r#"integrator = 4"#,
            &["integer `4`", "name of an integrator"],
        ),
        (
            r#"integrator = { name = "lgvi", order = 4 }"#,
            &["unknown field `order`", "`rotor`"],
        ),
        (r#"integrator = "composition""#, &["missing field `order`"]),
        (
            r#"integrator = { name = "composition", order = -4 }"#,
            &["`-4`"],
        ),
        (
            r#"integrator = { name = "composition", order = 5 }"#,
            &["`run.integrator.order` is 5", "4, 6, 8 or 10"],
        ),
        (
            r#"integrator = { name = "lgvi", rotor = "round" }"#,
            &["unknown variant `round`", "`discrete`"],
        ),
        (
            r#"integrator = { name = "auto", tolerance = 1e-20 }"#,
            &["`run.integrator.tolerance` is 1e-20", "1e-14 to 0.1"],
        ),
        (
            "integrator = \"auto\"\nsubsteps = 3",
            &["`run.substeps` is 3", "none", "`auto`"],
        ),
        (
            r#"integrator = { name = "lgvi", rotor = "preprocessed" }"#,
            &["`preprocessed`", "`discrete`", "`exact`"],
        ),
        (
            r#"integrator = { name = "nystrom", order = 6, rotor = "discrete" }"#,
            &["unknown field `rotor`", "expected `order`"],
        ),
        (
            r#"integrator = { name = "galerkin", degree = 11 }"#,
            &["`run.integrator.degree` is 11", "1 to 10"],
        ),
        (
            r#"integrator = { name = "galerkin", degree = 4, points = 3 }"#,
            &["`run.integrator.points` is 3", "at least the degree"],
        ),
        (
            r#"integrator = { name = "fehlberg78", tolerance = 0.5 }"#,
            &["`run.integrator.tolerance` is 0.5", "1e-17 to 0.1"],
        ),
        (
            "integrator = { name = \"fehlberg78\", tolerance = 1e-9 }\nsubdivide = 3",
            &["`run.subdivide` is 3", "0 beside Fehlberg"],
        ),
        (
            "integrator = \"lgvi\"\nsubsteps = 0",
            &["`run.substeps` is 0", "> 0"],
        ),
        (
            "integrator = \"lgvi\"\nsubdivide = 21",
            &["`run.subdivide` is 21", "0 to 20"],
        ),
        (
            "integrator = \"lgvi\"\nsubstep = 2",
            &["unknown field `substep`", "`substeps`"],
        ),
    ] {
        assert_refused(&text(integrator), parts);
    }
}

/// After the chosen steps, a body on a circular orbit is at its exact position within the tolerance.
#[test]
fn an_automatic_integrator_meets_its_tolerance() {
    for tolerance in [1e-4, 1e-9] {
        let text = text(&format!(
            "integrator = {{ name = \"auto\", tolerance = {tolerance:e} }}"
        ));
        let text = with(
            &text,
            "[[bodies]]",
            "[gravity.central]\ngm = 0.75\n[[bodies]]",
        );
        let text = with(&text, "duration = 1.0", "duration = 60.0");
        let scene = Scene::parse("test", &text).unwrap();
        assert_eq!(scene.integration, Integration::Auto { tolerance });
        let scheme = scene.scheme().unwrap();
        assert_eq!(scene.scheme().unwrap(), scheme);
        let mut simulation = scene.simulation(scheme).unwrap();
        for _ in 0..scene.steps {
            simulation.advance(&[Default::default()]).unwrap();
        }
        let (sin, cos) = (60.0_f64 * 0.5 / 3.0).sin_cos();
        let circle = nalgebra::Vector3::new(3.0 * cos, 3.0 * sin, 0.0);
        let error = (simulation.states()[0].position - circle).norm() / 3.0;
        assert!(error < tolerance, "{scheme:?}: {error:e}");
    }
}

#[test]
fn integrators_of_free_bodies_refuse_gravity() {
    for integrator in [
        r#""closed_form""#,
        r#"{ name = "euler_poincare", degree = 2 }"#,
    ] {
        let text = text(&format!("integrator = {integrator}"));
        let text = with(
            &text,
            "[[bodies]]",
            "[gravity.central]\ngm = 1.0\n[[bodies]]",
        );
        assert_refused(&text, &["`run.integrator`", "free bodies only"]);
    }
}

#[test]
fn wisdom_holman_is_for_motion_about_a_center() {
    for (integrator, scheme) in [
        (r#""wisdom_holman""#, KeplerScheme::Aba1064),
        (
            r#"{ name = "wisdom_holman", scheme = "leapfrog" }"#,
            KeplerScheme::Leapfrog,
        ),
        (
            r#"{ name = "wisdom_holman", scheme = "aba82" }"#,
            KeplerScheme::Aba82,
        ),
        (
            r#"{ name = "wisdom_holman", scheme = "aba864" }"#,
            KeplerScheme::Aba864,
        ),
    ] {
        let text = text(&format!("integrator = {integrator}"));
        assert_refused(
            &text,
            &["`run.integrator`", "Wisdom–Holman", "center", "Nyström"],
        );
        let uniform = with(
            &text,
            "[[bodies]]",
            "[gravity.uniform]\nacceleration = [0.0, 0.0, -1.0]\n[[bodies]]",
        );
        assert_refused(&uniform, &["`run.integrator`", "center"]);
        let central = with(
            &text,
            "[[bodies]]",
            "[gravity.central]\ngm = 0.75\n[[bodies]]",
        );
        let scene = Scene::parse("test", &central).unwrap();
        let method = Method::WisdomHolman { scheme };
        assert_eq!(scene.integration, Integration::Method(method));
    }
    let unknown = text(r#"integrator = { name = "wisdom_holman", scheme = "aba10" }"#);
    assert_refused(&unknown, &["unknown variant `aba10`", "`aba864`"]);
}

/// A body on a circular orbit is at its exact position after one step of most of a revolution, by an integrator that skips nothing.
#[test]
fn kepler_motion_is_flown_in_one_step() {
    let text = text("integrator = \"wisdom_holman\"");
    let text = with(
        &text,
        "[[bodies]]",
        "[gravity.central]\ngm = 0.75\n[[bodies]]",
    );
    let text = with(
        &text,
        "duration = 1.0\nsteps = 100",
        "duration = 30.0\nsteps = 1",
    );
    let scene = Scene::parse("test", &text).unwrap();
    let scheme = scene.scheme().unwrap();
    let mut simulation = scene.simulation(scheme).unwrap();
    let rates = scene.rates(simulation.system(), simulation.states());
    assert!(rates.orbit * 30.0 > 4.0, "{rates:?}");
    assert_eq!(scene.long_orbit(scheme, rates), None);
    simulation.advance(&[Default::default()]).unwrap();
    let (sin, cos) = (30.0_f64 * 0.5 / 3.0).sin_cos();
    let circle = nalgebra::Vector3::new(3.0 * cos, 3.0 * sin, 0.0);
    let error = (simulation.states()[0].position - circle).norm();
    assert!(error < 1e-14, "{error:e}");
}

#[test]
fn a_method_that_cannot_fly_a_body_says_which() {
    let body = with(
        BODY,
        "velocity = [0.0, 0.5, 0.0]\n",
        "mobility = \"fixed\"\n",
    );
    let body = with(&body, "angular_velocity = [0.1, 0.2, 0.3]\n", "");
    let run = with(RUN, "\"lgvi\"", "\"lgvi_lagrangian\"");
    assert_refused(
        &format!("{run}\n[[bodies]]\nname = \"rock\"{body}"),
        &["`run.integrator`", "Lagrangian", "rock", "free or pivoted"],
    );
}

/// Ten substeps are equivalent to ten steps and end in the same state.
#[test]
fn substeps_are_steps_of_the_method() {
    let flown = |text: &str| {
        let scene = Scene::parse("test", text).unwrap();
        let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
        for _ in 0..scene.steps {
            simulation.advance(&[Default::default()]).unwrap();
        }
        simulation.states()[0]
    };
    let fine = flown(&text(r#"integrator = "lgvi""#));
    let coarse = text("integrator = \"lgvi\"\nsubsteps = 10");
    let coarse = with(&coarse, "steps = 100\n", "steps = 10\n");
    let coarse = flown(&coarse);
    assert_eq!(coarse.angular_momentum, fine.angular_momentum);
    assert!((coarse.position - fine.position).norm() < 1e-14);
}

/// A body that turns too far in one step can be flown if the step may be subdivided, and the subdivisions are reported.
#[test]
fn steps_are_cut_as_deep_as_the_scene_allows() {
    let fast = |run: &str| {
        let text = with(&text(run), "[0.1, 0.2, 0.3]", "[0.0, 0.0, 300.0]");
        let scene = Scene::parse("test", &text).unwrap();
        let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
        simulation.advance(&[Default::default()])
    };
    assert!(fast(r#"integrator = "lgvi""#).is_err());
    assert!(fast("integrator = \"lgvi\"\nsubdivide = 1").is_err());
    let report = fast("integrator = \"lgvi\"\nsubdivide = 2").unwrap();
    assert_eq!(report.cuts, 4);
}
