use lgvi_control::{NewtonSettings, Start, solve};
#[test]
fn scratch() {
    let file = crate::constraints::references();
    let name = std::env::var("NAME").unwrap();
    let case = file["cases"].as_array().unwrap().iter().find(|c| c["name"] == *name).unwrap();
    let t = crate::constraints::transfer(&file, case);
    let r = solve(&t, Start::Cold, &NewtonSettings::default(), |p| { println!("  {} tr {} len {} viol {:.1e} stat {:.1e} cost {:.10} {:?}", p.iteration, p.trials, p.step_length, p.violation, p.stationarity, p.cost, p.phase); true });
    match r { Ok(p) => println!("{} {:?}", p.cost, p.certificate), Err(e) => println!("{e}") }
}
