//! Every trial, short.

#![allow(clippy::panic, clippy::print_stdout)]

use lgvi_stress::{FAMILIES, Length};

fn holds(family: &str) {
    let (_, trials) = FAMILIES
        .iter()
        .find(|(name, _)| *name == family)
        .unwrap_or_else(|| panic!("no family {family}"));
    for trial in *trials {
        let report = trial
            .run(Length::Short)
            .unwrap_or_else(|error| panic!("{}: {error}", trial.name));
        let figures: Vec<_> = report.figures().iter().map(ToString::to_string).collect();
        println!("{}: {}", trial.name, figures.join("; "));
        assert!(report.passes(), "{}: {figures:#?}", trial.name);
    }
}

macro_rules! families {
    ($($family:ident)*) => {
        $(#[test]
        fn $family() {
            holds(stringify!($family));
        })*

        #[test]
        fn no_family_is_left_out() {
            let names: Vec<_> = FAMILIES.iter().map(|(name, _)| *name).collect();
            assert_eq!(names, [$(stringify!($family)),*]);
        }
    };
}

families! {tumbling shapes limit rounding energy ratio approach steps range}
