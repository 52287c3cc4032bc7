use lgvi_control::{Constraint, NewtonSettings, Start, solve};
use crate::case::Case;
#[test]
fn scratch() {
    let get = |n: &str, d: &str| std::env::var(n).unwrap_or(d.into());
    let free = Case::load(&get("SET", "C_ii")).transfer(100);
    let plan = solve(&free, Start::Cold, &NewtonSettings::default(), |_| true).expect("a plan");
    let most = plan.controls.iter().map(|u| u.force.norm()).fold(0.0, f64::max);
    let mm = plan.controls.iter().map(|u| u.moment.amax()).fold(0.0, f64::max);
    let part: f64 = get("PART", "0.8").parse().unwrap();
    let mut c = vec![Constraint::ForceNorm { limit: part * most }];
    if get("BOTH", "") != "" { c.push(Constraint::MomentComponents { limit: nalgebra::Vector3::from_element(part * mm) }); }
    let bound = free.clone().with_constraints(c).unwrap();
    let mut n = 0;
    let r = solve(&bound, Start::Cold, &NewtonSettings::default(), |p| { n = p.iteration; true });
    println!("{:?} {n}", r.as_ref().map(|p| p.cost));
    let r = solve(&bound, Start::Warm(&r.unwrap()), &NewtonSettings::default(), |p| { n = p.iteration; println!("  {p:?}"); true });
    println!("{:?} {n}", r.map(|p| p.cost));
}
